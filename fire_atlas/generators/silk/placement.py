"""Where sheets hang: as a recipe lists them, by rule, or on a match."""

import math

from fire_atlas.core.chance import Stage, generator
from fire_atlas.generators.silk.intruders import Body
from fire_atlas.generators.silk.mesh import Placement
from fire_atlas.recipe.silk import Arrangement, Sheet

_MATCH_FLAME = (13.0, 20.0)
"""Width and height of the sheets of a burning match, in its radius."""

_GOLDEN = 2.399963
"""Golden angle, rad: it spreads any number of bases evenly over a disc."""


def placed(sheets: tuple[Sheet, ...] | Arrangement, seed: int) -> list[Placement]:
    """Where the sheets of a recipe hang. In an arrangement no two are of a kind: sizes and angles
    differ a little, as the tongues of a fire do."""
    if not isinstance(sheets, Arrangement):
        return [Placement(s.at, s.width, s.height, s.angle) for s in sheets]
    count = sheets.count
    chance = generator(seed, Stage.SHEETS)
    heights = sheets.height * chance.uniform(0.88, 1.0, count)
    widths = sheets.width * chance.uniform(0.9, 1.08, count)
    jitter = chance.uniform(-0.5, 0.5, (3, count))
    found = []
    for i in range(count):
        x, y, angle = _by_rule(sheets, i, *(float(value) for value in jitter[:, i]))
        at = (sheets.at[0] + x, sheets.at[1] + y, sheets.at[2])
        found.append(Placement(at, float(widths[i]), float(heights[i]), angle))
    return found


def _by_rule(
    sheets: Arrangement, i: int, one: float, two: float, three: float
) -> tuple[float, float, float]:
    """Place (right, away), heights, and angle, degrees, of sheet ``i``, shaken by three numbers
    of -0.5..0.5."""
    count, spread = sheets.count, sheets.spread
    share = (i + 0.5) / count
    match sheets.arrangement:
        case "crossed":
            far = spread * math.sqrt(share)
            angle = 180 * i / count + 60 * three / count  # the first faces the front
            return far * math.cos(i * _GOLDEN), far * math.sin(i * _GOLDEN), angle
        case "ring":
            turn = 2 * math.pi * (share + 0.3 * one / count)
            # Turned out of the ring: from no side are all seen from their edges.
            angle = math.degrees(turn) + (125 if i % 2 else 55)
            return spread * math.cos(turn), spread * math.sin(turn), angle
        case "line":
            along = (share - 0.5) * spread + two * spread / (2 * count)
            return along, 0.3 * sheets.width * one, 40 * three + (25 if i % 2 else -25)


def match_flames(body: Body) -> list[Placement]:
    """Two crossed sheets at the head of a match."""
    width, height = (body.radius * k for k in _MATCH_FLAME)
    x, y, z = (float(c) for c in body.places[0])
    return [Placement((x, y, z - 0.06 * height), width, height, angle) for angle in (25.0, 115.0)]

"""How the flakes move on the real clips, beside the motion of the clips themselves.

Run it from the checkout: ``python -m tools.bench.motion [--json]``. FIRE_ATLAS_CLIPS names the
folder of clips; those that are not there are left out.

The first table has correlations of velocities, x and y, inside the flame (brightness above 60,
flow above 0.5 px a frame). Flakes are those written into the tracks, without jitter
(``scatter: 1``), and many, for statistics; each row of the tracks is compared with the clip's flow
at its pixel:

- ``flow``: dense inverse search at full resolution (the effect uses it at the grid's);
- ``others``: the median of four methods that the effect does not use;
- ``ceiling``: of the others with the first, at the same places: how far they agree at all;
- ``default``: of flakes with the default jitter, which turns their whole velocity, with the first;
- ``paper``, ``others``: as the first two with ``features.preset: paper``.

The second table has the flakes of the defaults: how many are born while the clip plays once, and
(of many, for statistics) the share that ends higher than it began; then, with the clip played again
and again for six seconds, the mean speed of the air where the clip is dark (brightness below 10)
against that of the plume, lift / drag; the most rows in any 5 % of the plume, and in one of 20 x 20
cells of the frame, against the mean of the plume; what became of the flakes.

Exits 1 if a clip with a rising flame misses a bound. With the other methods the effect has to keep
the bounds where dense inverse search itself does.
"""

import json
import math
import os
import sys
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from fire_atlas.core.clip import Clip
from fire_atlas.effect.field.buoyancy import LIFT
from fire_atlas.effect.flakes.statistics import flake_figures
from fire_atlas.recipe.effect import Buoyancy
from tests.support.clip_motion import (
    correlation,
    crowding,
    dis_flow,
    flows_of,
    in_the_flame,
    other_flow,
    plume_speed,
    share_that_rises,
)
from tests.support.clips import ALL_CLIPS, RISING, looped, real_clip
from tests.support.effect import run_effect

Pair = tuple[float, float]

MANY = 600
"""Births a second, for statistics. Flakes do not know of each other, so nothing else changes."""

PLENTY = 200
"""Births a second in the plume: more would also count the cells that hardly a flake comes to."""

LONG = 6.0
"""Seconds for which the plume is watched."""

LEAST_X, LEAST_Y, LEAST_RISE, MOST_CROWDED = 0.75, 0.6, 0.95, 4.0

PAPER: dict[str, Any] = {
    "features": {"preset": "paper"},
    "flakes": {"scatter": 1, "rate": MANY},
}
"""The paper's way."""


@dataclass(frozen=True, slots=True)
class Agreement:
    """Correlations (x, y) with the flow of a clip.

    Attributes:
        places: Rows of the tracks that were compared.
        flow: Of the flakes with the flow by dense inverse search.
        others: With that by the other methods.
        ceiling: Of the two flows with each other.
        default: Of flakes with the default jitter, with the first.
        paper, paper_others: Of the flakes made in the paper's way.
    """

    places: int
    flow: Pair
    others: Pair
    ceiling: Pair
    default: Pair
    paper: Pair
    paper_others: Pair


@dataclass(frozen=True, slots=True)
class Plume:
    """What flakes of the defaults do.

    Attributes:
        flakes: Seen while the clip plays once.
        rise: Share that ends higher than it began.
        speed: Of the air in the dark, against lift / drag.
        crowded: Fullest 5 % of the plume against the mean.
        cell: Fullest cell against the mean.
        fates: Shares that left by the top, by the sides, by the bottom, and burnt out.
    """

    flakes: int
    rise: float
    speed: float
    crowded: float
    cell: float
    fates: tuple[float, float, float, float]


def agreement(clip: Clip) -> Agreement:
    """Compare flakes without jitter with the flow of ``clip``."""
    flows, others = flows_of(clip, dis_flow), flows_of(clip, other_flow)
    # What is cut or loops otherwise than the clip has no flow to compare with.
    once = {"timeline": {"loop": "none"}}
    still = {"flakes": {"scatter": 1, "rate": MANY}, **once}
    ours = in_the_flame(run_effect(clip, still), flows, others)
    default = in_the_flame(run_effect(clip, {"flakes": {"rate": MANY}, **once}), flows, flows)
    papers = in_the_flame(run_effect(clip, {**PAPER, **once}), flows, others)
    return Agreement(
        len(ours.flow),
        correlation(ours.flakes, ours.flow),
        correlation(ours.flakes, ours.other),
        correlation(ours.flow, ours.other),
        correlation(default.flakes, default.flow),
        correlation(papers.flakes, papers.flow),
        correlation(papers.flakes, papers.other),
    )


def plume(clip: Clip) -> Plume:
    """Watch the flakes of the defaults, for as long as the clip is and for longer."""
    buoyancy = Buoyancy()
    long = run_effect(
        looped(clip, LONG), {"flakes": {"rate": PLENTY}, "timeline": {"loop": "none"}}
    )
    figures = {figure.name: figure.value for figure in flake_figures(long.tracks)}
    top, sides, bottom, cold = (
        figures.get(name, math.nan)
        for name in ("left by the top", "left by the sides", "fell out of the bottom", "burnt out")
    )
    return Plume(
        len(run_effect(clip).tracks.spawns),
        share_that_rises(run_effect(clip, {"flakes": {"rate": MANY}})),
        plume_speed(long) / (LIFT / buoyancy.drag),
        *crowding(long),
        (top, sides, bottom, cold),
    )


def missed(name: str, agrees: Agreement, does: Plume) -> list[str]:
    """Return the bounds that a clip misses, as sentences."""
    if does.flakes == 0:
        return [f"{name}: no flakes"]
    if name not in RISING:
        return []
    bounds = (
        ("correlation with the flow in x", agrees.flow[0], agrees.flow[0] >= LEAST_X, LEAST_X),
        ("correlation with the flow in y", agrees.flow[1], agrees.flow[1] >= LEAST_Y, LEAST_Y),
        ("share that ends higher", does.rise, does.rise >= LEAST_RISE, LEAST_RISE),
        ("crowding of the plume", does.crowded, not does.crowded > MOST_CROWDED, MOST_CROWDED),
        ("crowding of a cell", does.cell, not does.cell > MOST_CROWDED, MOST_CROWDED),
        ("share that falls out", does.fates[2], not does.fates[2] >= 0.5, 0.5),
    )
    misses = [
        f"{name}: {what} {is_:.3f}, bound {bound}" for what, is_, kept, bound in bounds if not kept
    ]
    if _holds(agrees.ceiling) and not _holds(agrees.others):
        misses.append(f"{name}: correlation with the other methods {agrees.others}")
    return misses


def _holds(pair: Pair) -> bool:
    return pair[0] >= LEAST_X and pair[1] >= LEAST_Y


def main() -> int:
    folder = Path(os.environ.get("FIRE_ATLAS_CLIPS", ""))
    clips = {n: real_clip(folder, n) for n in ALL_CLIPS if (folder / n / "meta.json").is_file()}
    if not clips:
        print("FIRE_ATLAS_CLIPS does not name a folder of real clips")
        return 2
    rows = {name: (agreement(clip), plume(clip)) for name, clip in clips.items()}
    misses = [line for name, (agrees, does) in rows.items() for line in missed(name, agrees, does)]
    if "--json" in sys.argv[1:]:
        tables = {n: {"agreement": asdict(a), "plume": asdict(p)} for n, (a, p) in rows.items()}
        print(json.dumps({"clips": tables, "missed": misses}, indent=2))
    else:
        print_tables(rows)
        print("\n".join(["", *(misses or ["all bounds are kept"])]))
    return 1 if misses else 0


def print_tables(rows: dict[str, tuple[Agreement, Plume]]) -> None:
    titles = "flow", "others", "ceiling", "default", "paper", "others"
    heads = "".join(f"{title:>14}" for title in titles)
    print(f"{'clip':32}{'rows':>6}{heads}")
    for name, (agrees, _) in rows.items():
        pairs = (
            agrees.flow, agrees.others, agrees.ceiling, agrees.default, agrees.paper,
            agrees.paper_others,
        )  # fmt: skip
        print(f"{name:32}{agrees.places:6}" + "".join(f"{x:8.2f}{y:6.2f}" for x, y in pairs))
    heads = "".join(f"{h:>9}" for h in ("flakes", "rise", "speed", "crowded", "cell"))
    fates = "".join(f"{h:>8}" for h in ("top", "sides", "bottom", "burnt"))
    print(f"\n{'clip':32}{heads}{fates}")
    for name, (_, does) in rows.items():
        print(
            f"{name:32}{does.flakes:9}{does.rise:9.3f}{does.speed:9.2f}{does.crowded:9.2f}{does.cell:9.2f}"
            + "".join(f"{share:8.2f}" for share in does.fates)
        )


if __name__ == "__main__":
    sys.exit(main())

"""What keys of simulated silk promise to be seen."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from fire_atlas.core.camera import Camera
from fire_atlas.generators.settings import GenerationSettings
from fire_atlas.generators.silk.renderer import SilkRenderer, silk_camera
from fire_atlas.recipe.silk import SilkSource
from fire_atlas.recipe.source import Views
from fire_atlas.recipe.wind import Wind
from tests.support.effect import Array
from tests.support.promises.promise import Figure, Promise, Scale, Unit, mean, merged, nested
from tests.support.silk_fires import silk_fire

_LIT = 0.2
"""Light of the brightest channel from which on a pixel is flame."""


@dataclass(frozen=True)
class Burning:
    """A simulated fire, seen by a camera."""

    fire: SilkRenderer
    camera: Camera

    @property
    def height(self) -> int:
        return self.camera.height

    @cached_property
    def shown(self) -> range:
        """Frames of which pixels are measured."""
        return range(0, self.fire.frames, 3)

    @cached_property
    def light(self) -> Array:
        """Light of these frames, (n, height, width, 3), as exposed."""
        return np.stack([self.fire.draw(i, self.camera).light for i in self.shown]).astype(float)

    @property
    def flame(self) -> Array:
        """Which pixels are flame, (n, height, width) bool."""
        return np.asarray(self.light.max(axis=-1) > _LIT)

    @cached_property
    def leans(self) -> Array:
        """Lean of the flame to the right in each frame, degrees, by a line through its pixels."""
        found = []
        for frame in self.light.max(axis=-1):
            rows, columns = np.nonzero(frame > _LIT)
            found.append(-np.degrees(np.arctan(np.polyfit(rows, columns, 1)[0])))
        return np.array(found)

    def extent(self, axis: int) -> Array:
        """Return the first and last lit row (axis 0) or column (axis 1) of each frame, (n, 2)."""
        return np.array([np.nonzero(frame.any(axis=1 - axis))[0][[0, -1]] for frame in self.flame])

    def later(self, values: Array) -> float:
        """Return by how much values of frames are larger in the last third than in the first."""
        third = max(1, len(values) // 3)
        return float(np.mean(values[-third:]) - np.mean(values[:third]))


def _tops(fire: Burning) -> Array:
    return np.asarray(100 * (1 - fire.extent(0)[:, 0] / fire.height))


def _top(fire: Burning) -> float:
    return mean(_tops(fire))


def _foot(fire: Burning) -> float:
    return 100 * (1 - mean(fire.extent(0)[:, 1]) / fire.height)


def _width(fire: Burning) -> float:
    return 100 * mean(np.diff(fire.extent(1), axis=1)) / fire.height


def _centre(fire: Burning) -> float:
    _, columns = np.nonzero(fire.flame.mean(axis=0))
    return 100 * float(columns.mean()) / fire.height


def _pixels(fire: Burning) -> float:
    return float(fire.camera.width * fire.camera.height)


def _shape(fire: Burning) -> float:
    return fire.camera.width / fire.camera.height


def _lights(fire: Burning) -> Array:
    return np.asarray(1000 * fire.light.mean(axis=(1, 2, 3)))


def _light(fire: Burning) -> float:
    return mean(_lights(fire))


def _blue(fire: Burning) -> float:
    colour = fire.light[fire.flame].mean(axis=0)
    return float(100 * colour[2] / colour.sum())


def _whiteness(fire: Burning) -> float:
    colour = fire.light[fire.flame].mean(axis=0)
    return float(100 * colour[2] / colour.max())


def _burnt_out(fire: Burning) -> float:
    return 100 * float((fire.light.min(axis=-1) > 0.9)[fire.flame].mean())


def _red_over_green(fire: Burning) -> float:
    red, green, _ = fire.light.sum(axis=(0, 1, 2))
    return float(red / green)


def _gas_speed(fire: Burning) -> float:
    found = [
        -fire.fire.motion(i, fire.camera)[..., 1][lit].mean()
        for i, lit in zip(fire.shown[::2], fire.flame[::2], strict=True)
    ]
    return 100 * mean(found) / fire.height


def _lean(fire: Burning) -> float:
    return mean(fire.leans)


def _swings(fire: Burning) -> float:
    """Return how often a second the top of a sheet swings to and fro, in the mean over sheets."""
    x = fire.fire.recording.x[:, :, -1, :, :2].mean(axis=2)
    turns = np.count_nonzero(np.diff(np.signbit(x - x.mean(axis=0)), axis=0), axis=0).mean()
    return float(turns / 2 * fire.fire.scene.fps / len(x))


def _later_height(fire: Burning) -> float:
    return 100 * fire.later(fire.fire.recording.x[:, :, -1, :, 2].mean(axis=(1, 2)))


def _later_speed(fire: Burning) -> float:
    return 100 * fire.later(fire.fire.recording.v_rms.mean(axis=1))


def _depth(fire: Burning) -> float:
    return 100 * float(np.ptp(fire.fire.scene.model.rest[:, 0, :, 1].mean(axis=1)))


def _shape_changes(fire: Burning) -> Array:
    """Return how much each frame differs from the one before, of its light."""
    steps = np.abs(np.diff(fire.light, axis=0)).mean(axis=(1, 2, 3))
    return np.asarray(steps / fire.light[1:].mean(axis=(1, 2, 3)))


def _change(fire: Burning) -> float:
    return mean(_shape_changes(fire))


def _smoke(fire: Burning) -> float:
    there = [
        fire.fire.soot(i, fire.camera)[lit].mean()
        for i, lit in zip(fire.shown[::2], fire.flame[::2], strict=True)
    ]
    return 100 * mean(there)


def _halo(fire: Burning) -> float:
    return 1000 * float(fire.light.max(axis=-1)[np.logical_not(fire.flame)].mean())


def _aside(fire: Burning) -> float:
    """Return the light within a twelfth of the height of the middle of the flame, a third up."""
    h, w = fire.light.shape[1:3]
    rows, columns = np.mgrid[:h, :w]
    disc = np.hypot(rows - 0.64 * h, columns - w / 2) < h / 12
    return 1000 * float(fire.light.max(axis=-1)[:, disc].mean())


def _covered(fire: Burning) -> float:
    return 100 * float(np.mean([fire.fire.draw(i, fire.camera).coverage.mean() for i in (0, 1)]))


def _opaque(fire: Burning) -> Array:
    """Return the mean place of what is drawn opaque, (row, column), px, in the last frame."""
    coverage = fire.fire.draw(fire.fire.frames - 1, fire.camera).coverage
    rows, columns = np.nonzero(coverage > 0.5)
    return np.array([rows.mean(), columns.mean()])


def _body_right(fire: Burning) -> float:
    return 100 * float(_opaque(fire)[1]) / fire.height


def _body_slope(fire: Burning) -> float:
    coverage = fire.fire.draw(0, fire.camera).coverage
    rows, columns = np.nonzero(coverage > 0.5)
    return -float(np.degrees(np.arctan(np.polyfit(columns, rows, 1)[0])))


def _body_length(fire: Burning) -> float:
    coverage = fire.fire.draw(0, fire.camera).coverage
    columns = np.nonzero((coverage > 0.5).any(axis=0))[0]
    return 100 * float(np.ptp(columns)) / fire.height


def _beside(fire: Burning) -> float:
    """Return the light in the right third of the last frames."""
    return 1000 * float(fire.light[-4:, :, -fire.camera.width // 3 :].mean())


def _later_top(fire: Burning) -> float:
    return fire.later(_tops(fire))


def _later_light(fire: Burning) -> float:
    return fire.later(_lights(fire))


TOP = Figure("height of the flame's top", Unit.HEIGHT, _top)
FOOT = Figure("height of the flame's foot", Unit.HEIGHT, _foot)
WIDTH = Figure("width of the fire", Unit.HEIGHT, _width)
CENTRE = Figure("place of the fire from the left", Unit.HEIGHT, _centre)
PIXELS = Figure("pixels of a frame", Unit.NUMBER, _pixels)
SHAPE = Figure("width of a frame, of its height", Unit.NUMBER, _shape)
LIGHT = Figure("light of the frame, thousandths", Unit.NUMBER, _light)
BLUE = Figure("blue in the light of the flame", Unit.SHARE, _blue)
WHITENESS = Figure("blue relative to red in the flame", Unit.SHARE, _whiteness)
BURNT_OUT = Figure("white pixels of the flame", Unit.SHARE, _burnt_out)
RED_OVER_GREEN = Figure("red over green, in wind of level 5", Unit.NUMBER, _red_over_green)
GAS_SPEED = Figure("speed at which the flame rises, a second", Unit.HEIGHT, _gas_speed)
LEAN = Figure("lean of the flame", Unit.DEGREES, _lean)
SWINGS = Figure("swings of the sheets' tops, a second", Unit.NUMBER, _swings)
CHANGE = Figure("change from frame to frame, of the light", Unit.NUMBER, _change)
SMOKE = Figure("light that the flame keeps back", Unit.SHARE, _smoke)
HALO = Figure("light beside the flame, thousandths", Unit.NUMBER, _halo)
ASIDE = Figure("light where the object is, thousandths", Unit.NUMBER, _aside)
COVERED = Figure("part of the frame that objects cover, %", Unit.NUMBER, _covered)
BODY_RIGHT = Figure("place of the object from the left, at last", Unit.HEIGHT, _body_right)
BODY_SLOPE = Figure("slope of the object", Unit.DEGREES, _body_slope)
BODY_LENGTH = Figure("length of the object as seen", Unit.HEIGHT, _body_length)
BESIDE = Figure("light in the right third at last, thousandths", Unit.NUMBER, _beside)
LATER_TOP = Figure("rise of the flame's top from first to last", Unit.HEIGHT, _later_top)
LATER_LIGHT = Figure("gain of light from first to last, thousandths", Unit.NUMBER, _later_light)
LATER_HEIGHT = Figure("rise of the sheets' tops from first to last", Unit.HEIGHT, _later_height)
LATER_SPEED = Figure("gain of the sheets' speed from first to last", Unit.HEIGHT, _later_speed)
DEPTH = Figure("depth of the fire from front to back", Unit.HEIGHT, _depth)


def _of_silk(
    key: str, sentence: str, figure: Figure, low: Any, high: Any, *, rises: bool = True,
    needs: Mapping[str, Mapping[str, Any]] | None = None,
) -> Promise:  # fmt: skip
    return Promise(key, sentence, figure, low, high, rises, needs or {}, "silk", fire="silk")


BLOWN = {"wind": {"level": 3}}
ARRANGED = {"source": {"sheets": {"arrangement": "crossed", "count": 5, "height": 0.9}}}
LINE = {"source": {"sheets": {"arrangement": "line", "count": 9, "width": 0.3}}}
RING = {"source": {"sheets": {"arrangement": "ring", "count": 9, "width": 0.2, "height": 0.5}}}
JET = {
    "source": {
        "sheets": {
            "arrangement": "jet", "direction": [0, 0, 1], "count": 5, "width": 0.2, "height": 0.6,
            "at": [0, 0, 0.3],
        }
    }
}  # fmt: skip
ON_ONE_OF_TWO = {
    "source": {
        "sheets": {"on": 0, "count": 5, "width": 0.2, "height": 0.4},
        "intruders": [
            {"shape": "sphere", "at": [0, 0, height], "radius": 0.08, "draw": False}
            for height in (0.1, 0.5)
        ],
    }
}
SINGLE = {"source": {"sheets": {"at": [0, 0, 0], "height": 0.9}}}
SPHERE = {"source": {"intruders": {"shape": "sphere", "at": [0, 0, 0.3], "radius": 0.08}}}
UNSEEN = merged(SPHERE, {"source": {"intruders": {"draw": False, "strength": 4}}})
LOG = {"source": {"intruders": {"shape": "log", "at": [0, 0, 0.2], "strength": 0}}}
ONCE = {"timeline": {"loop": "none"}}
LONG = {"timeline": {"loop": "none", "frames": 144}}
CARRIED = merged(
    ONCE,
    {
        "source": {
            "intruders": {
                "shape": "sphere", "radius": 0.05, "strength": 0, "draw": False,
                "keyframes": [{"t": 0, "at": [0, 0, 0.2]}, {"t": 1, "at": [0.32, 0, 0.2]}],
            }
        }
    },
)  # fmt: skip


def _ramp(first: float, last: float) -> list[dict[str, float]]:
    return [{"t": 0, "value": first}, {"t": 0.7, "value": last}]


PROMISES_OF_SILK = (
    _of_silk("source.size", "Length of a frame's longer side", PIXELS, "draft", "game"),
    _of_silk(
        "source.aspect",
        "Width of a frame divided by its height",
        SHAPE,
        0.5,
        2.0,
        needs={"source": {"size": "draft"}},
    ),
    _of_silk("source.width", "Width of a frame, px", PIXELS, 96, 192),
    _of_silk("source.height", "Height of a frame, px", PIXELS, 96, 192),
    _of_silk("source.foot", "Height of the ground above the lower edge", FOOT, 0.0, 0.3),
    _of_silk(
        "source.fuel",
        "The fuel, which sets stiffness, lift, speed and colours",
        BLUE,
        "wood",
        "gas",
    ),
    _of_silk("source.pressure", "More gives a higher, stiffer flame", TOP, 0.4, 1.6),
    _of_silk(
        "source.pressure",
        "More gives a higher, stiffer flame",
        LEAN,
        1.0,
        4.0,
        rises=False,
        needs=BLOWN,
    ),
    _of_silk(
        "source.pressure.keyframes",
        "The values over time",
        LATER_TOP,
        [{"t": 0, "value": 1}],
        [{"t": 1, "value": 0.3}, {"t": 1.5, "value": 1.6}],
        needs={"timeline": {"loop": "none", "frames": 72}},
    ),
    _of_silk("source.oxygen", "More burns faster, brighter and whiter", GAS_SPEED, 0.5, 2.0),
    _of_silk("source.oxygen", "More burns faster, brighter and whiter", LIGHT, 0.5, 2.0),
    _of_silk("source.oxygen", "More burns faster, brighter and whiter", WHITENESS, 0.5, 2.0),
    _of_silk(
        "source.oxygen.keyframes",
        "The values over time",
        LATER_LIGHT,
        _ramp(1, 1),
        _ramp(0.3, 3),
        needs=ONCE,
    ),
    _of_silk(
        "source.sheets.arrangement",
        "``line``: side by side from left to right",
        DEPTH,
        "ring",
        "line",
        rises=False,
        needs=merged(ARRANGED, {"source": {"sheets": {"spread": 0.2}}}),
    ),
    _of_silk(
        "source.sheets.direction",
        "[x, y, z] in which a ``jet`` blows",
        CENTRE,
        [-1, 0, 0],
        [1, 0, 0],
        needs=JET,
    ),
    _of_silk(
        "source.sheets.on", "all over which the sheets begin", FOOT, 0, 1, needs=ON_ONE_OF_TWO
    ),
    _of_silk("source.sheets.count", "Number of sheets", CHANGE, 1, 12, rises=False, needs=ARRANGED),
    _of_silk("source.sheets.width", "Width of a sheet, heights", WIDTH, 0.15, 0.5, needs=ARRANGED),
    _of_silk("source.sheets.height", "Height of a sheet, heights", TOP, 0.4, 0.9, needs=ARRANGED),
    _of_silk("source.sheets.spread", "the radius (``ring``)", WIDTH, 0.1, 0.3, needs=RING),
    _of_silk(
        "source.sheets.tile",
        "The line is as long as the frame is wide",
        WIDTH,
        False,
        True,
        needs=LINE,
    ),
    _of_silk(
        "source.sheets.at",
        "of the middle of the arrangement on the ground",
        CENTRE,
        [-0.2, 0, 0],
        [0.2, 0, 0],
        needs=ARRANGED,
    ),
    _of_silk("source.sheets.fuel", "What burns on", BLUE, "wood", "gas", needs=ARRANGED),
    _of_silk(
        "source.sheets.angle",
        "Direction of its width seen from above",
        LIGHT,
        0.0,
        70.0,
        rises=False,
        needs=merged(SINGLE, {"timeline": {"frames": 72}}),
    ),
    _of_silk(
        "source.mass", "Heavier silk sways more slowly", SWINGS, 0.3, 2.5, rises=False, needs=LONG
    ),
    _of_silk(
        "source.stiffness",
        "soft silk is drawn out by the lift, to a higher flame",
        TOP,
        0.1,
        3.0,
        rises=False,
    ),
    _of_silk(
        "source.lift",
        "With less, the wind bends it more",
        LEAN,
        0.8,
        10.0,
        rises=False,
        needs=merged(BLOWN, {"timeline": {"loop": "none", "frames": 72}}),
    ),
    _of_silk(
        "source.lift.keyframes",
        "The values over time",
        LATER_HEIGHT,
        _ramp(1, 1),
        _ramp(0.3, 2),
        needs=ONCE,
    ),
    _of_silk("source.gravity", "more draws the flame down", TOP, 0.0, 4.0, rises=False),
    _of_silk(
        "source.gravity.keyframes",
        "The values over time",
        LATER_HEIGHT,
        _ramp(1, 1),
        _ramp(1, 5),
        rises=False,
        needs=ONCE,
    ),
    _of_silk(
        "source.turbulence", "more makes it wilder, and thinner where it is fast", CHANGE, 0.0, 4.0
    ),
    _of_silk(
        "source.turbulence",
        "more makes it wilder, and thinner where it is fast",
        LIGHT,
        0.0,
        5.0,
        rises=False,
    ),
    _of_silk(
        "source.turbulence.keyframes",
        "The values over time",
        LATER_SPEED,
        _ramp(1, 1),
        _ramp(0, 3),
        needs=ONCE,
    ),
    _of_silk(
        "source.intruders.shape", "a cylinder lit from within", COVERED, "sphere", "wax", needs=LOG
    ),
    _of_silk(
        "source.intruders.at", "of its middle", BODY_RIGHT, [-0.2, 0, 0.2], [0.2, 0, 0.2], needs=LOG
    ),
    _of_silk(
        "source.intruders.keyframes",
        "Its place over time, if it moves",
        BODY_RIGHT,
        [{"t": 0, "at": [-0.2, 0, 0.2]}],
        [{"t": 0, "at": [-0.2, 0, 0.2]}, {"t": 0.9, "at": [0.2, 0, 0.2]}],
        needs=merged(ONCE, {"source": {"intruders": {"shape": "sphere"}}}),
    ),
    _of_silk("source.intruders.radius", "Radius, heights", COVERED, 0.02, 0.12, needs=LOG),
    _of_silk(
        "source.intruders.length",
        "Length of what is not a sphere",
        BODY_LENGTH,
        0.2,
        0.6,
        needs=LOG,
    ),
    _of_silk(
        "source.intruders.angle",
        "Direction in which it points, seen from above",
        BODY_LENGTH,
        0.0,
        80.0,
        rises=False,
        needs=LOG,
    ),
    _of_silk(
        "source.intruders.tilt",
        "Angle by which that end is raised",
        BODY_SLOPE,
        0.0,
        40.0,
        needs=LOG,
    ),
    _of_silk(
        "source.intruders.strength",
        "Force with which it pushes the flame aside",
        ASIDE,
        0.0,
        10.0,
        rises=False,
        needs=UNSEEN,
    ),
    _of_silk(
        "source.intruders.ignites",
        "then burns on with a flame of its own, also where it is moved to",
        BESIDE,
        False,
        True,
        needs=CARRIED,
    ),
    _of_silk(
        "source.intruders.draw",
        "Draw it, opaque and lit by the fire",
        COVERED,
        False,
        True,
        needs=SPHERE,
    ),
    _of_silk("source.soot", "More hides more of what is behind it", SMOKE, 0.3, 3.0),
    _of_silk(
        "source.grading",
        "hotter where sheets move faster",
        RED_OVER_GREEN,
        "fuel",
        "blackbody",
        rises=False,
        needs={"wind": {"level": 5}},
    ),
    _of_silk("source.intensity", "Brightness of the flame", LIGHT, 0.5, 2.0),
    _of_silk(
        "source.intensity",
        "in its middle from about 2 on",
        BURNT_OUT,
        0.5,
        4.0,
    ),
    _of_silk("source.glow", "a soft glow around it", HALO, 0.0, 0.05),
    _of_silk("wind.level", "Strength of a steady wind", LEAN, 0.0, 3.0),
)
"""Promises of ``source.kind: silk``."""

WITHOUT_OF_SILK = {
    "kind": "chooses this source",
    "rows": "changes how finely the sheets are simulated: in tests their lean stays",
    "columns": "changes how finely the sheets are simulated: in tests their lean stays",
    "damping": "calms what neighbours move against one another, by a tenth at 50, in tests; "
    "the drag of the air damps all else",
    "texture": "needs a clip: `tests/generators/silk/test_textures.py`",
}
"""Keys of silk that promise nothing to be seen without a clip, and why."""


def burn(promise: Promise, value: Any, seed: int, scale: Scale) -> Burning:
    """Simulate fire with the promise's key at ``value``, or left out."""
    keys = merged(promise.needs, nested(promise.key, value) if value is not None else {})
    given = dict(keys.get("source", {}))
    if value is None and promise.key == "source.intruders.keyframes":
        given["intruders"] = {**given["intruders"], "at": [0, 0, 0.2]}
    for items in ("sheets", "intruders"):
        if isinstance(given.get(items), dict) and "arrangement" not in given[items]:
            given[items] = [given[items]]
    frame = {} if "size" in given else {"width": scale.height, "height": scale.height}
    rows, columns = scale.mesh
    usual = {**frame, "rows": rows, "columns": columns}
    sheets = {"arrangement": "crossed", "count": scale.sheets, "width": 0.35, "height": 0.9}
    source = SilkSource.model_validate({"kind": "silk", "sheets": sheets, **usual, **given})
    timeline = keys.get("timeline", {})
    frames = timeline.get("frames", scale.silk_frames)
    loops = timeline.get("loop") != "none"
    wind = Wind.model_validate(keys.get("wind", {}))
    settings = GenerationSettings(seed, wind, frames, 24.0, loops, Views())
    return Burning(silk_fire(source, settings), silk_camera(source, 0.0, 0.0))

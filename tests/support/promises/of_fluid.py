"""What keys of simulated gas promise to be seen."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.workers import Workers
from fire_atlas.generators.fluid.recording import record
from fire_atlas.generators.fluid.renderer import FluidView, fluid_camera
from fire_atlas.generators.fluid.scene import build_scene
from fire_atlas.generators.fluid.volume import Volume
from fire_atlas.generators.settings import GenerationSettings
from fire_atlas.recipe.fluid import FluidSource
from fire_atlas.recipe.source import Views
from fire_atlas.recipe.wind import Wind
from tests.support.effect import Array
from tests.support.promises.promise import Figure, Promise, Scale, Unit, mean, merged, nested


@dataclass(frozen=True)
class Burnt:
    """Simulated gas, seen from the front."""

    view: FluidView

    @property
    def height(self) -> int:
        return self.view.camera.height

    @cached_property
    def frames(self) -> range:
        """Frames of which pixels are measured: the later half, when the gas is where it goes."""
        count = len(self.view.volumes)
        return range(count // 2, count)

    @cached_property
    def shown(self) -> NDArray[np.float32]:
        """These frames, (n, height, width, 4)."""
        return np.stack([self.view.frame(i) for i in self.frames])

    @property
    def cover(self) -> Array:
        """Mean coverage of a pixel over these frames, (height, width)."""
        return np.asarray(self.shown[..., 3].mean(axis=0), np.float64)


def _top(fire: Burnt) -> float:
    """Return the height above the lower edge of the middle of what covers."""
    rows = fire.cover.sum(axis=1)
    return 100 * (1 - float((rows * np.arange(len(rows))).sum() / rows.sum()) / fire.height)


def _width(fire: Burnt) -> float:
    """Return the width of what covers, four standard deviations."""
    columns = fire.cover.sum(axis=0)
    place = np.arange(len(columns))
    middle = (columns * place).sum() / columns.sum()
    spread = np.sqrt((columns * (place - middle) ** 2).sum() / columns.sum())
    return float(400 * spread / fire.height)


def _centre(fire: Burnt) -> float:
    """Return the place of the middle of what covers, from the left."""
    columns = fire.cover.sum(axis=0)
    return 100 * float((columns * np.arange(len(columns))).sum() / columns.sum()) / fire.height


def _lean(fire: Burnt) -> float:
    """Return how far the upper half of what covers lies to the right of the lower half, degrees."""
    half = fire.height // 2
    middles = [
        float((part.sum(axis=0) * np.arange(part.shape[1])).sum() / part.sum())
        for part in (fire.cover[:half], fire.cover[half:])
    ]
    return float(np.degrees(np.arctan2(middles[0] - middles[1], half)))


def _light(fire: Burnt) -> float:
    return 1000 * float(fire.shown[..., :3].mean())


def _whiteness(fire: Burnt) -> float:
    red, _, blue = fire.shown[..., :3].sum(axis=(0, 1, 2), dtype=np.float64)
    return float(100 * blue / red)


def _smoke(fire: Burnt) -> float:
    return 100 * mean([float(fire.view.smoke(i).mean()) for i in fire.frames])


def _outline(fire: Burnt) -> float:
    """Return the mean length of the outline of what covers by a quarter, of its area's root."""
    found = []
    for cover in fire.shown[..., 3] > 0.25:
        steps = np.count_nonzero(np.diff(cover, axis=0)) + np.count_nonzero(np.diff(cover, axis=1))
        found.append(float(steps / np.sqrt(max(1, int(np.count_nonzero(cover))))))
    return mean(found)


def _steepness(fire: Burnt) -> float:
    """Return how much coverage changes from px to px, of itself."""
    cover = fire.shown[..., 3]
    return 100 * float(np.abs(np.diff(cover, axis=2)).mean() / cover.mean())


def _cubes(fire: Burnt) -> float:
    return 1 / fire.view.scene.grid.cell


def _lit_frames(fire: Burnt) -> float:
    """Return the part of all frames in which anything is seen."""
    count = len(fire.view.volumes)
    return 100 * mean([float(fire.view.frame(i)[..., 3].max() > 0.1) for i in range(count)])


TOP = Figure("height of the middle of the fire", Unit.HEIGHT, _top)
WIDTH = Figure("width of the fire", Unit.HEIGHT, _width)
CENTRE = Figure("place of the fire from the left", Unit.HEIGHT, _centre)
LEAN = Figure("lean of the fire", Unit.DEGREES, _lean)
LIGHT = Figure("light of the frame, thousandths", Unit.NUMBER, _light)
WHITENESS = Figure("blue relative to red", Unit.SHARE, _whiteness)
SMOKE = Figure("part of the background that smoke hides", Unit.NUMBER, _smoke)
OUTLINE = Figure("length of the outline, of the root of its area", Unit.NUMBER, _outline)
STEEPNESS = Figure("how steep the edges of the smoke are", Unit.NUMBER, _steepness)
CUBES = Figure("cubes along a height", Unit.NUMBER, _cubes)
LIT_FRAMES = Figure("frames in which anything is seen", Unit.SHARE, _lit_frames)


def _of_gas(
    key: str, sentence: str, figure: Figure, low: Any, high: Any, *, rises: bool = True,
    needs: Mapping[str, Any] | None = None, fire: str = "campfire",
) -> Promise:  # fmt: skip
    keys = merged({"source": {"fire": fire}}, {"source": needs or {}})
    return Promise(key, sentence, figure, low, high, rises, keys, fire, fire="fluid")


PROMISES_OF_FLUID = (
    _of_gas("source.fire", "The ready fire to start from", SMOKE, "campfire", "smoke"),
    _of_gas("source.resolution", "Cubes across a square frame", CUBES, 22, 28),
    _of_gas("source.radius", "how wide the fire is", WIDTH, 0.2, 0.3),
    _of_gas("source.fuel_rate", "so the flame is higher", TOP, 0.4, 1.6),
    _of_gas("source.heat", "more is brighter and paler, less dim and red", LIGHT, 0.7, 1.3),
    _of_gas("source.heat", "more is brighter and paler, less dim and red", WHITENESS, 0.6, 1.6),
    _of_gas(
        "source.lift", "How fast hot gas rises", TOP, 0.3, 3.0, needs={"radius": 0.17},
        fire="fireball",
    ),
    _of_gas(
        "source.turbulence", "How much hot gas is stirred and swirls", STEEPNESS, 0.0, 3.0,
        rises=False, fire="smoke",
    ),
    _of_gas("source.detail", "tongues finer than the cubes", OUTLINE, 0.0, 1.0),
    _of_gas("source.smoke", "How much smoke comes of the fuel", SMOKE, 0.2, 1.5),
    _of_gas(
        "source.smoke_colour", "Colour of the smoke in full light", WHITENESS, "#c08040",
        "#4080c0", needs={"radius": 0.08}, fire="steam",
    ),
    _of_gas(
        "source.blast", "How far gas expands while it catches fire", WIDTH, 0.1, 1.0,
        needs={"radius": 0.17}, fire="explosion",
    ),
    _of_gas(
        "source.speed", "Speed of the gas that leaves a burner", TOP, 0.3, 3.0,
        needs={"radius": 0.08}, fire="steam",
    ),
    _of_gas(
        "source.direction", "Where that gas goes", LEAN, [-1, 0, 1], [1, 0, 1],
        needs={"radius": 0.08, "speed": 4}, fire="steam",
    ),
    _of_gas(
        "source.burning", "The fire catches, burns, goes out, and plays once", LIT_FRAMES,
        [0.05, 0.2], [0.05, 0.8],
    ),
    _of_gas(
        "source.burners", "Burners in place of the ready fire's", WIDTH, [{"size": 0.14}],
        [{"at": [-0.2, 0, 0], "size": 0.14}, {"at": [0.2, 0, 0], "size": 0.14}],
    ),
    _of_gas(
        "source.burners.at", "of its middle, heights", CENTRE, [-0.2, 0, 0.1], [0.2, 0, 0.1],
        needs={"burners": {"size": 0.14}},
    ),
    _of_gas("source.burners.size", "Half its width, heights", WIDTH, 0.14, 0.28),
    _of_gas(
        "source.burners.strength", "How much fuel its middle has", LIGHT, 0.2, 1.0,
        needs={"burners": {"size": 0.14}},
    ),
)  # fmt: skip
"""Promises of ``source.kind: fluid``."""

WITHOUT_OF_FLUID = {
    "kind": "chooses this source",
    "size": "is that of silk: its row is there",
    "aspect": "is that of silk: its row is there",
    "width": "is that of silk: its row is there",
    "height": "is that of silk: its row is there",
}
"""Keys of fluid that promise nothing to be seen, or what another row shows."""


def simulate_gas(promise: Promise, value: Any, seed: int, scale: Scale) -> Burnt:
    """Simulate gas with the promise's key at ``value``, or left out."""
    keys = merged(promise.needs, nested(promise.key, value) if value is not None else {})
    given = dict(keys.get("source", {}))
    if isinstance(given.get("burners"), dict):
        given["burners"] = [given["burners"]]
    usual = {"kind": "fluid", "resolution": scale.cubes}
    usual |= {"width": 3 * scale.height // 4, "height": scale.height}
    source = FluidSource.model_validate({**usual, **given})
    wind = Wind.model_validate(keys.get("wind", {}))
    settings = GenerationSettings(seed, wind, scale.gas_frames, 24.0, True, Views())
    scene = build_scene(source, settings)
    with Workers(1) as workers:
        volumes: list[Volume] = []
        record(scene, workers, volumes.append)
    return Burnt(FluidView(scene, volumes, fluid_camera(source, 0, 0), "srgb"))

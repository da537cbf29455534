"""Small fires to look at."""

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.camera import Camera
from fire_atlas.generators.settings import GenerationSettings
from fire_atlas.generators.silk.renderer import SilkRenderer, planned_scene, silk_camera
from fire_atlas.generators.silk.scene import SilkScene
from fire_atlas.generators.silk.simulation import Recording, simulate
from fire_atlas.recipe.silk import SilkSource
from fire_atlas.recipe.source import Views
from fire_atlas.recipe.wind import Wind
from tests.support.silk_fires import silk_fire

COARSE: dict[str, Any] = {"rows": 8, "columns": 6, "width": 64, "height": 80}
"""A mesh and a frame that are quick to make."""


def source(**keys: Any) -> SilkSource:
    return SilkSource.model_validate({"kind": "silk", **COARSE, **keys})


def settings(
    frames: int, loop: bool, wind: Wind | None = None, seed: int = 3, fps: float = 24.0
) -> GenerationSettings:
    return GenerationSettings(seed, wind or Wind(), frames, fps, loop, Views())


def fire(
    frames: int = 24, loops: bool = True, wind: dict[str, Any] | None = None, **keys: Any
) -> SilkRenderer:
    blown = Wind.model_validate(wind or {})
    return silk_fire(source(**keys), settings(frames, loops, blown))


def planned(
    frames: int = 24, loops: bool = True, wind: dict[str, Any] | None = None, **keys: Any
) -> SilkScene:
    """Return the scene that ``fire`` simulates."""
    blown = Wind.model_validate(wind or {})
    return planned_scene(source(**keys), settings(frames, loops, blown))


def recorded(
    frames: int = 24, loops: bool = True, wind: dict[str, Any] | None = None, **keys: Any
) -> Recording:
    """Return the sheets of ``fire`` alone, without the images on them, which take as long."""
    return simulate(planned(frames, loops, wind, **keys), frames, loops)


@cache
def torch() -> SilkRenderer:
    return fire()


def camera(
    azimuth: float = 0.0, elevation: float = 0.0, distance: float | None = None, **keys: Any
) -> Camera:
    return silk_camera(source(**keys), azimuth, elevation, distance)


def lean(recorded: NDArray[np.float32], sheets: slice = slice(None)) -> NDArray[np.float64]:
    """Angle, degrees, of the sheets to the right at half their height, in every frame."""
    x = recorded[:, sheets].astype(np.float64)
    middle, foot = x[:, :, x.shape[2] // 2], x[:, :, 0]
    away = (middle - foot).mean(axis=(1, 2))
    return np.asarray(np.degrees(np.arctan2(away[:, 0], away[:, 2])))


def spearman(one: NDArray[np.floating], other: NDArray[np.floating]) -> float:
    """Rank correlation of two series; equal values have their mean rank."""

    def ranks(values: NDArray[np.floating]) -> NDArray[np.float64]:
        _, group, count = np.unique(values, return_inverse=True, return_counts=True)
        return np.asarray((np.cumsum(count) - (count - 1) / 2)[group], np.float64)

    return float(np.corrcoef(ranks(one), ranks(other))[0, 1])

"""Small fires to look at."""

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fire_atlas.generators.camera import Camera
from fire_atlas.generators.silk.produce import Take, produce
from fire_atlas.generators.silk.render import Film, silk_camera
from fire_atlas.recipe.silk import SilkSource
from fire_atlas.recipe.wind import Wind

COARSE: dict[str, Any] = {"rows": 12, "columns": 8, "width": 64, "height": 80}
"""A mesh and a frame that are quick to make."""


def source(**keys: Any) -> SilkSource:
    return SilkSource.model_validate({"kind": "silk", **COARSE, **keys})


def film(
    frames: int = 24, loops: bool = True, wind: dict[str, Any] | None = None, **keys: Any
) -> Film:
    blown = Wind.model_validate(wind or {})
    return produce(Take(source(**keys), blown, seed=3, frames=frames, fps=24.0, loops=loops))


@cache
def torch() -> Film:
    return film()


def camera(azimuth: float = 0.0, elevation: float = 0.0, **keys: Any) -> Camera:
    return silk_camera(source(**keys), azimuth, elevation)


def lean(told: NDArray[np.float32], sheets: slice = slice(None)) -> NDArray[np.float64]:
    """Angle, degrees, of the sheets to the right at half their height, in every frame."""
    x = told[:, sheets].astype(np.float64)
    middle, foot = x[:, :, x.shape[2] // 2], x[:, :, 0]
    away = (middle - foot).mean(axis=(1, 2))
    return np.asarray(np.degrees(np.arctan2(away[:, 0], away[:, 2])))

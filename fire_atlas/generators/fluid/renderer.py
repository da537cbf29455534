"""A fire that was simulated as a fluid, seen by a camera."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from threading import Semaphore
from typing import ClassVar

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.camera import Camera
from fire_atlas.core.clip import FrontSurface, Values
from fire_atlas.core.easing import edge_fade
from fire_atlas.core.picture import brightest
from fire_atlas.core.pixels import (
    REC709,
    Pixels,
    Plane,
    as_plane,
    encode_unit,
    pixels_of_added,
)
from fire_atlas.generators.fluid.combustion import SMOKE
from fire_atlas.generators.fluid.drawing import Painter, SeenGas, enlarged, exposed
from fire_atlas.generators.fluid.fires import FIRES
from fire_atlas.generators.fluid.grid import Field
from fire_atlas.generators.fluid.scene import Scene
from fire_atlas.generators.fluid.sight import Sight
from fire_atlas.generators.fluid.volume import Volume
from fire_atlas.generators.front import PointCloud, front_surface_of
from fire_atlas.recipe.fluid import FluidSource

_DARK = 1e-3
"""Light of a cube, of white, below which it does not count as burning."""

EDGE = 0.05
"""Distance from the open sides of a frame over which a picture of gas fades to nothing, heights:
what leaves the frame would be cut there."""

_LEAST_OPACITY = np.float32(1e-4)
"""Least opacity that the light of smoke is divided by."""


@dataclass(frozen=True)
class FluidView:
    """A fire seen by one camera; implements ``generators.rendering.Rendering``.

    Attributes:
        scene: What was simulated.
        volumes: The gas of each frame; while it is simulated, of those before.
        camera: The camera.
        blend_space: Encoding in which the client blends.
        turns: What each thread holds while it draws: so many frames are drawn at once.
    """

    matte: ClassVar[str] = "luminance"
    matte_reason: ClassVar[str] = "brighter parts of a flame are more opaque, and so is dense smoke"
    motion: ClassVar[None] = None

    scene: Scene
    volumes: Sequence[Volume]
    camera: Camera
    blend_space: str
    turns: Semaphore = field(default_factory=Semaphore)

    @property
    def front(self) -> Camera:
        """The camera in front of the fire, level, with parallel lines of sight."""
        return self.camera.from_the_front()

    def frame(self, index: int) -> Pixels:
        """Draw frame ``index``: (height, width, 4).

        Flames cover as much as they shine, smoke as much as it hides.
        """
        size = self.camera.height, self.camera.width
        with self.turns:
            seen = self._painter.draw(self._gas(index), size, self._sight.pitch)
            return shown_gas(seen, self.blend_space) * self._edges[..., None]

    def smoke(self, index: int) -> Plane:
        """Return the share of light (height, width), 0..1, that smoke keeps back in a frame."""
        size = self.camera.height, self.camera.width
        with self.turns:
            hidden = _hidden(self._painter.smoke_depth(self._gas(index), size, self._sight.pitch))
            return as_plane(hidden * self._edges)

    @property
    def burning(self) -> Callable[[int], Plane] | None:
        """Which share of the light of a frame is fire's, by its number, drawn a px a cube; None
        without smoke."""
        return self._burning if self.scene.has_smoke else None

    def _burning(self, index: int) -> Plane:
        with self.turns:
            gas, pitch = self._gas(index), self._sight.pitch
            seen = self._painter.draw(gas, gas.shape[1:3], 1.0)
        fire, smoke = exposed(seen.fire).sum(axis=2), seen.smoke.sum(axis=2)
        share = as_plane(fire / np.maximum(fire + smoke, _LEAST_OPACITY))
        return enlarged(share, pitch)[: self.camera.height, : self.camera.width]

    def seen_by(self, camera: Camera) -> "FluidView":
        """Return the same fire seen by another camera."""
        return replace(self, camera=camera)

    def fire_depth(self, index: int, x: Values, y: Values, share: Values) -> Values:
        """Return the depth at which fire burns behind places, px; see ``FireInDepth``."""
        with self.turns:
            bright = self._brightness(self._gas(index))
        pitch, (_, rows, columns) = self._sight.pitch, bright.shape
        total = bright.sum(axis=0)
        if not total.any():
            return np.zeros(len(x))
        column = np.clip(x / pitch, 0, columns - 1).astype(np.intp)
        row = np.clip(y / pitch, 0, rows - 1).astype(np.intp)
        lit_rows, lit_columns = np.nonzero(total)
        for k in np.flatnonzero(total[row, column] == 0):
            nearest = np.argmin((lit_rows - row[k]) ** 2 + (lit_columns - column[k]) ** 2)
            row[k], column[k] = lit_rows[nearest], lit_columns[nearest]
        behind = np.cumsum(bright[::-1], axis=0)[:, row, column]
        passed = (behind < share * behind[-1]).sum(axis=0)
        found = self._sight.depths[::-1][np.minimum(passed, len(bright) - 1)]
        return np.asarray(found * -self.camera.scale, np.float64)

    def hidden(self, index: int, x: Values, y: Values, z: Values) -> NDArray[np.bool_]:
        """Return which places are behind something opaque: none, as gas is not."""
        return np.zeros(len(x), bool)

    def front_surface(self, index: int) -> FrontSurface:
        """Return the front of the fire and its smoke in frame ``index``."""
        with self.turns:
            gas = self._gas(index)
            smoke = self._painter.smoke(gas[..., SMOKE])
            thick = smoke * np.float32(self.scene.look.extinction * self.scene.grid.cell)
            weight = self._brightness(gas) + thick
            at = np.nonzero(weight > _DARK)
            pitch = self._sight.pitch
            place = np.stack(
                [
                    (at[2] + 0.5) * pitch,
                    (at[1] + 0.5) * pitch,
                    self._sight.depths[at[0]] * -self.camera.scale,
                ],
                axis=1,
            )
            cloud = PointCloud(place.astype(np.float64), weight[at].astype(np.float64))
            return front_surface_of(cloud, self.camera)[0]

    def _gas(self, index: int) -> Field:
        return self._sight.gas(self.volumes[index].scalars(), index)

    def _brightness(self, gas: Field) -> Field:
        """Return the luminance that each cube adds to a picture, 0 where it is dark."""
        light = self._painter.emission(gas) * np.float32(self.scene.grid.cell)
        bright = light[..., 0] * REC709[0] + light[..., 1] * REC709[1] + light[..., 2] * REC709[2]
        return as_plane(np.where(bright > _DARK, bright, 0))

    @cached_property
    def _edges(self) -> Plane:
        """How much of the picture is left near the sides of the frame, (height, width) 0..1."""
        height, width = self.camera.height, self.camera.width
        edge = EDGE * self.camera.scale
        down, across = edge_fade(height, edge), edge_fade(width, edge)
        if self.scene.grid.has_ground:
            down[height // 2 :] = 1
        return as_plane(np.outer(down, across))

    @cached_property
    def _painter(self) -> Painter:
        return Painter(self.scene.look, self.scene.heat, self.scene.grid.cell)

    @cached_property
    def _sight(self) -> Sight:
        return Sight(self.scene, self.camera)


def fluid_camera(
    source: FluidSource, azimuth: float, elevation: float, distance: float | None = None
) -> Camera:
    """Return a camera whose unit of length is the recipe's frame height; angles in degrees.

    ``distance`` is in heights; None for parallel lines of sight.
    """
    ready = FIRES[source.fire]
    return Camera(
        azimuth=math.radians(azimuth),
        elevation=math.radians(elevation),
        width=source.width,
        height=source.height,
        origin=(source.width * ready.side, source.height * (1 - ready.foot)),
        scale=float(source.height),
        distance=math.inf if distance is None else distance,
    )


def shown_gas(seen: SeenGas, blend_space: str) -> Pixels:
    """Return what is seen of gas as a camera exposes it, (height, width, 4).

    Smoke has a colour and hides what is behind it; fire adds its light. A client that blends sRGB
    values blends the colour, as it does with any other thing: the light of thin smoke would be a
    pale rim.
    """
    encoded = as_plane if blend_space == "linear" else encode_unit
    fire = encoded(exposed(seen.fire))
    coverage = brightest(fire)
    if not seen.depth.any():
        return pixels_of_added(fire, coverage, blend_space)
    opacity = _hidden(seen.depth)
    by_channel = cv2.merge((opacity, opacity, opacity))
    colour = exposed(as_plane(seen.smoke / np.maximum(by_channel, _LEAST_OPACITY)))
    shown = as_plane(1 - (1 - encoded(colour) * by_channel) * (1 - fire))
    coverage = as_plane(1 - (1 - opacity) * (1 - coverage))
    return pixels_of_added(shown, np.maximum(coverage, brightest(shown)), blend_space)


def _hidden(depth: Plane) -> Plane:
    return as_plane(-np.expm1(-depth))

"""Frames of the recorded sheets as an eye sees them: light that adds up, and its motion."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.easing import smooth_step
from fire_atlas.core.pixels import Pixels, Plane, as_plane
from fire_atlas.generators.camera import Camera
from fire_atlas.generators.silk import raster
from fire_atlas.generators.silk.drawing import Stage, set_stage
from fire_atlas.generators.silk.dress import Dress
from fire_atlas.generators.silk.grading import exposed
from fire_atlas.generators.silk.mechanics import normals
from fire_atlas.generators.silk.mesh import length
from fire_atlas.generators.silk.scene import Scene
from fire_atlas.generators.silk.simulation import Recording
from fire_atlas.recipe.silk import SilkSource

_FINER = 2
"""Samples a px, along and across."""

_BATCH = 16
"""Sheets drawn at once: memory does not grow with their number."""

_EDGE_ON, _FACE_ON = 0.3, 0.55
"""Cosine between a sheet's normal and the line of sight at which it vanishes, and how much more
it takes until it shows wholly."""

_STEEPEST = 0.25
"""Cosine of the elevation from which on upright sheets fade all the same."""

_DARK = 1e-4
"""Light under this is not drawn."""


@dataclass(frozen=True, slots=True)
class Frame:
    """What the eye sees.

    Attributes:
        light: (height, width, 3) linear, 0..1.
        cover: (height, width) 0..1, how much of each px an opaque intruder covers.
    """

    light: NDArray[np.float32]
    cover: Plane


@dataclass(frozen=True)
class Film:
    """The recorded fire, ready to be looked at from any side; safe to use from several threads.

    Attributes:
        scene: What was simulated.
        told: What the sheets do in every frame.
        dress: What is on the sheets.
        frames: How many frames.
        loops: Whether the first follows the last.
    """

    scene: Scene
    told: Recording
    dress: Dress
    frames: int
    loops: bool

    def look(self, i: int, camera: Camera) -> Frame:
        """Frame ``i`` as ``camera`` sees it. In a loop, frame ``frames`` is the first again."""
        time = i / self.scene.fps
        width, height = camera.width * _FINER, camera.height * _FINER
        stage = set_stage(self.scene.bodies, time, camera, _FINER)
        light = np.zeros((height, width, 3), np.float32)
        for sheets in self._batches():
            self._add(light, i, sheets, camera, stage)
        size = camera.width, camera.height
        if stage.is_empty:
            cover = np.zeros(size[::-1], np.float32)
        else:
            heart = self._heart(i, camera) * (_FINER, _FINER, 1)
            light += stage.lit_by(light, heart)
            cover = as_plane(cv2.resize(stage.cover, size, interpolation=cv2.INTER_AREA))
        light = as_plane(cv2.resize(light, size, interpolation=cv2.INTER_AREA))
        return Frame(exposed(light), cover)

    def flow(self, i: int, camera: Camera) -> NDArray[np.float32]:
        """Velocity (height, width, 2) of what frame ``i`` shows, px/s.

        The sheets carry the fire, and the fire moves on the sheets. Where several lie behind each
        other, the brighter counts more; where nothing burns, 0.
        """
        shape = camera.height, camera.width
        total = np.zeros((*shape, 3), np.float32)
        for sheets in self._batches():
            place, fade = self.nodes(i, sheets, camera)
            velocity = camera.project_vectors(self._velocity(i)[sheets])[..., :2]
            dressed = self.dress.flowing(i, sheets)
            grid = self.dress.grid(sheets, *place.shape[1:3])
            # Px of the frame to a texel, along the texture's x and y.
            along, down = np.gradient(place, axis=2), np.gradient(place, axis=1)
            steps = np.gradient(grid[..., 0], axis=2), np.gradient(grid[..., 1], axis=1)
            tangents = along / steps[0][..., None], down / steps[1][..., None]
            told = np.concatenate([grid, fade[..., None], velocity, *tangents], axis=-1)
            samples = raster.cover(raster.mesh_triangles(place, told), camera.width, camera.height)
            found = raster.look_up(dressed, samples.texel)
            t = samples.texel
            weight = found[:, 0] * t[:, 2]
            moved = t[:, 3:5] + t[:, 5:7] * found[:, 1:2] + t[:, 7:9] * found[:, 2:3]
            each = np.concatenate([weight[:, None], moved * weight[:, None]], axis=1)
            total += raster.add_up(samples.pixel, each, camera.width, camera.height)
        weight = total[..., :1]
        return np.asarray(
            np.divide(
                total[..., 1:], weight, out=np.zeros((*shape, 2), np.float32), where=weight > _DARK
            )
        )

    def nodes(
        self, i: int, sheets: slice, camera: Camera
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Where nodes are in the frame (sheets, rows, columns, 2), px, and how much of their light
        the eye gets (sheets, rows, columns).

        A sheet seen from its edge would be a bright line; what it stands for has depth, so it
        fades, and the sheets that cross it show instead. Fast gas is thin, and so is high gas.
        """
        x = np.asarray(self.told.x[i, sheets], np.float64)
        facing = np.abs(np.einsum("srcd,d->src", normals(x), camera.axes()[2]))
        # From above no upright sheet faces the eye; the one that does best shows wholly.
        facing /= max(math.cos(camera.elevation), _STEEPEST)
        share = smooth_step((facing - _EDGE_ON) / _FACE_ON)
        v = self._velocity(i)[sheets]
        speed = length(v) / (self.scene.fuel.speed * 4)
        up = np.linspace(0.0, 1.0, x.shape[1])[None, :, None]
        thin = (1 - 0.35 * up) / (1 + 0.25 * speed * speed)
        lit = self.told.lit[i, sheets, None, None]
        return camera.project(x)[..., :2], share * thin * lit

    def _batches(self) -> list[slice]:
        sheets = self.scene.model.sheets
        return [slice(n, min(n + _BATCH, sheets)) for n in range(0, sheets, _BATCH)]

    def _add(
        self, light: NDArray[np.float32], i: int, sheets: slice, camera: Camera, stage: Stage
    ) -> None:
        """Add the light of some sheets to a picture with ``_FINER`` samples a px."""
        height, width = light.shape[:2]
        dressed = self.dress.light(i, sheets)
        place, fade = self.nodes(i, sheets, camera)
        grid = self.dress.grid(sheets, *place.shape[1:3])
        told = np.concatenate([grid, fade[..., None] ** self.dress.tint.thin], axis=-1)
        if not stage.is_empty:
            away = camera.project(self.told.x[i, sheets])[..., 2:]
            told = np.concatenate([told, away], axis=-1)
        triangles = raster.mesh_triangles(place * _FINER, told)
        samples = raster.cover(self.dress.lit(dressed, triangles, sheets), width, height)
        found = raster.look_up(dressed, samples.texel) * samples.texel[:, 2:5]
        if not stage.is_empty:
            found *= stage.is_before(samples.pixel, samples.texel[:, 5])[:, None]
        light += raster.add_up(samples.pixel, found, width, height)

    def _velocity(self, i: int) -> NDArray[np.float64]:
        """Velocity (sheets, rows, columns, 3) of the nodes in frame ``i``, heights/s."""
        x = self.told.x
        if self.loops:
            before, after = (i - 1) % self.frames, (i + 1) % self.frames
        else:
            before, after = max(i - 1, 0), min(i + 1, self.frames - 1)
        steps = 2 if self.loops else max(after - before, 1)
        return np.asarray((x[after] - x[before]) * (self.scene.fps / steps), np.float64)

    def _heart(self, i: int, camera: Camera) -> NDArray[np.float64]:
        """Where the light of the fire comes from: px, px, heights away."""
        x = self.told.x[i]
        low = x[:, : max(1, x.shape[1] // 2)] * self.told.lit[i, :, None, None, None]
        total = max(float(self.told.lit[i].sum()) * low.shape[1] * low.shape[2], 1e-6)
        return camera.project(low.sum(axis=(0, 1, 2)) / total)


@dataclass(frozen=True, slots=True)
class SilkRendering:
    """The fire seen by one camera (a ``generators.rendering.Rendering``).

    Attributes:
        film: Draws it.
        camera: Where it is seen from.
        luminance_matte: Gives light (height, width, 3) the coverage it has over black.
    """

    matte: ClassVar[str] = "luminance"
    matte_reason: ClassVar[str] = "flames cover as far as they shine"

    film: Film
    camera: Camera
    luminance_matte: Callable[[NDArray[np.float32]], Pixels]

    def frame(self, index: int) -> Pixels:
        """Draw frame ``index``: (height, width, 4)."""
        frame = self.film.look(index, self.camera)
        pixels = self.luminance_matte(frame.light)
        if not frame.cover.any():
            return pixels
        # What is opaque covers fully; flames in front of it have added their light to it.
        cover = frame.cover[..., None]
        opaque = np.dstack([frame.light, np.ones_like(frame.cover)])
        return np.asarray(pixels + (opaque - pixels) * cover, np.float32)

    def motion(self, index: int) -> NDArray[np.float32]:
        """Velocity (height, width, 2) of what frame ``index`` shows, px/s."""
        return self.film.flow(index, self.camera)


def silk_camera(source: SilkSource, azimuth: float, elevation: float) -> Camera:
    """Camera for a recipe's frame, whose height is the unit of length; angles in degrees."""
    return Camera(
        azimuth=math.radians(azimuth),
        elevation=math.radians(elevation),
        width=source.width,
        height=source.height,
        origin=(source.width / 2, source.height * (1 - source.foot)),
        scale=float(source.height),
    )

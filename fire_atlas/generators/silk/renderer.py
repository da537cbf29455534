"""Draw the simulated sheets for any camera: their light, added up, and the motion of the fire."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import reduce
from typing import ClassVar, Self

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.camera import Camera
from fire_atlas.core.clip import Clip, FrontSurface, Values, Window
from fire_atlas.core.dither import dithered
from fire_atlas.core.easing import edge_fade, saturated, smooth_step
from fire_atlas.core.picture import brightest
from fire_atlas.core.pixels import Pixels, Plane, as_plane
from fire_atlas.generators.front import POINT_DISTANCE, PointCloud, front_surface_of
from fire_atlas.generators.settings import GenerationSettings
from fire_atlas.generators.silk import raster
from fire_atlas.generators.silk.burning_picture import CharredPicture, PictureBuffers
from fire_atlas.generators.silk.colour import expose
from fire_atlas.generators.silk.glow import scattered
from fire_atlas.generators.silk.ignition import Ignition
from fire_atlas.generators.silk.intruder_drawing import (
    Hearth,
    IntruderBuffers,
    draw_intruders,
    intruder_coverage,
    surface_depth,
)
from fire_atlas.generators.silk.mechanics import lengths, normals, refined
from fire_atlas.generators.silk.scene import (
    NO_MASKS,
    Masks,
    SilkScene,
    build_scene,
    check_length,
    check_loop,
)
from fire_atlas.generators.silk.sheet_textures import (
    FadingTextures,
    SheetTextures,
    cull_dark,
    make_textures,
)
from fire_atlas.generators.silk.simulation import Recording, blended, simulate
from fire_atlas.recipe.silk import SilkSource

_SAMPLES = 2
"""Samples per pixel along each axis, where pictures are shown."""

_BATCH = 16
"""Number of sheets drawn at once, which limits memory."""

_MOST_KEPT = 1 << 21
"""Number of samples of sheets that are kept while a picture is drawn, which limits memory."""

_VANISHING_COSINE, _FADE_RANGE = 0.3, 0.55
"""Cosine between a sheet's normal and the line of sight at which it vanishes, and increase of that
cosine until it is fully visible."""

_MIN_COSINE = 0.25
"""Minimum cosine of the elevation that is compensated: from higher up all sheets fade."""

_THINNING = 0.35
"""Part of a sheet's opacity that is missing at its top."""

_MAX_THINNING = 4.0
"""Limit of how much thinner fast gas is, so that a flame that is carried along does not vanish."""

_SIDE_FADE = 0.1
"""Distance from the sides of the frame over which flames die, heights: a fire that wind bends out
of its frame would be cut there."""

_NEAR_FADE = 0.25
"""Distance before the camera within which sheets fade, heights."""

_GLOW_BEATS = 0.6
"""Rate at which the glow of logs swells, Hz."""

_MIN_SOLID = 0.5
"""Part of a pixel that an intruder covers from which on the pixel shows its front."""

_TOWARDS = np.array([1, 1, -1], np.float32)
"""Signs that turn camera axes (right, down, away) into right, down and towards the viewer."""

_MAX_DARK = 1e-4
"""Weight of light up to which a pixel counts as dark and has no motion."""


@dataclass(frozen=True, slots=True)
class SilkFrame:
    """A drawn frame.

    Attributes:
        light: (height, width, 3) linear, 0..1.
        coverage: (height, width) 0..1, fraction of each pixel that intruders cover.
    """

    light: NDArray[np.float32]
    coverage: Plane

    @classmethod
    def of(
        cls, light: NDArray[np.float32], coverage: Plane, window: Window, camera: Camera
    ) -> Self:
        """Return the frame of which this is a window, dark and bare around it."""
        size = camera.width, camera.height
        return cls(_on_black(light, window, size), _on_black(coverage, window, size))


@dataclass(frozen=True, slots=True)
class _SeenLight:
    """What a camera sees, before it is exposed.

    Attributes:
        window: The pixels that are held; all others are dark and bare.
        flame: (h, w, 3) light of the flames, sample by sample.
        solid: (h, w, 3) light of what stands in them, as it is seen through them, likewise.
        coverage: (h, w) 0..1, of what stands in them, likewise.
        glow: (rows, columns, 3) light of the flames that hazy air scatters, pixel by pixel: it is
            smooth.
    """

    window: Window
    flame: NDArray[np.float32]
    solid: NDArray[np.float32]
    coverage: Plane
    glow: NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class _FlameFragments:
    """Samples of a picture in which a sheet is seen.

    Attributes:
        pixel: (n,) index of the sample in the window that is drawn, row by row.
        light: (3, n) light that the flame sheds there.
        thickness: (n,) optical depth of its flame and soot.
        dimming: (3, n) or (3, 1) how much an optical depth in front dims its red, green and blue.
        depth: (n,) depth, heights.
    """

    pixel: NDArray[np.intp]
    light: NDArray[np.float32]
    thickness: NDArray[np.float32]
    dimming: NDArray[np.float32]
    depth: NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class SilkRenderer:
    """A recorded fire that can be drawn from any side; safe to use from several threads.

    Attributes:
        scene: The simulated scene.
        recording: Positions of the sheets in every frame.
        textures: Textures of the sheets.
        ignition: Which sheets and objects burn.
        frames: Number of frames.
        glow: Part of the flame's light that is scattered around it.
        pictures: The pictures that burn.
        samples: Samples per pixel along each axis.
    """

    scene: SilkScene
    recording: Recording
    textures: SheetTextures
    ignition: Ignition
    frames: int
    glow: float
    pictures: tuple[CharredPicture, ...] = ()
    samples: int = _SAMPLES

    def draw(self, i: int, camera: Camera) -> SilkFrame:
        """Draw frame ``i`` as seen by ``camera``. In a loop, frame ``frames`` equals frame 0."""
        seen = self._seen(i, camera)
        coverage = self._averaged(seen.coverage)
        light = self._averaged(seen.flame) + self._averaged(seen.solid) + seen.glow
        shown = expose(light)
        # At an edge samples are exposed one by one, or a bright one would hide its neighbours.
        edge = (coverage > 0) & (coverage < 1)
        samples = self._samples_of(seen.flame, edge) + self._samples_of(seen.solid, edge)
        shown[edge] = expose(samples + seen.glow[edge][:, None]).mean(axis=1)
        if self.glow:
            glows = brightest(seen.glow) > brightest(light) / 2
            cv2.copyTo(dithered(shown), glows.view(np.uint8), shown)
        return SilkFrame.of(shown, coverage, seen.window, camera)

    def solids(self, i: int, camera: Camera) -> SilkFrame:
        """Draw what stands in the fire in frame ``i``, in the flames' light and seen through them,
        and the glow of hazy air before it, but not the flames before it."""
        if not any(body.visible for body in self.scene.intruders) and not self.pictures:
            bare = np.zeros((camera.height, camera.width), np.float32)
            return SilkFrame(np.repeat(bare[..., None], 3, axis=2), bare)
        seen = self._seen(i, camera)
        coverage = self._averaged(seen.coverage)
        light = self._averaged(seen.solid) + seen.glow
        shown = np.zeros_like(light)
        whole, edge = coverage >= 1, (coverage > 0) & (coverage < 1)
        shown[whole] = expose(light[whole])
        samples = expose(self._samples_of(seen.solid, edge) + seen.glow[edge][:, None])
        shown[edge] = (samples * self._samples_of(seen.coverage, edge)[..., None]).mean(axis=1)
        return SilkFrame.of(shown, coverage, seen.window, camera)

    def solid_cover(self, i: int, camera: Camera) -> Plane:
        """Return the coverage (height, width) of what stands in the fire in frame ``i``."""
        intruders, time = self.scene.intruders, i / self.scene.fps
        coverage = intruder_coverage(intruders, time, camera, self.samples)
        for picture in self._seen_pictures(camera):
            coverage = np.maximum(coverage, picture.coverage)
        return self._averaged(coverage)

    def _averaged(self, sampled: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the mean of the samples of each pixel: (height, width, ...)."""
        size = sampled.shape[1] // self.samples, sampled.shape[0] // self.samples
        return as_plane(cv2.resize(sampled, size, interpolation=cv2.INTER_AREA))

    def _samples_of(
        self, sampled: NDArray[np.float32], pixels: NDArray[np.bool_]
    ) -> NDArray[np.float32]:
        """Return the samples (n, samples², ...) of n pixels, which are True in (height, width)."""
        (height, width), samples = pixels.shape, self.samples
        blocks = sampled.reshape(height, samples, width, samples, *sampled.shape[2:])
        found = blocks.swapaxes(1, 2)[pixels]
        return found.reshape(len(found), samples**2, *sampled.shape[2:])

    def _seen_pictures(self, camera: Camera) -> list[PictureBuffers]:
        seen = (picture.seen_by(camera, self.samples) for picture in self.pictures)
        return [picture for picture in seen if picture is not None]

    def _seen(self, i: int, camera: Camera) -> _SeenLight:
        """Return what ``camera`` sees of the flames and of what stands in them in frame ``i``."""
        intruders = self._seen_intruders(i, camera)
        pictures = self._seen_pictures(camera)
        window = self._window(i, camera)
        light, passed = self._flames(i, camera, window, intruders)
        if intruders.is_empty and not pictures and not self.glow:
            dark = np.zeros_like(light)
            return _SeenLight(window, light, dark, dark[..., 0], self._averaged(dark))
        size = camera.width * self.samples, camera.height * self.samples
        light = _on_black(light, self._sampled(window), size)
        averaged = self._averaged(light)
        glow = np.zeros_like(averaged)
        if self.glow:
            glow = scattered(averaged, camera.scale, self.glow, tiles=camera.tiles)
        solid, coverage = np.zeros_like(light), np.zeros_like(light[..., 0])
        unhidden = np.ones((*light.shape[:2], 1), np.float32)
        unhidden[self._sampled(window).slices] = passed
        for picture in pictures:
            solid += picture.lit_by(light, self._hearth(i)) * unhidden
            coverage = np.maximum(coverage, picture.coverage)
        if not intruders.is_empty:
            # By columns first: along a short axis numpy is slow.
            total = averaged.sum(axis=0, dtype=np.float64).sum(axis=0) / camera.scale**2
            lights = [(total * share, place) for share, place in self._fires(i, camera)]
            covered = intruders.covered
            bodies = intruders.lit_by(lights, camera) * unhidden[covered]
            solid[covered] = solid[covered] * (1 - intruders.coverage[covered][:, None]) + bodies
            coverage = np.maximum(coverage, intruders.coverage)
        whole = Window(0, 0, camera.width, camera.height)
        return _SeenLight(whole, light, solid, coverage, glow)

    def _seen_intruders(self, i: int, camera: Camera) -> IntruderBuffers:
        time = i / self.scene.fps
        return draw_intruders(self.scene.intruders, time, camera, self.samples, self._hearth(i))

    def _window(self, i: int, camera: Camera) -> Window:
        """Return the pixels, at least one, that sheets may cover in frame ``i``."""
        nodes = camera.project(np.asarray(self.recording.x[i], np.float64)).reshape(-1, 3)[:, :2]
        size = np.array([camera.width, camera.height])
        first = np.clip(np.floor(nodes.min(axis=0)), 0, size - 1)
        end = np.clip(np.ceil(nodes.max(axis=0)), first + 1, size)
        (left, top), (right, bottom) = first.astype(int).tolist(), end.astype(int).tolist()
        return (
            Window(0, top, camera.width, bottom)
            if camera.tiles
            else Window(left, top, right, bottom)
        )

    def _sampled(self, window: Window) -> Window:
        """Return the samples of a window's pixels."""
        return Window(*(edge * self.samples for edge in window))

    def _flames(
        self, i: int, camera: Camera, window: Window, intruders: IntruderBuffers
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return the light (h, w, 3) of the flames in the samples of a window, and the share of
        light (h, w, 1) that passes all of them."""
        target = self._sampled(window)
        width, height = target.right - target.left, target.bottom - target.top
        light = np.zeros((height, width, 3), np.float32)
        medium = raster.Medium(height * width)
        batches = self._batches()
        kept: list[_FlameFragments] = []  # the first ones; others are drawn anew
        room = _MOST_KEPT
        for sheets in batches:
            flame = self._flame(i, sheets, camera, target, intruders)
            medium.add(flame.pixel, flame.depth, flame.thickness)
            room -= len(flame.pixel)
            if room >= 0:
                kept.append(flame)
        before = medium.before()
        for n, sheets in enumerate(batches):
            flame = kept[n] if n < len(kept) else self._flame(i, sheets, camera, target, intruders)
            shown = before.let_through(
                flame.light, flame.pixel, flame.depth, flame.thickness, flame.dimming
            )
            light += raster.accumulate(flame.pixel, shown, target)
        return light, np.exp(-medium.thickness).astype(np.float32).reshape(height, width, 1)

    def soot(self, i: int, camera: Camera) -> Plane:
        """Return the share of light (height, width), 0..1, that soot keeps back in frame ``i``: of
        an optical depth τ of all sheets, 1 − exp(−τ)."""
        intruders, window = self._seen_intruders(i, camera), self._window(i, camera)
        target = self._sampled(window)
        size = target.right - target.left, target.bottom - target.top
        thickness = np.zeros((*size[::-1], 1), np.float32)
        for sheets in self._batches():
            flame = self._flame(i, sheets, camera, target, intruders)
            thickness += raster.accumulate(flame.pixel, flame.thickness[None], target)
        kept_back = self._averaged(saturated(thickness[..., 0]))
        return _on_black(kept_back, window, (camera.width, camera.height))

    def front_surface(self, i: int, camera: Camera) -> FrontSurface:
        """Return the front of the fire and of what is in it in frame ``i``."""
        clouds = [self._points(i, sheets, camera) for sheets in self._batches()]
        place = np.concatenate([cloud.place for cloud in clouds])
        weight = np.concatenate([cloud.weight for cloud in clouds])
        fire, is_fire = front_surface_of(PointCloud(place, weight), camera)
        hearth, time = self._hearth(i), i / self.scene.fps
        solid = draw_intruders(self.scene.intruders, time, camera, 1, hearth)
        if solid.is_empty:
            return fire
        covered, depth = solid.covered, solid.position[:, 2] * np.float32(-camera.scale)
        is_before = ~is_fire[covered] | (depth > fire.depth[covered])
        shown = (solid.coverage[covered] > _MIN_SOLID) & is_before
        front = FrontSurface(fire.depth.copy(), fire.normal.copy())
        at = covered[0][shown], covered[1][shown]
        front.depth[at], front.normal[at] = depth[shown], solid.normal[shown] * _TOWARDS
        return front

    def _points(self, i: int, sheets: slice, camera: Camera) -> PointCloud:
        """Return points of ``sheets`` in frame ``i``, each with the light of its part."""
        x = np.asarray(self.recording.x[i, sheets], np.float64)
        points = refined(x, POINT_DISTANCE)
        texel = self.textures.texel_grid(sheets, *points.shape[1:3])
        texture = self.textures.light(i, sheets)[..., :3]
        found = raster.sample_texture(texture, as_plane(texel.reshape(-1, 2)))
        across, up = np.gradient(points, axis=2), np.gradient(points, axis=1)
        area = lengths(np.cross(across, up))
        brightness = expose(found).max(axis=1).reshape(area.shape)
        return PointCloud.seen_by(camera, points, brightness * area)

    def motion(self, i: int, camera: Camera) -> NDArray[np.float32]:
        """Return the velocity of the fire in frame ``i``: (height, width, 2) px/s.

        It is the velocity of the sheets plus that of the fire on them, averaged by brightness over
        overlapping sheets; 0 where nothing burns.
        """
        window = self._window(i, camera)
        total = np.zeros((window.bottom - window.top, window.right - window.left, 3), np.float32)
        for sheets in self._batches():
            projected, opacity = self.project_nodes(i, sheets, camera)
            opacity = opacity * self.density(i, sheets)
            position = projected[..., :2]
            x, v = (
                np.asarray(state[i, sheets], np.float64)
                for state in (self.recording.x, self.recording.v)
            )
            carried = camera.project_velocities(x, v)
            texel = self.textures.texel_grid(sheets, *position.shape[1:3])
            # Displacement in the frame per texel, along the texture's x and y.
            along, down = np.gradient(position, axis=2), np.gradient(position, axis=1)
            steps = np.gradient(texel[..., 0], axis=2), np.gradient(texel[..., 1], axis=1)
            tangents = along / steps[0][..., None], down / steps[1][..., None]
            attributes = np.concatenate([texel, opacity[..., None], carried, *tangents], axis=-1)
            texture = self.textures.motion(i, sheets)
            triangles = cull_dark(raster.mesh_triangles(position, attributes), texture[..., :1])
            fragments = raster.rasterise(triangles, window, tiles=camera.tiles)
            luminance, right, down = raster.sample_texture(texture, fragments.attributes).T
            _, _, opacity, *a = fragments.attributes.T
            moved = np.stack([a[k] + a[2 + k] * right + a[4 + k] * down for k in range(2)])
            weight = luminance * opacity
            total += raster.accumulate(
                fragments.pixel, np.stack([weight, *(moved * weight)]), window
            )
        weight = total[..., :1]
        velocity = np.zeros((camera.height, camera.width, 2), np.float32)
        moving = velocity[window.slices]
        np.divide(total[..., 1:], weight, out=moving, where=weight > _MAX_DARK)
        return velocity

    def fire_depth(self, i: int, camera: Camera, x: Values, y: Values, share: Values) -> Values:
        """Return the depth (n,), heights, of the sheets behind places x, y (n,) px in frame ``i``:
        ``share`` (n,) 0..1 of the light there comes from behind it.

        Where no sheet is, it is that of the nearest pixel with one; 0 if nothing burns.
        """
        width, height = camera.width, camera.height
        pixel, light, depth = (np.concatenate(batches) for batches in zip(*(
            self._light_in_depth(i, sheets, camera) for sheets in self._batches()
        ), strict=True))  # fmt: skip
        if not len(pixel):
            return np.zeros(len(x))
        x = np.mod(x, width) if camera.tiles else x
        column, row = (
            np.clip(place, 0, size - 1).astype(np.intp) for place, size in ((x, width), (y, height))
        )
        drawn, at = np.zeros(width * height, np.bool_), row * width + column
        drawn[pixel] = True
        if not drawn[at].all():
            known = np.flatnonzero(drawn)
            for k in np.flatnonzero(~drawn[at]):
                away = np.square(known // width - row[k]) + np.square(known % width - column[k])
                at[k] = known[np.argmin(away)]
        wanted, group = np.unique(at, return_inverse=True)
        asked = np.zeros_like(drawn)
        asked[wanted] = True
        here = np.flatnonzero(asked[pixel])
        here = here[np.lexsort((-depth[here], pixel[here]))]
        pixel, light, depth = pixel[here], light[here], depth[here]
        first = np.asarray(np.searchsorted(pixel, wanted))
        behind = np.append(0.0, np.cumsum(light, dtype=np.float64))
        begin, end = first[group], np.append(first, len(pixel))[group + 1]
        sought = behind[begin] + share * (behind[end] - behind[begin])
        found = np.searchsorted(behind, sought, side="right") - 1
        return np.asarray(depth[np.clip(found, begin, end - 1)], np.float64)

    def _light_in_depth(
        self, i: int, sheets: slice, camera: Camera
    ) -> tuple[NDArray[np.intp], NDArray[np.float32], NDArray[np.float32]]:
        """Return pixel, light and depth (n,), heights, of what shines of ``sheets`` in frame ``i``,
        also where something hides it."""
        texture = self.textures.light(i, sheets)
        projected, opacity = self.project_nodes(i, sheets, camera)
        opacity = opacity * self.density(i, sheets)
        texel = self.textures.texel_grid(sheets, *opacity.shape[1:3])
        attributes = np.concatenate([texel, opacity[..., None], projected[..., 2:]], axis=-1)
        triangles = raster.mesh_triangles(projected[..., :2], attributes)
        triangles = cull_dark(triangles, texture)
        whole = Window(0, 0, camera.width, camera.height)
        seen = raster.rasterise(triangles, whole, tiles=camera.tiles)
        light = brightest(raster.sample_texture(texture, seen.attributes)) * seen.attributes[:, 2]
        is_bright = light > _MAX_DARK
        return seen.pixel[is_bright], light[is_bright], seen.attributes[is_bright, 3]

    def project_nodes(
        self, i: int, sheets: slice, camera: Camera
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the nodes' positions (sheets, rows, columns, 3), px right, px down and depth in
        heights, and opacities (sheets, rows, columns), 0..1, of gas at rest; high gas is thin.

        Seen edge-on, a sheet would be a bright line. The flame it represents has depth, so the
        sheet fades and those that cross it are seen instead. So it does towards a fold, where its
        far side begins.
        """
        x = np.asarray(self.recording.x[i, sheets], np.float64)
        facing = np.abs(np.einsum("srcd,srcd->src", normals(x), camera.sight_lines(x)))
        # From above no upright sheet faces the camera, so divide by the best possible cosine.
        facing /= max(math.cos(camera.elevation), _MIN_COSINE)
        share = smooth_step((facing - _VANISHING_COSINE) / _FADE_RANGE)
        share *= smooth_step(_least_facing(x, camera) / _VANISHING_COSINE)
        projected = camera.project(x)
        before = smooth_step((camera.distance + projected[..., 2]) / _NEAR_FADE)
        up = np.linspace(0.0, 1.0, x.shape[1])[None, :, None]
        return projected, share * (1 - _THINNING * up) * before

    def density(self, i: int, sheets: slice) -> NDArray[np.float64]:
        """Return how dense the gas on ``sheets`` is in frame ``i``, (sheets, 1, 1), 0..1.

        Gas that moves faster (v_rms², as in eq. 17) is thinner: it is a part of what is there at
        rest, alike for all colours, as a thin flame is dim and not red.
        """
        thin = self.scene.of_fuels(lambda fuel: fuel.thin_speed)
        energy = ((self.recording.v_rms[i] / thin) ** 2)[sheets, None, None]
        return np.asarray(1 / (1 + np.minimum(energy * energy, _MAX_THINNING)))

    def _batches(self) -> list[slice]:
        sheets = self.scene.model.sheets
        return [slice(n, min(n + _BATCH, sheets)) for n in range(0, sheets, _BATCH)]

    def _flame(
        self,
        i: int,
        sheets: slice,
        camera: Camera,
        target: Window,
        intruders: IntruderBuffers,
    ) -> _FlameFragments:
        """Return what ``sheets`` add to the samples of a window of the picture."""
        texture = self.textures.light(i, sheets)
        projected, opacity = self.project_nodes(i, sheets, camera)
        texel = self.textures.texel_grid(sheets, *opacity.shape[1:3])
        density = self.density(i, sheets)[..., None]
        shown = opacity[..., None] ** self.textures.opacity_exponents(sheets) * density
        hiding = opacity[..., None] * density
        attributes = np.concatenate([texel, shown, hiding, projected[..., 2:]], axis=-1)
        triangles = raster.mesh_triangles(projected[..., :2] * self.samples, attributes)
        lit = cull_dark(triangles, texture)
        fragments = raster.rasterise(lit, target, tiles=camera.tiles)
        sampled = raster.sample_texture(texture, fragments.attributes)
        channels = np.ascontiguousarray(sampled.T)
        # A quarter or more is dark: between tongues, and around them.
        burns = np.flatnonzero(reduce(np.maximum, channels))
        _, row, *opacities, depth = (values[burns] for values in fragments.attributes.T)
        pixel = fragments.pixel[burns]
        found = np.stack([a[burns] * b for a, b in zip(channels, opacities, strict=True)])
        if not camera.tiles:
            scale = camera.scale * self.samples
            alive = edge_fade(camera.width * self.samples, _SIDE_FADE * scale) ** 2
            columns = alive[target.left : target.right]
            found *= np.tile(columns, target.bottom - target.top)[pixel]
        if not intruders.is_empty:
            found *= intruders.shows(target, pixel, depth)
        for picture in self._seen_pictures(camera):
            found *= picture.shows(target, pixel, depth)
        dimming = self.textures.dimming(sheets, row)
        return _FlameFragments(pixel, found[:3], found[3], dimming, depth)

    def _hearth(self, i: int) -> Hearth:
        """Return the place where the fire burns that does from the start, at frame ``i``."""
        burns = [lighter < 0 for lighter in self.scene.lit_by]
        foot = self.scene.model.rest[burns][:, 0].reshape(-1, 3)
        centre = foot.mean(axis=0)
        away = foot - centre
        radius = float(np.sqrt((away * away).sum(axis=-1).mean()))
        beats = max(1, round(_GLOW_BEATS * self.frames / self.scene.fps))
        burnt = tuple(float(seconds) for seconds in self.ignition.burnt[i])
        x, y, z = (float(place) for place in centre)
        return Hearth((x, y, z), radius, i / self.frames, beats, burnt)

    def _fires(self, i: int, camera: Camera) -> list[tuple[float, NDArray[np.float64]]]:
        """Return each fire's part of the light in frame ``i``, 0..1, by the area of its sheets, and
        the place (3,) that it comes from, in camera axes, heights."""
        x, rest = self.recording.x[i], self.scene.model.rest
        up, across = rest[:, -1, 0] - rest[:, 0, 0], rest[:, 0, -1] - rest[:, 0, 0]
        area = lengths(up) * lengths(across) * self.ignition.burning[i]
        area /= max(float(area.sum()), 1e-9)
        middle = x[:, : max(1, x.shape[1] // 2)].mean(axis=(1, 2), dtype=np.float64)
        fires = []
        for fire in dict.fromkeys(self.scene.fires):
            weight = area * np.equal(self.scene.fires, fire)
            share = float(weight.sum())
            fires.append((share, camera.view_of(weight @ middle / max(share, 1e-9))))
        return fires


def _least_facing(x: NDArray[np.float64], camera: Camera) -> NDArray[np.float64]:
    """Return for every node (sheets, rows, columns) the least cosine, 0..1, between the lines of
    sight and the normals of the cells around it.

    It is 0 where some of them show one side and some the other: there the sheet ends for the eye.
    """
    diagonal, other = x[:, 1:, 1:] - x[:, :-1, :-1], x[:, 1:, :-1] - x[:, :-1, 1:]
    normal = np.cross(diagonal, other)
    normal /= np.maximum(lengths(normal), 1e-12)[..., None]
    sight = camera.sight_lines((x[:, 1:, 1:] + x[:, :-1, :-1]) / 2)
    facing = np.pad(np.einsum("srcd,srcd->src", normal, sight), ((0, 0), (1, 1), (1, 1)), "edge")
    around = [facing[:, :-1, :-1], facing[:, :-1, 1:], facing[:, 1:, :-1], facing[:, 1:, 1:]]
    least, most = reduce(np.minimum, around), reduce(np.maximum, around)
    return np.asarray(np.maximum(np.maximum(least, -most), 0.0))


def _on_black(
    plane: NDArray[np.float32], window: Window, size: tuple[int, int]
) -> NDArray[np.float32]:
    """Return a picture of a ``size`` (width, height) that is 0 but in its window, where it is
    ``plane`` (h, w, ...)."""
    if plane.shape[:2] == size[::-1]:
        return plane
    whole = np.zeros((*size[::-1], *plane.shape[2:]), np.float32)
    whole[window.slices] = plane
    return whole


@dataclass(frozen=True, slots=True)
class SilkView:
    """A silk fire seen by one camera; implements ``generators.rendering.Rendering``.

    Attributes:
        renderer: The renderer of the fire.
        camera: The camera.
        luminance_matte: Converts light (height, width, 3) to pixels, with coverage by luminance.
    """

    matte: ClassVar[str] = "luminance"
    burning: ClassVar[None] = None
    matte_reason: ClassVar[str] = "brighter parts of a flame are more opaque"

    renderer: SilkRenderer
    camera: Camera
    luminance_matte: Callable[[NDArray[np.float32]], Pixels]

    def frame(self, index: int) -> Pixels:
        """Draw frame ``index``: (height, width, 4)."""
        frame = self.renderer.draw(index, self.camera)
        pixels = self.luminance_matte(frame.light)
        if not frame.coverage.any():
            return pixels
        # Intruders cover fully; ``light`` is their own plus that of the flames in front of them.
        opaque = np.dstack([frame.light, np.ones_like(frame.coverage)])
        return np.asarray(pixels + (opaque - pixels) * frame.coverage[..., None], np.float32)

    def motion(self, index: int) -> NDArray[np.float32]:
        """Return the velocity of the fire in frame ``index``: (height, width, 2) px/s."""
        return self.renderer.motion(index, self.camera)

    @property
    def front(self) -> Camera:
        """The camera in front of the fire, level, with parallel lines of sight."""
        return self.camera.from_the_front()

    def seen_by(self, camera: Camera) -> "SilkView":
        """Return the same fire seen by another camera, in less time: one sample of each pixel."""
        return replace(self, renderer=replace(self.renderer, samples=1), camera=camera)

    def fire_depth(self, index: int, x: Values, y: Values, share: Values) -> Values:
        """Return the depth at which fire burns behind places, px; see ``FireInDepth``."""
        return -self.camera.scale * self.renderer.fire_depth(index, self.camera, x, y, share)

    def hidden(self, index: int, x: Values, y: Values, z: Values) -> NDArray[np.bool_]:
        """Return which places are behind or inside an intruder; see ``FireInDepth``."""
        scene = self.renderer.scene
        x = np.mod(x, self.camera.width) if self.camera.tiles else x
        surface = surface_depth(scene.intruders, index / scene.fps, self.camera, x, y)
        return np.asarray(surface < z / -self.camera.scale)

    def front_surface(self, index: int) -> FrontSurface:
        """Return the front of the fire in frame ``index``."""
        return self.renderer.front_surface(index, self.camera)

    def smoke(self, index: int) -> Plane:
        """Return the share of light (height, width), 0..1, that the soot in the flame keeps back in
        a frame: no smoke rises over it."""
        return self.renderer.soot(index, self.camera)

    def solids(self, index: int) -> Pixels:
        """Return the light and coverage (height, width, 4) of what stands in the fire."""
        solid = self.renderer.solids(index, self.camera)
        return np.dstack([solid.light, solid.coverage])

    def solid_cover(self, index: int) -> Plane:
        """Return the coverage (height, width) of what stands in the fire."""
        return self.renderer.solid_cover(index, self.camera)


def generate_silk(
    source: SilkSource,
    settings: GenerationSettings,
    footage: Clip | None = None,
    masks: Masks = NO_MASKS,
) -> SilkRenderer:
    """Simulate the fire that a recipe describes; ``footage`` is a clip for its textures, if any,
    and ``masks`` are what its sheets burn on.

    Raises:
        RecipeError: It takes too many nodes, time steps or frames, or an intruder would jump.
        SourceError: The clip holds no fire, or too few frames.
    """
    scene = planned_scene(source, settings, masks)
    recording = simulate(scene, settings.frames, settings.loop)
    textures = make_textures(source, settings, footage, scene, recording)
    ignition = Ignition.of(scene, recording, textures)
    textures = replace(textures, burning=ignition.burning)
    foot = scene.model.rest[:, 0].mean(axis=1)[:, [0, 2]]
    pictures = tuple(
        CharredPicture(picture, picture.colours, foot[np.equal(scene.fires, fire)])
        for fire, picture in masks.items()
        if picture.colours is not None
    )
    return SilkRenderer(
        scene, recording, textures, ignition, settings.frames, source.glow, pictures
    )


def planned_scene(
    source: SilkSource, settings: GenerationSettings, masks: Masks = NO_MASKS
) -> SilkScene:
    """Return the scene that is simulated for a recipe whose sheets burn on ``masks``.

    Raises:
        RecipeError: It takes too many nodes, time steps or frames, or an intruder would jump.
    """
    scene = build_scene(source, settings.wind, settings.seed, settings.fps, masks)
    check_length(scene, settings.frames)
    if settings.loop:
        check_loop(scene, settings.frames / settings.fps)
    return scene


def changing_silk(
    before: SilkRenderer, after: SilkRenderer, share: NDArray[np.float64]
) -> SilkRenderer:
    """Return a fire that changes between its loops in two winds.

    In both winds the air flutters and sways in time. So at the same frame the sheets of both loops
    are alike, and each node goes straight from its place in one to that in the other, while the
    textures fade.

    Args:
        before, after: The loops, of one recipe.
        share: (frames,) weight of ``after`` in each frame, 0..1.
    """
    return SilkRenderer(
        before.scene,
        blended(before.recording, after.recording, share),
        FadingTextures.between(before.textures, after.textures, share),
        before.ignition.changing_to(after.ignition, share),
        before.frames,
        before.glow,
        before.pictures,
    )


def silk_camera(
    source: SilkSource, azimuth: float, elevation: float, distance: float | None = None
) -> Camera:
    """Return a camera whose unit of length is the recipe's frame height; angles in degrees.

    ``distance`` is in heights; None for parallel lines of sight.
    """
    return Camera(
        azimuth=math.radians(azimuth),
        elevation=math.radians(elevation),
        width=source.width,
        height=source.height,
        origin=(source.width / 2, source.height * (1 - source.foot)),
        scale=float(source.height),
        distance=math.inf if distance is None else distance,
        tiles=source.tile_width is not None,
    )

"""Draw a generated fire for one camera: blend scores, look up their shades, add the sway."""

import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from typing import ClassVar

import cv2
import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import NDArray
from scipy.special import ndtr

from fire_atlas.core.camera import Camera
from fire_atlas.core.clip import FrontSurface, Values
from fire_atlas.core.pixels import Pixels, Plane, as_plane
from fire_atlas.generators.profile.generate.axis import BentAxis, FramePlaces
from fire_atlas.generators.profile.generate.blend_masks import MASK_CELL, BlendMask, blend_masks
from fire_atlas.generators.profile.generate.colouring import TableColours
from fire_atlas.generators.profile.generate.generated_fire import (
    GeneratedFire,
    frames_of,
    scores_of_bytes,
)
from fire_atlas.generators.profile.generate.particle_cloud import (
    ParticleCloud,
    billboard_margin,
    fitted_taper,
)
from fire_atlas.generators.profile.generate.round_form import Column, column_front
from fire_atlas.generators.profile.generate.shading import ShadeTable, shade_table, taper_of
from fire_atlas.generators.profile.generate.skeleton import Displacement, skeletons
from fire_atlas.generators.profile.generate.wind_response import LEAN_PER_LEVEL
from fire_atlas.generators.profile.model import FLOW_CELL, Profile, interpolated
from fire_atlas.vision.warp import sample_at

_MAX_ELEVATION = 80.0
"""Maximum elevation, degrees; from above that only the foot of a flame is seen."""

_MARGIN = 2
"""Empty px left around the fire's extent in all frames."""


@dataclass(frozen=True, slots=True)
class FramePose:
    """Pose of the fire in one frame, seen by one camera.

    Attributes:
        offset: (NODES,) distance of its middle to the right of the axis, flame heights.
        width_ratio: (NODES,) width divided by its mean.
        axis: Its axis, bent by the wind.
        moved: How its points were moved from where the clip has them; None if they were not.
    """

    offset: NDArray[np.float64]
    width_ratio: NDArray[np.float64]
    axis: BentAxis
    moved: Displacement | None


@dataclass(frozen=True, slots=True)
class ProfileRendering:
    """A fire generated from a profile, seen by one camera.

    Attributes:
        fire: The fire.
        camera: The camera; its unit of length is the flame height.
        half_width: Half width of the foot seen by the camera, flame heights.
        taper: Half width of the flame by height, in half widths of its foot.
        shades: Colours of every cell, seen by the camera.
        cloud: Its particles alone.
    """

    matte: ClassVar[str] = "alpha"
    burning: ClassVar[None] = None
    matte_reason: ClassVar[str] = "generated fire comes with its own coverage"

    fire: GeneratedFire
    camera: Camera
    half_width: float
    taper: Polynomial
    shades: ShadeTable
    cloud: ParticleCloud

    @classmethod
    def of(cls, fire: GeneratedFire, camera: Camera) -> "ProfileRendering":
        """Set up the drawing of ``fire`` as seen by ``camera``."""
        half = fire.base_curve.half_width(camera.azimuth) * fire.profile.front.half_width
        shades = shade_table(fire.profile, camera.azimuth)
        colours = TableColours.of(fire.profile, camera.azimuth)
        cloud = ParticleCloud(fire, camera, colours, fitted_taper(fire.profile))
        return cls(fire, camera, half, taper_of(fire.profile), shades, cloud)

    def frame(self, index: int) -> Pixels:
        """Draw frame ``index``: (height, width, 4), a fresh array."""
        share = np.float32(self.fire.detail)
        if share == 1:
            return self._detailed(index)
        time = float(self.fire.frame_times[index])
        skeleton = skeletons(self.fire.planes, time, self.camera.azimuth).moved
        particles = self.cloud.picture(skeleton, self.pose(index).axis, time)
        if share == 0:
            return particles
        return as_plane(self._detailed(index) * share + particles * (1 - share))

    def _detailed(self, index: int) -> Pixels:
        """Draw the clip's detail in frame ``index``."""
        pose = self.pose(index)
        camera, profile = self.camera, self.fire.profile
        # A fire shown smaller than it was filmed is drawn larger first and then reduced. The size
        # filmed may be less than the grid's, which is finer than a small sprite.
        filmed = min(profile.grid.cells_per_height, profile.front.statistics.height.median)
        oversampling = max(1, math.ceil(0.8 * filmed / camera.scale))
        columns, rows = self._grid_places(pose, oversampling)
        straight = self._straight_picture(self._masks(index), self._flicker(index))
        seen = sample_at(straight, columns, rows, cv2.INTER_CUBIC, cv2.BORDER_CONSTANT)
        if oversampling > 1:
            size = camera.width, camera.height
            seen = as_plane(cv2.resize(seen, size, interpolation=cv2.INTER_AREA))
        # Cubic interpolation overshoots at edges.
        np.clip(seen, 0, 1, out=seen)
        for channel in range(3):  # numpy is slow along a short axis
            np.minimum(seen[..., channel], seen[..., 3], out=seen[..., channel])
        self.cloud.colours.apply(seen)
        return seen

    def showing(self, fire: GeneratedFire) -> "ProfileRendering":
        """Return the rendering of another fire of the same profile by the same camera."""
        return replace(self, fire=fire, cloud=replace(self.cloud, fire=fire))

    def motion(self, index: int) -> NDArray[np.float32]:
        """Velocity of the fire in frame ``index``: (height, width, 2) px/s, x right, y down. It is
        the sum of the clip's own motion, carried by the particles, and of the sway and the lean."""
        grid, settings, pose = self.fire.profile.grid, self.fire.settings, self.pose(index)
        places, at = self._places(pose, 1), pose.axis.at
        heights, across = places.heights, places.across
        columns, rows = self._on_grid(pose, places)
        moves = self._grid_flow(self._masks(index)) * np.float32(self.fire.time_rate(index))
        seen = sample_at(moves, (columns + 0.5) / FLOW_CELL - 0.5, (rows + 0.5) / FLOW_CELL - 0.5)
        aside = seen[..., 0] * (self.half_width / grid.cells_per_half)
        rise = seen[..., 1] / -grid.cells_per_height
        # Gas that rises along a middle that is not straight also moves sideways.
        _, half, middle = self._outline(pose)
        aside = aside + rise * at(np.gradient(middle, pose.axis.heights), heights)
        turn, (to_right, to_up) = at(pose.axis.turn, heights), pose.axis.tangent
        right = aside * np.cos(turn) + rise * at(to_right, heights)
        up = rise * at(to_up, heights) - aside * np.sin(turn)
        following = index + 1 if settings.loop or index + 1 < settings.frames else index - 1
        if settings.frames > 1:
            later = self.pose(following % settings.frames)
            _, half_later, middle_later = self._outline(later)
            wider = at(half_later / half, heights)
            shift = at(middle_later, heights) + (across - at(middle, heights)) * wider
            before, after = pose.axis.placed(heights, across), later.axis.placed(heights, shift)
            sign = settings.fps if following > index else -settings.fps
            right, up = right + (after[0] - before[0]) * sign, up + (after[1] - before[1]) * sign
        flow = np.stack([places.full(right), places.full(-up)], axis=-1)
        return as_plane(flow * np.float32(self.camera.scale))

    @property
    def front(self) -> Camera:
        """The camera in front of the fire, level, in px of the same size; it sees all of it."""
        if self.camera.elevation == 0:
            return self.camera.from_the_front()
        return _front_camera(self.fire, 0.0, scale=self.camera.scale)

    def seen_by(self, camera: Camera) -> "ProfileRendering":
        """Return the same fire seen by another camera."""
        return ProfileRendering.of(self.fire, camera)

    def fire_depth(self, index: int, x: Values, y: Values, share: Values) -> Values:
        """Return the depth at which fire burns behind places in a level view, px: evenly in a round
        column, of which the view at a right angle shows middle and width; see ``FireInDepth``."""
        camera = self.camera
        side = self._from_the_right()
        pose, behind = self.pose(index), side.pose(index)
        right, up = (x - camera.origin[0]) / camera.scale, (camera.origin[1] - y) / camera.scale
        shown, across = pose.axis.straightened(right, up)
        at = pose.axis.at
        _, half, middle = self._outline(pose)
        across = (across - at(middle, shown)) / at(half, shown)
        heights, deep, _ = side._outline(behind)
        taper = at(np.asarray(self.taper(np.clip(heights, 0, 1)), np.float64), shown)
        # What seems to burn beside the column burns at its edge.
        depth = at(deep, shown) * np.sqrt(np.clip(taper * taper - across * across, 0, None))
        return np.asarray(((2 * share - 1) * depth - at(pose.axis.away, shown)) * camera.scale)

    def hidden(self, index: int, x: Values, y: Values, z: Values) -> NDArray[np.bool_]:
        """Return which places are behind something opaque: none."""
        return np.zeros(len(x), np.bool_)

    def front_surface(self, index: int) -> FrontSurface:
        """Return the front of the fire in frame ``index``: the column of ``fire_depth``."""
        camera = self.camera
        side = self._from_the_right()
        pose, behind = self.pose(index), side.pose(index)
        heights, half, middle = self._outline(pose)
        _, deep, _ = side._outline(behind)
        taper = np.asarray(self.taper(np.clip(heights, 0, 1)), np.float64)
        column = Column(half, middle, deep, np.maximum(taper, 0))
        return column_front(column, pose.axis, self._places(pose, 1), camera)

    def _from_the_right(self) -> "ProfileRendering":
        """Return the same fire at a right angle, of which only poses and outlines are asked."""
        camera = replace(self.camera, azimuth=self.camera.azimuth + math.pi / 2)
        half = self.fire.base_curve.half_width(camera.azimuth)
        return replace(self, camera=camera, half_width=half * self.fire.profile.front.half_width)

    def smoke(self, index: int) -> Plane:
        """Return the share of light (height, width) that smoke keeps back: none."""
        return np.zeros((self.camera.height, self.camera.width), np.float32)

    def pose(self, index: int) -> FramePose:
        """Return the pose of the fire in frame ``index``."""
        planes, time = self.fire.planes, float(self.fire.frame_times[index])
        (right, middle, width), (away_sway, behind, depth) = (plane.sway(time) for plane in planes)
        cos, sin = math.cos(self.camera.azimuth), math.sin(self.camera.azimuth)
        # Means seen from in between are averaged, sways add up.
        mean = middle * cos * abs(cos) + behind * sin * abs(sin)
        ratio = np.exp(width * cos * cos + depth * sin * sin)
        bend, away = (math.radians(plane.playback.bend_at(time)) for plane in planes)
        # To the right of this camera, and away from it.
        lean = bend * cos + away * sin, away * cos - bend * sin
        moved = None
        if any(side.points != side.learnt_points for side in self.fire.profile.sides):
            seen = skeletons(planes, time, self.camera.azimuth)
            moved = None if (seen.moved.points == seen.learnt.points).all() else seen
        aside = behind * cos * abs(cos) - middle * sin * abs(sin) + away_sway * cos - right * sin
        axis = BentAxis.of(
            lean, self.camera.elevation, _span(self.fire.profile), self._widest,
            lambda heights: interpolated(aside, heights),
        )  # fmt: skip
        return FramePose(mean + right * cos + away_sway * sin, ratio, axis, moved)

    @property
    def _widest(self) -> float:
        """Half the width within which the fire burns, flame heights."""
        grid = self.fire.profile.grid
        return grid.half_columns / grid.cells_per_half * self.half_width

    def _masks(self, index: int) -> list[BlendMask]:
        time = float(self.fire.frame_times[index])
        return blend_masks(self.fire, self.camera.azimuth, self.half_width, self.taper, time)

    def _straight_picture(self, masks: Sequence[BlendMask], flicker: float) -> Pixels:
        """Return the fire on the grid, without its sway and lean.

        What the moments that are blended have of their own is mixed; what all cells of a moment
        share, the flicker of the whole flame, is that of the leading one. Moments that lag by half
        a period would else comb it out.
        """
        shape = self.fire.profile.grid.shape
        weights = [_enlarged(mask.weight, shape) for mask in masks]
        mixed, power = np.zeros(shape, np.float32), np.full(shape, 1e-30, np.float32)
        for mask, weight in zip(masks, weights, strict=True):
            mixed += weight * self._scores(mask)
            power += weight * weight
        # The variance of a blend grows with the correlation of its frames.
        for (one, weight), (other, more) in itertools.combinations(
            zip(masks, weights, strict=True), 2
        ):
            if one.plane == other.plane and one.mirrored == other.mirrored:
                power += 2 * weight * more * self._correlation(one.plane, one.frame, other.frame)
        return self.shades.colours(as_plane(ndtr(mixed / np.sqrt(power) + flicker)))

    def _correlation(self, plane: int, one: int, other: int) -> Plane:
        """Return the correlation (rows, columns) of the scores of two frames of the clip."""
        sequence = self.fire.planes[plane].playback.sequence
        apart = abs(one - other)
        if sequence.closed:
            apart = min(apart, sequence.count - apart)
        maps = self.fire.autocorrelations[plane]
        return reduce(np.multiply, (maps[k] for k in range(len(maps)) if apart >> k & 1))

    def _scores(self, mask: BlendMask) -> Plane:
        """Return the normal scores (rows, columns) of the frame of a mask, without what all of them
        share."""
        scores = self.fire.planes[mask.plane].side.detail.scores[mask.frame]
        table = scores_of_bytes() - self.fire.flickers[mask.plane][mask.frame]
        own = as_plane(cv2.LUT(scores, table))
        return own[:, ::-1] if mask.mirrored else own

    def _flicker(self, index: int) -> float:
        """Return the score that all cells share in frame ``index``: that of the front's moment."""
        moments = self.fire.planes[0].playback.moments(float(self.fire.frame_times[index]))
        flicker = self.fire.flickers[0]
        return sum(
            float(flicker[frame]) * share
            for moment in moments
            for frame, share in frames_of(moment)
        )

    def _grid_flow(self, masks: Iterable[BlendMask]) -> NDArray[np.float32]:
        """Return the fire's velocity on the grid: (r, c, 2) cells per second, x right, y down."""
        rows, columns = self.fire.profile.front.detail.flow.shape[1:3]
        mixed = np.zeros((rows, columns, 2), np.float32)
        total = np.full((rows, columns, 1), 1e-30, np.float32)
        for mask in masks:
            weight = cv2.resize(mask.weight, (columns, rows), interpolation=cv2.INTER_LINEAR)
            plane = self.fire.planes[mask.plane]
            flow = plane.side.detail.flow[mask.frame] * np.float32(
                plane.playback.sequence.rate * self.fire.settings.fps / plane.side.fps
            )
            if mask.mirrored:
                flow = flow[:, ::-1] * np.array([-1, 1], np.float32)
            mixed += weight[..., None] * flow
            total += weight[..., None]
        return as_plane(mixed / total)

    def _grid_places(
        self, pose: FramePose, oversampling: int
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return the grid's column and row at each pixel: two arrays of the size of the frame times
        ``oversampling``."""
        places = self._places(pose, oversampling)
        columns, rows = (places.full(coordinate) for coordinate in self._on_grid(pose, places))
        return columns, rows

    def _on_grid(self, pose: FramePose, places: FramePlaces) -> tuple[Plane, Plane]:
        """Return the grid's column and row at each of the places."""
        grid, camera, at = self.fire.profile.grid, self.camera, pose.axis.at
        shown, aside = places.heights, places.across
        heights, half, middle = self._outline(pose)
        across = (aside - at(middle, shown)) / at(half, shown)
        height = pose.axis.continued(heights, shown)
        if pose.moved is not None:
            height = height - pose.moved.raised(aside, shown)
        if camera.elevation:
            # From above, the near side of a round foot is lower in the frame than its axis.
            foot = np.sqrt(np.clip(1 - across * across, 0, 1)) * np.clip(1 - height, 0, 1)
            drop = foot * self.half_width * math.sin(camera.elevation)
            height = height + drop / at(pose.axis.tangent[1], shown)
        columns = grid.half_columns + across * grid.cells_per_half - 0.5
        rows = grid.rows_above - height * grid.cells_per_height - 0.5
        columns, rows = np.broadcast_arrays(columns, rows)
        return as_plane(columns), as_plane(rows)

    def _places(self, pose: FramePose, oversampling: int) -> FramePlaces:
        """Return where in the fire the pixels of the frame times ``oversampling`` lie."""
        camera = self.camera
        (x, y), scale = camera.origin, camera.scale
        right = ((np.arange(camera.width * oversampling) + 0.5) / oversampling - x) / scale
        up = (y - (np.arange(camera.height * oversampling) + 0.5) / oversampling) / scale
        return pose.axis.frame_places(right, up)

    def _outline(self, pose: FramePose) -> tuple[Values, Values, Values]:
        """Return heights in the clip, half the foot's width and the distance of the fire's middle
        from its axis, flame heights, at the nodes (n,) of the fire's axis."""
        shown = pose.axis.heights
        heights = shown if pose.moved is None else pose.moved.heights(shown)
        half = interpolated(pose.width_ratio, heights) * self.half_width
        middle = interpolated(pose.offset, heights)
        if pose.moved is not None:
            half, middle = half * pose.moved.width(shown), middle + pose.moved.middle(shown)
        return heights, half, middle


def renderings(
    fire: GeneratedFire,
    azimuths: Iterable[float],
    elevation: float,
    height: int | None,
    longer_side: int | None = None,
) -> list[ProfileRendering]:
    """Return ``fire`` seen from each azimuth, all with the same frame size and scale.

    Args:
        fire: The fire.
        azimuths: Directions of the cameras, degrees, counter-clockwise seen from above.
        elevation: Angle of the cameras above the horizon, degrees.
        height: Height of the frame, px; None keeps the scale of the clip.
        longer_side: The longer side of the frame, px, in place of ``height``.
    """
    camera = _front_camera(fire, elevation, height, longer_side)
    cameras = [replace(camera, azimuth=math.radians(azimuth)) for azimuth in azimuths]
    return [ProfileRendering.of(fire, camera) for camera in cameras]


def renderings_in_wind(
    fires: Sequence[GeneratedFire],
    elevation: float,
    height: int | None,
    longer_side: int | None = None,
) -> list[ProfileRendering]:
    """Return the same fire in several winds, seen from the front in frames of one size; arguments
    as for ``renderings``."""
    widest = max(fires, key=lambda fire: _front_camera(fire, elevation, height).width)
    camera = _front_camera(widest, elevation, height, longer_side)
    return [ProfileRendering.of(fire, camera) for fire in fires]


def _front_camera(
    fire: GeneratedFire,
    elevation: float,
    height: int | None = None,
    longer_side: int | None = None,
    scale: float | None = None,
) -> Camera:
    """Return a front camera whose frame holds the whole fire, also when seen from other sides and
    in the strongest wind. Without ``height`` and ``longer_side``, px, its ``scale`` is px per flame
    height."""
    profile, grid = fire.profile, fire.profile.grid
    tilt = math.radians(min(max(elevation, -_MAX_ELEVATION), _MAX_ELEVATION))
    half = max(side.half_width for side in profile.sides)
    sway = max(float(np.abs(side.pose.offset).max()) for side in profile.sides)
    sway *= max(float(plane.sway_gain.max()) for plane in fire.planes)
    widest = max(float(side.pose.width_ratio.max()) for side in profile.sides)
    lean, span = math.radians(_largest_lean(fire)), _span(profile)
    depth = half * abs(math.sin(tilt))
    aside = above = below = 0.0
    # Seen from all sides, the fire leans to the right, away and towards the camera, or less.
    for angle in (0.0, lean / 2, lean):
        for seen in ((angle, 0.0), (0.0, angle), (0.0, -angle)):
            axis = BentAxis.of(seen, tilt, span, half * grid.half_columns / grid.cells_per_half)
            extent = _burning_half_width(profile, axis.heights) * widest + sway
            burns = extent > sway
            tall = extent * np.abs(np.sin(axis.turn)) + sway * abs(math.sin(tilt))
            aside = max(aside, float((axis.right + extent)[burns].max()))
            above = max(above, float((axis.up + tall)[burns].max()) + depth)
            below = max(below, float((tall - axis.up)[burns].max()) + depth)
    if fire.detail < 1:
        above += billboard_margin(half)
        below += billboard_margin(half)
    left_right, up, down = _displacements(profile)
    aside, above, below = aside + left_right, above + up, below + down
    width = None
    if longer_side is not None:
        across = (longer_side / 2 - _MARGIN) / aside
        if across * (above + below) < longer_side - 2 * _MARGIN - 1:
            width, scale = longer_side, across
        else:
            height = longer_side
    if height is not None:
        scale = max(height - 2 * _MARGIN - 1, 1) / (above + below)
    scale = scale or profile.front.statistics.height.median
    # The base is on a pixel boundary, as in most sprites, so their pixels are not resampled.
    ground = math.ceil(below * scale) + _MARGIN
    rows = height or math.ceil(above * scale) + _MARGIN + ground
    columns = width or 2 * (math.ceil(aside * scale) + _MARGIN)
    return Camera(0.0, tilt, columns, rows, (columns / 2, float(rows - ground)), scale)


def _displacements(profile: Profile) -> tuple[float, float, float]:
    """Return how far points were moved at most: to a side, up and down, flame heights."""
    moved = np.concatenate([
        (np.array(side.points) - np.array(side.learnt_points)).reshape(-1, 2)
        / side.statistics.height.median
        for side in profile.sides
    ])  # fmt: skip
    x, y = moved.T
    return float(np.abs(x).max()), max(float(-y.min()), 0.0), max(float(y.max()), 0.0)


def _burning_half_width(profile: Profile, heights: Values) -> Values:
    """Return half the width, flame heights, within which the fire ever burns at ``heights`` (n,)
    along its axis; 0 where it never does."""
    grid, widest = profile.grid, np.zeros_like(heights)
    for side in profile.sides:
        burns = side.detail.shades[..., 3].max(axis=0) > 0
        wide = np.where(burns, np.abs(grid.offsets) + 1 / grid.cells_per_half, 0).max(axis=1)
        near = np.maximum(wide, np.maximum(np.roll(wide, 1), np.roll(wide, -1)))
        found = np.interp(heights, grid.heights[::-1], near[::-1]) * side.half_width
        widest = np.maximum(widest, found)
    return widest


def _span(profile: Profile) -> tuple[float, float]:
    """Return the heights between which the fire's detail is stored."""
    grid = profile.grid
    return -grid.rows_below / grid.cells_per_height, grid.rows_above / grid.cells_per_height


def _largest_lean(fire: GeneratedFire) -> float:
    """Return how far a fire may lean beyond the sway of its clip, degrees. In wind that depends on
    the wind alone: other frames in a leaning set give frames of the same size."""
    peak = fire.settings.wind.peak
    if peak == 0:
        return max(float(np.abs(plane.playback.bend).max()) for plane in fire.planes)
    medians = [abs(side.statistics.lean.median) for side in fire.profile.sides]
    return LEAN_PER_LEVEL * peak + max(medians)


def _enlarged(weight: Plane, shape: tuple[int, int]) -> Plane:
    """Enlarge the weights of a mask to a grid of ``shape``."""
    rows, columns = weight.shape
    size = columns * MASK_CELL, rows * MASK_CELL
    full = cv2.resize(weight, size, interpolation=cv2.INTER_LINEAR)
    return as_plane(full[: shape[0], : shape[1]])

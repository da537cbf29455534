"""Motion vectors of the flame, by which shaders warp each frame into the next."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, cast, get_args

from fire_atlas.atlas.drawing import Edges
from fire_atlas.atlas.sheet import AtlasSheet, SheetMap, VectorScale
from fire_atlas.core.checks import whole
from fire_atlas.core.context import BuildContext
from fire_atlas.core.errors import SourceError
from fire_atlas.core.picture import as_light
from fire_atlas.core.pixels import Bytes
from fire_atlas.core.workers import Workers
from fire_atlas.maps.kinds import MapKind
from fire_atlas.maps.maker import AnimationParts, FrameParts, Maker, MappedAnimation, files_of
from fire_atlas.maps.vectors.cross_validation import motion_statistics
from fire_atlas.maps.vectors.encoding import motion_encoding
from fire_atlas.maps.vectors.estimate import FrameVectors, Motion, estimate_motion
from fire_atlas.maps.vectors.flow import displayed_thumbnail
from fire_atlas.maps.vectors.held_out import choose_held_out
from fire_atlas.maps.vectors.page import (
    draw_vector_page,
    pair,
    pair_of,
    scale_entry,
    strength,
    vector_scale,
)
from fire_atlas.recipe.models import Recipe
from fire_atlas.recipe.output import Engine, Maps
from fire_atlas.vision.warp import between_copies

_REACH = 0.2
"""Distance beyond the sides of a tile that has a part in its vectors, of the longer side: frames
are compared, and errors averaged, over about so much."""


class _Motion(Maker):
    def of_frame(self, kind: MapKind, parts: FrameParts, recipe: Recipe) -> Bytes:
        return displayed_thumbnail(as_light(parts.moving), recipe.atlas.blend_space)

    def of_animation(self, parts: AnimationParts, recipe: Recipe, context: BuildContext) -> Motion:
        """Return the motion of an animation.

        Raises:
            SourceError: The frames differ in size, so that their pixels do not correspond.
        """
        engine = recipe.maps.motion
        assert engine != "none", "only recipes that ask for it have it"
        sizes = set(parts.sizes)
        if len(sizes) > 1:
            raise SourceError(
                "the images of an animation differ in size, but motion vectors need equal sizes; "
                "make them one size, or leave it out",
                key=("maps", "motion"),
            )
        skipped = _thumbnails(parts, recipe, context.workers)
        pictures, margin = cast("Sequence[Bytes]", parts.frames), 0
        if parts.clip is not None and parts.clip.tiles:
            margin = math.ceil(_REACH * max(pictures[0].shape))
            pictures = [between_copies(picture, margin) for picture in pictures]
        with context.timer.measure("motion"):
            context.progress.stage("motion", len(parts.frames))
            return estimate_motion(
                pictures,
                skipped,
                sizes.pop(),
                parts.loop,
                motion_encoding(engine),
                context.workers,
                context.progress.advance,
                margin,
            )

    def statistics(self, found: Motion) -> dict[str, Any]:
        return motion_statistics(found.validation)

    def margin(self, found: Sequence[Motion]) -> int:
        """Return how far vectors move samples."""
        return math.ceil(max((max(motion.longest) for motion in found), default=0))

    def described(
        self, kind: MapKind, sheet: AtlasSheet, animations: Sequence[MappedAnimation], maps: Maps
    ) -> SheetMap:
        assert maps.motion != "none", "only recipes that ask for it have it"
        lengths = [animation.maps[kind.name].longest for animation in animations]
        scale = vector_scale(sheet, lengths, motion_encoding(maps.motion))
        return replace(files_of(kind, sheet), vectors=scale)

    def content(
        self, kind: MapKind, animations: Sequence[MappedAnimation], scale: int
    ) -> list[FrameVectors]:
        return [frame for animation in animations for frame in animation.maps[kind.name].frames()]

    def draw(
        self,
        kind: MapKind,
        sheet: AtlasSheet,
        page: int,
        content: Sequence[FrameVectors],
        edges: Edges,
        workers: Workers,
    ) -> Bytes:
        return draw_vector_page(sheet, page, kind.name, content, edges)

    def entry(self, stated: SheetMap, sheet: AtlasSheet) -> dict[str, Any]:
        assert stated.vectors is not None
        motion, encoding = stated.vectors, motion_encoding(stated.vectors.engine)
        return {
            "engine": encoding.engine,
            **scale_entry(motion),
            "this": encoding.this,
            "next": encoding.following,
            "strength": strengths(motion, sheet.fps),
            "reach": pair(motion.longest, 3),
            "gutter": motion.gutter and list(motion.gutter),
        }

    def read(self, stated: SheetMap, entry: Mapping[str, Any]) -> SheetMap:
        """Read the scale of motion vectors; the engine's name determines the rest."""
        engine, strong, gutter = entry["engine"], entry["strength"], entry["gutter"]
        if engine not in get_args(Engine):
            raise ValueError(f"{engine!r} is not an engine whose motion vectors are known")
        scale = VectorScale(
            engine=engine,
            scale=strength(entry["scale"]),
            pixels=pair_of(strong["pixels"]),
            cell_uv=None if strong["cellUv"] is None else pair_of(strong["cellUv"]),
            longest=pair_of(entry["reach"]),
            gutter=None if gutter is None else (whole(gutter[0]), whole(gutter[1])),
        )
        return replace(stated, vectors=scale)


MAKER = _Motion()


def strengths(motion: VectorScale, fps: float) -> dict[str, Any]:
    """Return the motion (x, y) that a decoded value of 1 means, in each unit that clients use.

    Values in UV of a cell are None if the page has no grid.
    """
    cell = motion.cell_uv
    return {
        "cellUv": cell and pair(cell, 9),
        "pixels": pair(motion.pixels, 6),
        "cellUvPerSecond": cell and pair((cell[0] * fps, cell[1] * fps), 9),
    }


def _thumbnails(
    parts: AnimationParts, recipe: Recipe, workers: Workers
) -> dict[int, tuple[float, Bytes]]:
    """Return thumbnails of source frames that the clip skips, on which vectors are tested.

    The key is the index of the frame before it; the value has its time, as a fraction of the step
    to the next frame, and the thumbnail of its flame. Empty if the clip has all frames.
    """

    def thumbnail(i: int) -> tuple[float, Bytes]:
        time, flame = parts.skipped[i]
        return time, displayed_thumbnail(as_light(flame()), recipe.atlas.blend_space)

    chosen = choose_held_out(sorted(parts.skipped))
    return dict(zip(chosen, workers.map(thumbnail, chosen), strict=True))

"""Measure how many pixels a renderer draws of an atlas, beside those that show something."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

from fire_atlas.atlas.sheet import Region
from fire_atlas.atlas.trim import visible_pixels
from fire_atlas.core.pixels import Bytes
from fire_atlas.formats.atlas.texture_packer import AtlasFile
from fire_atlas.preview.cut_frames import cut_frames


@dataclass(frozen=True, slots=True)
class Overdraw:
    """What is drawn of some frames, each once.

    Attributes:
        drawn: Area of their meshes; of frames without one, of their rectangles, px².
        rectangles: Area of the rectangles of all of them, px².
        visible: Number of pixels that show something.
        meshes: Number of frames of which a mesh draws less than the rectangle.
        vertices: Largest number of vertices of these.
        opaque, empty: Numbers of frames that show something in every pixel, or in none.
        full: Number of others that are drawn as rectangles.
    """

    drawn: float
    rectangles: int
    visible: int
    meshes: int
    vertices: int
    opaque: int
    empty: int
    full: int

    @classmethod
    def of(cls, region: Region, frame: Bytes) -> Self:
        """Return what is drawn of a frame (H, W, 4), which is not trimmed."""
        area, visible = region.width * region.height, int(visible_pixels(frame, 0).sum())
        saves = not region.fills_rectangle
        return cls(
            drawn=region.drawn_area,
            rectangles=area,
            visible=visible,
            meshes=int(saves),
            vertices=len(region.mesh.vertices) if region.mesh and saves else 0,
            opaque=int(visible == area),
            empty=int(visible == 0),
            full=int(not saves and 0 < visible < area),
        )

    @classmethod
    def together(cls, parts: Sequence[Self]) -> Self:
        """Return what is drawn of all of several."""
        return cls(
            drawn=sum(part.drawn for part in parts),
            rectangles=sum(part.rectangles for part in parts),
            visible=sum(part.visible for part in parts),
            meshes=sum(part.meshes for part in parts),
            vertices=max(part.vertices for part in parts),
            opaque=sum(part.opaque for part in parts),
            empty=sum(part.empty for part in parts),
            full=sum(part.full for part in parts),
        )


def overdraw_of(atlas: AtlasFile) -> dict[str, Overdraw]:
    """Return what is drawn of each animation, by its name."""
    frames = zip(atlas.frames, cut_frames(atlas), strict=True)
    measured = {region.name: Overdraw.of(region, frame) for region, frame in frames}
    return {
        animation.name: Overdraw.together([measured[name] for name in animation.frames])
        for animation in atlas.sheet.animations
    }

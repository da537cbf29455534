"""A sheet as Godot's SpriteFrames: textures with margins, and animations that show them.

A Godot sprite has one offset for all its frames, but frames may differ in size and pivot. So all
frames are aligned at their pivots in one box of whole px that holds every untrimmed frame. A
texture's margin extends it to that box, and the sprite's offset places the box so that the pivots
are at the node's position. Where all frames are alike, the box is the untrimmed frame.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, Self

from fire_atlas.atlas.sheet import AtlasSheet, Mesh, Region
from fire_atlas.engines.godot.names import titles

_DECIMALS = 6
"""Decimals of px and durations: what differs less is rounding error."""


class Margin(NamedTuple):
    """Godot's margin of a texture, px: left of and above it, and the sums of both sides."""

    left: float
    top: float
    width: float
    height: float


@dataclass(frozen=True, slots=True)
class FrameBounds:
    """The box that holds all frames, aligned at their pivots.

    Attributes:
        x, y: Its top-left corner relative to the pivots, px, y down: the sprite's offset.
        width, height: Its size, px.
    """

    x: float
    y: float
    width: int
    height: int

    @classmethod
    def of(cls, regions: Iterable[Region]) -> Self:
        """Return the smallest box for ``regions``."""
        frames = [(*pivot(region), region.frame_width, region.frame_height) for region in regions]
        left, top = max(x for x, *_ in frames), max(y for _, y, *_ in frames)
        right = max(width - x for x, _, width, _ in frames)
        bottom = max(height - y for _, y, _, height in frames)
        return cls(-left, -top, _rounded_up(left + right), _rounded_up(top + bottom))

    def enlarged(self, flakes: tuple[int, int, int, int], scale: float) -> Self:
        """Return the box enlarged by whole px so that flakes fit in.

        Args:
            flakes: Their bounds x, y, width, height, px of the full size.
            scale: Scale of this box.
        """
        left, top, width, height = (length * scale for length in flakes)
        x = self.x - max(math.ceil(self.x - left), 0)
        y = self.y - max(math.ceil(self.y - top), 0)
        right, bottom = (
            max(self.x + self.width, left + width), max(self.y + self.height, top + height)
        )  # fmt: skip
        return replace(self, x=x, y=y, width=_rounded_up(right - x), height=_rounded_up(bottom - y))

    def margin(self, region: Region) -> Margin:
        """Return the margin that extends a frame's texture to the box."""
        x, y = pivot(region)
        return Margin(
            region.trim_x - x - self.x,
            region.trim_y - y - self.y,
            self.width - region.width,
            self.height - region.height,
        )


@dataclass(frozen=True, slots=True)
class AtlasTexture:
    """A rectangle of a page with a margin around it; px, y down.

    ``mesh`` is what of it is drawn, None if all.
    """

    page: int
    x: int
    y: int
    width: int
    height: int
    margin: Margin
    mesh: Mesh | None = None


@dataclass(frozen=True, slots=True)
class SpriteFrame:
    """A frame of an animation: index of its texture, and its duration by that of the shortest."""

    texture: int
    duration: float


@dataclass(frozen=True, slots=True)
class SpriteAnimation:
    """An animation of Godot's: its title, its speed (as of ``FrameTiming``) and its frames."""

    title: str
    loop: bool
    speed: float
    frames: tuple[SpriteFrame, ...]


class FrameTiming(NamedTuple):
    """Speed of an animation, frames/s if all were as short as the shortest one, and the duration of
    each frame by that of the shortest."""

    speed: float
    durations: tuple[float, ...]


def textures_of(
    sheet: AtlasSheet, *, draws_meshes: bool
) -> tuple[list[AtlasTexture], dict[str, int]]:
    """Return all textures, each once, and the index of the texture of each frame by its name."""
    bounds = FrameBounds.of(sheet.regions)
    indices: dict[AtlasTexture, int] = {}
    index_of_frame = {}
    for region in sheet.regions:
        texture = AtlasTexture(
            region.page, region.x, region.y, region.width, region.height, bounds.margin(region),
            region.mesh if draws_meshes and not region.fills_rectangle else None,
        )  # fmt: skip
        index_of_frame[region.name] = indices.setdefault(texture, len(indices))
    return list(indices), index_of_frame


def animations_of(sheet: AtlasSheet, textures: dict[str, int]) -> list[SpriteAnimation]:
    """Return the animations; ``textures`` has the index of each frame's texture by its name."""
    durations = {region.name: region.duration for region in sheet.regions}
    title_of = titles(animation.name for animation in sheet.animations)
    animations = []
    for animation in sheet.animations:
        speed, ticks = frame_timing([durations[frame] for frame in animation.frames])
        frames = [
            SpriteFrame(textures[frame], count)
            for frame, count in zip(animation.frames, ticks, strict=True)
        ]
        title, loop = title_of[animation.name], animation.loop
        animations.append(SpriteAnimation(title, loop, speed, tuple(frames)))
    return animations


def frame_timing(durations: Sequence[float]) -> FrameTiming:
    """Return the timing of frames with these durations, ms."""
    shortest = min(durations)
    ticks = (round(duration / shortest, _DECIMALS) for duration in durations)
    return FrameTiming(round(1000 / shortest, _DECIMALS), tuple(ticks))


def pivot(region: Region) -> tuple[float, float]:
    """Return a frame's pivot, px from the top-left corner of the untrimmed frame, y down."""
    x, y = region.anchor
    return (
        round(x * region.frame_width, _DECIMALS),
        round(y * region.frame_height, _DECIMALS),
    )


def _rounded_up(length: float) -> int:
    return math.ceil(round(length, _DECIMALS))


def pivots(sheet: AtlasSheet) -> dict[str, tuple[float, float]]:
    """Return the pivot of each animation, px, by its name."""
    regions = {region.name: region for region in sheet.regions}
    return {animation.name: pivot(regions[animation.frames[0]]) for animation in sheet.animations}

"""Finished animations, and what a recipe contributes to the pages: all of its animations.

A build has one contribution, or one from each member if recipes share pages (``atlas.members``).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from fire_atlas.atlas.sheet import AnimationFrames, AtlasSheet
from fire_atlas.channels.cross_validation import motion_statistics
from fire_atlas.channels.motion import Motion
from fire_atlas.core.cpu import cpu_class
from fire_atlas.effect.composition.light import ClipLight
from fire_atlas.effect.flakes.tracks import Tracks
from fire_atlas.pipeline.render import RenderedFrame


@dataclass(frozen=True, slots=True)
class FinishedAnimation:
    """An animation with rendered frames, ready for packing.

    Attributes:
        frames: In playing order.
        fps: Frames per second.
        loop: Whether frame 0 follows the last frame.
        foot: (x, y) of the base of the fire, px, y down; None: the middle of the bottom edge.
        motion: Motion of the flame, if the recipe has motion vectors.
        tracks: Flakes, if there are any.
        bakes_flakes: Whether flakes are drawn into the frames.
        pixel_art: Whether it is pixel art, whose pixels stay sharp when they are shown larger.
        statistics: Figures about the clip and its flakes, for the manifest.
    """

    frames: Sequence[RenderedFrame]
    fps: float
    loop: bool
    foot: tuple[float, float] | None = None
    motion: Motion | None = None
    tracks: Tracks | None = None
    bakes_flakes: bool = False
    pixel_art: bool = False
    statistics: Mapping[str, Any] = field(default_factory=dict)

    def frames_for_pages(self, name: str) -> AnimationFrames:
        """Return the frames in the largest scale for packing, as the animation ``name``."""
        sprites = tuple(frame.sprites[0] for frame in self.frames)
        return AnimationFrames(name, sprites, 1000 / self.fps, self.loop, self.foot)

    def all_statistics(self) -> dict[str, Any]:
        """Return the statistics with those of motion vectors, as the manifest states them."""
        motion = {} if self.motion is None else motion_statistics(self.motion.validation)
        return {**self.statistics, **motion}

    @property
    def light(self) -> ClipLight | None:
        """The light that the animation gives; None if it was not measured."""
        lights = tuple(frame.light for frame in self.frames if frame.light is not None)
        width = max(frame.width for frame in self.frames)
        height = max(frame.height for frame in self.frames)
        return ClipLight(self.fps, width, height, self.loop, lights) if lights else None


@dataclass(frozen=True, slots=True)
class Contribution:
    """The animations of one recipe.

    Attributes:
        name: Name of the recipe.
        animations: By name.
        statistics: Figures about the animations, for the manifest.
    """

    name: str
    animations: Mapping[str, FinishedAnimation]
    statistics: dict[str, Any]


def build_statistics(contributions: Sequence[Contribution], sheet: AtlasSheet) -> dict[str, Any]:
    """Return statistics of the pages and of each recipe, and the class of the CPU."""
    area = sum(page.width * page.height for page in sheet.pages)
    places = {(region.page, region.x, region.y): region for region in sheet.regions}
    used = sum(region.width * region.height for region in places.values())
    of_all = {
        "pages": [[page.width, page.height] for page in sheet.pages],
        "occupancy": round(used / area, 4),
        "cpu": cpu_class(),
    }
    if len(contributions) == 1:
        return {**contributions[0].statistics, **of_all}
    members = {each.name: each.statistics for each in contributions}
    return {"frames": len(sheet.regions), **of_all, "members": members}


def animations_by_name(contributions: Sequence[Contribution]) -> dict[str, FinishedAnimation]:
    """Return all animations by their names on the pages.

    If several recipes share pages, the name of an animation begins with that of its recipe.
    """
    return {
        _title(name, each, contributions): animation
        for each in contributions
        for name, animation in each.animations.items()
    }


def _title(name: str, contribution: Contribution, contributions: Sequence[Contribution]) -> str:
    is_only = len(contributions) == 1 or list(contribution.animations) == [contribution.name]
    return name if is_only else f"{contribution.name}/{name}"

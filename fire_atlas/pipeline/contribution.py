"""What a recipe brings to the pages: finished animations.

Usually a build has one contribution. Recipes that share their pages (``atlas.members``) bring one
each.
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
    """An animation whose frames are rendered.

    Attributes:
        frames: In playing order.
        fps: Frames per second.
        loop: Whether frame 0 follows the last frame.
        foot: (x, y) of the effect's foot in the frame, px, y down; None: the middle of its bottom.
        motion: How the flame moves, where that is asked for.
        tracks: The flakes, where there are any.
        bakes_flakes: Whether the flakes are in the frames too.
        statistics: Figures about the clip and its flakes, for the manifest.
    """

    frames: Sequence[RenderedFrame]
    fps: float
    loop: bool
    foot: tuple[float, float] | None = None
    motion: Motion | None = None
    tracks: Tracks | None = None
    bakes_flakes: bool = False
    statistics: Mapping[str, Any] = field(default_factory=dict)

    def frames_for_pages(self, name: str) -> AnimationFrames:
        """Return what goes onto the pages, of the largest scale, under the name ``name``."""
        sprites = tuple(frame.sprites[0] for frame in self.frames)
        return AnimationFrames(name, sprites, 1000 / self.fps, self.loop, self.foot)

    def figures(self) -> dict[str, Any]:
        """Return what the manifest states of the animation."""
        motion = {} if self.motion is None else motion_statistics(self.motion.validation)
        return {**self.statistics, **motion}

    @property
    def light(self) -> ClipLight | None:
        """The light the animation gives, where it was measured."""
        lights = tuple(frame.light for frame in self.frames if frame.light is not None)
        width = max(frame.width for frame in self.frames)
        height = max(frame.height for frame in self.frames)
        return ClipLight(self.fps, width, height, self.loop, lights) if lights else None


@dataclass(frozen=True, slots=True)
class Contribution:
    """What one recipe brings.

    Attributes:
        name: Of the recipe.
        animations: By name.
        statistics: Figures about them, for the manifest.
    """

    name: str
    animations: Mapping[str, FinishedAnimation]
    statistics: dict[str, Any]


def build_statistics(contributions: Sequence[Contribution], sheet: AtlasSheet) -> dict[str, Any]:
    """Return figures about the pages of a sheet, and about the one recipe or each of several.

    With them stands the class of the CPU that the bytes come from.
    """
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


def named(contributions: Sequence[Contribution]) -> dict[str, FinishedAnimation]:
    """Return all animations by the name they have on the pages.

    Where several recipes share the pages, the recipe's name goes before that of its animation.
    """
    return {
        _title(name, each, contributions): animation
        for each in contributions
        for name, animation in each.animations.items()
    }


def _title(name: str, contribution: Contribution, all_of_them: Sequence[Contribution]) -> str:
    is_only = len(all_of_them) == 1 or list(contribution.animations) == [contribution.name]
    return name if is_only else f"{contribution.name}/{name}"

"""What the pages of a build show: its animations, textures of flakes, and ramps of heat."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from fire_atlas.atlas.sheet import AtlasSheet, StateGraph
from fire_atlas.core.context import BuildContext
from fire_atlas.core.cpu import cpu_class
from fire_atlas.core.statistics import figures_entry
from fire_atlas.formats.textures.memory import memory_by_format
from fire_atlas.pipeline.animation.contribution import (
    Contribution,
    FinishedAnimation,
    FinishedSprite,
    animations_by_name,
    textures_by_name,
    with_cell_names,
)
from fire_atlas.pipeline.animation.render import RenderedFrame
from fire_atlas.recipe.load import LoadedRecipe

if TYPE_CHECKING:
    from fire_atlas.pipeline.animation.flake_texture import PreparedTexture
    from fire_atlas.pipeline.pages.heat import HeatPages


@dataclass(frozen=True, slots=True)
class PageContent:
    """What is to be packed.

    Attributes:
        animations: By their names on the pages; their sprites are colours, or heat.
        textures: Textures of flakes, by their names on the pages.
        heat: What gives heat its colours; None if the pages have colours.
        states: In which order the animations may follow one another; None if each plays alone.
        single: Sprites that no animation plays.
    """

    animations: Mapping[str, FinishedAnimation]
    textures: "Mapping[str, PreparedTexture]"
    heat: "HeatPages | None" = None
    states: StateGraph | None = None
    single: tuple[FinishedSprite, ...] = ()

    def frames(self) -> list[RenderedFrame]:
        """Return the frames of all animations and the single sprites, as they are packed."""
        played = [frame for animation in self.animations.values() for frame in animation.frames]
        return played + [sprite.frame for sprite in self.single]

    def described(self, sheet: AtlasSheet) -> AtlasSheet:
        """Return a sheet of it that says how its pages get their colours, and has the states."""
        sheet = sheet if self.heat is None else self.heat.described(sheet)
        return replace(sheet, states=self.states)


def page_content(
    contributions: Sequence[Contribution], loaded: LoadedRecipe, context: BuildContext
) -> PageContent:
    """Return what all recipes of a build contribute to its pages, in heat if they store that.

    A recipe whose animations follow one another has pages of its own.
    """
    named = with_cell_names(loaded.recipe.name, contributions)
    animations, textures = animations_by_name(named), textures_by_name(named)
    if loaded.recipe.atlas.pixels == "color":
        single = tuple(sprite for recipe in named for sprite in recipe.single)
        return PageContent(animations, textures, states=named[0].states, single=single)
    from fire_atlas.pipeline.pages.heat import in_heat

    animations, heat = in_heat(animations, loaded, context)
    return PageContent(animations, textures, heat, named[0].states)


def build_statistics(
    contributions: Sequence[Contribution],
    content: PageContent,
    sheet: AtlasSheet,
    images: Mapping[str, Any],
) -> dict[str, Any]:
    """Return statistics of pages and their memory, of ``images`` by file, of heat by animation, of
    each recipe, and the CPU class."""
    area = sum(page.width * page.height for page in sheet.pages)
    places = {(region.page, region.x, region.y): region for region in sheet.placed}
    used = sum(region.width * region.height for region in places.values())
    of_all = {
        "pages": [[page.width, page.height] for page in sheet.pages],
        "occupancy": round(used / area, 4),
        "memory": memory_by_format(sheet),
        **images,
        **figures_entry("heat_error", content.heat.errors if content.heat else {}),
        "cpu": cpu_class(),
    }
    if len(contributions) == 1:
        return {**contributions[0].statistics, **of_all}
    members = {contribution.name: contribution.statistics for contribution in contributions}
    frames = len(sheet.regions) + len(sheet.singles)
    return {"frames": frames, **of_all, "members": members}

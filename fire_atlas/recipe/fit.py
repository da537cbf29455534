"""Recipe block ``fit``: a budget for the pages, within which the tool chooses what they hold."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, Self

from pydantic import Field, model_validator

from fire_atlas.recipe.base import BLOCK, OFF, Off, Settings, either
from fire_atlas.recipe.problem import Problem

if TYPE_CHECKING:
    from fire_atlas.recipe.models import Recipe

_MAX_SIDE = 16384


class Fit(Settings):
    """A budget. The effect is made as the recipe says; then the tool chooses the height of its
    frames on the pages, and which frames are left out, so that what is played within the budget
    comes closest to the whole. A frame is shown until the next one that is kept, so that JSON, CSS
    and Godot play frames of unlike durations."""

    page: int | None = Field(default=None, ge=16, le=_MAX_SIDE)
    """Largest width and height of a page, px: the default of ``atlas.max_size``."""
    pages: int | None = Field(default=None, ge=1, le=1024)
    """Largest number of pages: the default of ``atlas.max_pages``, else 1."""
    memory: float | None = Field(default=None, ge=0.001, le=4096)
    """Memory that all pages may take on a GPU, MiB, with the mip levels that are written:
    uncompressed, or with ``atlas.gpu`` as the largest of its formats."""
    cells: int | None = Field(default=None, ge=1, le=4096)
    """Largest number of frames of all animations."""
    shown: int | None = Field(default=None, ge=8, le=_MAX_SIDE)
    """How high a frame is drawn at most, px of the screen: frames need not be higher."""

    @model_validator(mode="after")
    def _has_any(self) -> Self:
        if not any(value is not None for _, value in self):
            raise ValueError(
                "has no budget; give it page, pages, memory, cells or shown, or remove fit"
            )
        return self


FitOrNone = Annotated[
    Off | Annotated[Fit, BLOCK],
    either("`none` or a block of settings"),
    OFF,
]


def against_fit(recipe: "Recipe", fit: Fit) -> Iterator[Problem]:
    """Yield what a recipe cannot have beside ``fit``."""
    atlas = recipe.atlas
    if fit.page is not None and atlas.max_size > fit.page:
        yield Problem(
            ("atlas", "max_size"),
            f"lets pages be larger than fit.page, {fit.page}; remove one of them",
        )
    if fit.pages is not None and (atlas.max_pages == "none" or atlas.max_pages > fit.pages):
        yield Problem(
            ("atlas", "max_pages"),
            f"lets there be more pages than fit.pages, {fit.pages}; remove one of them",
        )
    if not recipe.has_fire or atlas.members:
        what = "atlas.members share pages, and" if atlas.members else "sprites are only packed, and"
        yield Problem(
            ("fit",), f"{what} none of them is to be made smaller or left out; remove fit"
        )
    if recipe.wind.levels:
        yield Problem(
            ("fit",),
            "leaves out frames, by whose numbers a game changes the wind; remove it, or give the "
            "fire one wind.level",
        )
    if recipe.phases != "none":
        yield Problem(
            ("fit",),
            "leaves out frames, by whose numbers a game lights the fire and puts it out; remove "
            "it, or phases",
        )
    for name, value in recipe.maps:
        if value not in (False, "none"):
            yield Problem(
                ("maps", name),
                "is made for every frame in its full size, but fit makes frames smaller and leaves "
                "some out; remove one of them",
            )
    if recipe.tracks:
        yield Problem(
            ("tracks",),
            "state every frame, in px of its full size, but fit makes frames smaller and leaves "
            "some out; remove tracks, or fit",
        )
    if recipe.flakes != "none" and recipe.flakes.own_texture is not None:
        yield Problem(
            ("flakes", "texture"),
            "is drawn by clients along the flakes' tracks, which fit leaves out; remove one of "
            "them",
        )
    if recipe.flakes != "none" and not recipe.flakes.bake:
        yield Problem(
            ("flakes", "bake"),
            "false leaves the flakes to their tracks, which fit leaves out: they were lost; remove "
            "one of them",
        )
    if atlas.scales != (1.0,):
        yield Problem(("atlas", "scales"), "are further sizes, but fit chooses one; remove them")
    if atlas.bits == 16:
        yield Problem(("atlas", "bits"), "must be 8 with fit; leave it out, or remove fit")
    if atlas.pixels == "heat4":
        yield Problem(
            ("atlas", "pixels"),
            "lays four consecutive frames in one cell, but fit leaves single ones out; use heat or "
            "color",
        )
    if atlas.layout == "grid" and atlas.grid is not None:
        yield Problem(
            ("atlas", "grid"),
            "states the number of cells, which fit chooses; remove it, and state fit.cells",
        )

"""The model of a whole recipe."""

from collections.abc import Iterator
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from fire_atlas.recipe.base import LIST, Settings
from fire_atlas.recipe.effect import (
    PAPER_ALPHA,
    Buoyancy,
    Composite,
    Features,
    Flakes,
    FlakesOrNone,
    MotionBlur,
    MotionBlurOrNone,
)
from fire_atlas.recipe.output import GODOT_BLEED, Atlas, Export, Maps, TrackName
from fire_atlas.recipe.problem import ContradictionError, Problem
from fire_atlas.recipe.silk import SilkSource
from fire_atlas.recipe.source import FramesSource, ProfileSource, Source, Views
from fire_atlas.recipe.timeline import Timeline
from fire_atlas.recipe.tree import MAX_NAME, NAME_PATTERN
from fire_atlas.recipe.wind import Wind


class Recipe(Settings):
    """One effect: where its fire comes from, what is done to it and what is written."""

    version: Literal[1] = 1
    """Version of the recipe format."""
    name: str = Field(default="", pattern=NAME_PATTERN, max_length=MAX_NAME)
    """File stem of all outputs. Default: the recipe file's own stem."""
    seed: int = Field(default=0, ge=0, le=2**32 - 1)
    """Seed of all chance in the build."""
    source: Source | None = None
    """Where the fire comes from. Only recipes with ``atlas.members`` can do without."""
    views: Views = Views()
    """The sides a 3D fire is seen from."""
    timeline: Timeline = Timeline()
    """How the clip plays."""
    wind: Wind = Wind()
    """Wind that bends the plume."""
    features: Features = Features()
    """Where the fire tears (eq. 1-3)."""
    buoyancy: Buoyancy = Buoyancy()
    """The field that carries the flakes (eq. 12)."""
    flakes: FlakesOrNone = Flakes()
    """The flakes, or ``none``."""
    motion_blur: MotionBlurOrNone = MotionBlur()
    """Blur along the field (eq. 14-17), or ``none``."""
    composite: Composite = Composite()
    """How flakes join the flame."""
    atlas: Atlas = Atlas()
    """The pages."""
    maps: Maps = Maps()
    """Motion vectors and layers beside the pages."""
    exports: Annotated[tuple[Export, ...], LIST] = ("json",)
    """Descriptions of the pages to write."""
    tracks: Annotated[tuple[TrackName, ...], LIST] = ("json",)
    """What to write for engines to play beside the pages: where every flake is (``json``, ``csv``),
    the same as a cache for Niagara (``hjson``), all births for Unity's VFX Graph (``pcache``), and
    the light the fire gives, for a lamp (``light``)."""

    @property
    def is_pixel_art(self) -> bool:
        """Whether frames or flakes are drawn in hard pixels."""
        nearest = isinstance(self.source, FramesSource) and self.source.sampling == "nearest"
        return nearest or (self.flakes != "none" and self.flakes.sprite == "pixel")

    @model_validator(mode="after")
    def _refuse_contradictions(self) -> Self:
        if problems := tuple(self._contradictions()):
            raise ContradictionError(*problems)
        return self

    def _contradictions(self) -> Iterator[Problem]:
        if self.timeline.tail and self.flakes == "none":
            yield Problem(
                ("timeline", "tail"),
                "waits for flakes to burn out, but flakes is none; remove one of them",
            )
        if isinstance(self.source, FramesSource) and self.views != Views():
            yield Problem(
                ("views",),
                "frames have one side only; take it out, or make the fire in 3D with "
                "source.kind: silk, or learn it with source.kind: profile",
            )
        if isinstance(self.source, ProfileSource | SilkSource):
            yield from _clip_only_keys(self.timeline)

    @model_validator(mode="before")
    @classmethod
    def _paper_alpha(cls, given: Any) -> Any:
        """Give ``flakes.alpha`` the paper's value where the paper's features are chosen."""
        if not isinstance(given, dict):
            return given
        features, flakes = given.get("features"), given.get("flakes", {})
        is_paper = isinstance(features, dict) and features.get("preset") == "paper"
        if is_paper and isinstance(flakes, dict):
            return {**given, "flakes": {"alpha": PAPER_ALPHA, **flakes}}
        return given

    @model_validator(mode="before")
    @classmethod
    def _bleed_for_godot(cls, given: Any) -> Any:
        """Give ``atlas.bleed`` its default where Godot shows straight pages.

        Its filter mixes in the colour of transparent px, so that enlarged edges would turn dark.
        """
        if not isinstance(given, dict):
            return given
        exports, atlas = given.get("exports"), given.get("atlas", {})
        is_for_godot = isinstance(exports, list | tuple) and any(
            export == "godot" or (isinstance(export, dict) and "godot" in export)
            for export in exports
        )
        is_straight = isinstance(atlas, dict) and atlas.get("alpha", "straight") == "straight"
        if is_for_godot and is_straight:
            return {**given, "atlas": {"bleed": GODOT_BLEED, **atlas}}
        return given


def _clip_only_keys(timeline: Timeline) -> Iterator[Problem]:
    """Yield the keys that apply to a clip, which is cut and joined, but not to generated fire."""
    if timeline.loop in ("crossfade", "pingpong"):
        yield Problem(
            ("timeline", "loop"),
            f"{timeline.loop} joins the ends of a clip, but generated fire needs no joining; use "
            f"auto, or none to play once",
        )
    for key, is_set in (("overlap", timeline.overlap != "auto"), ("tail", bool(timeline.tail))):
        if is_set:
            yield Problem(
                ("timeline", key), "applies to clips only, but this fire is generated; remove it"
            )

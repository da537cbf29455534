"""The model of a whole recipe."""

import math
from collections.abc import Iterator
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from fire_atlas.recipe.base import DIFFERENT, LIST, Settings
from fire_atlas.recipe.effect import (
    MAX_VARIANTS,
    PAPER,
    Buoyancy,
    Composite,
    Features,
    Flakes,
    FlakesOrNone,
    MotionBlur,
    MotionBlurOrNone,
)
from fire_atlas.recipe.fit import READY_BUDGETS, Fit, FitOrNone
from fire_atlas.recipe.fluid import FluidSource
from fire_atlas.recipe.gpu import GpuFormat, choices_of_blocks
from fire_atlas.recipe.output import (
    GODOT_BLEED,
    Atlas,
    Export,
    Maps,
    MovieName,
    TrackName,
    UnityExport,
    export_name,
)
from fire_atlas.recipe.phases import PhasesOrNone
from fire_atlas.recipe.problem import ContradictionError, Problem
from fire_atlas.recipe.silk import SilkSource
from fire_atlas.recipe.source import (
    FramesSource,
    ProfileSource,
    Source,
    SpritesSource,
    Views,
)
from fire_atlas.recipe.timeline import Timeline
from fire_atlas.recipe.tree import MAX_NAME, NAME_PATTERN
from fire_atlas.recipe.wind import MIN_LOOP_IN_WIND, Wind

_NEED_STRAIGHT = {"bleed", "members"}
"""Keys of ``atlas`` with which pages stay straight by default: single sprites of members are shown
without a material."""


class Recipe(Settings):
    """One effect: its source of fire, how it is processed, and the files to write."""

    version: Literal[1] = 1
    """Version of the recipe format."""
    name: str = Field(default="", pattern=NAME_PATTERN, max_length=MAX_NAME)
    """File stem of all outputs. Default: the stem of the recipe file."""
    seed: int = Field(default=0, ge=0, le=2**32 - 1)
    """Seed of all random numbers in the build."""
    source: Source | None = None
    """Where the fire comes from. Only recipes with ``atlas.members`` may leave it out."""
    views: Views = Views()
    """The sides from which a 3D fire is seen."""
    timeline: Timeline = Timeline()
    """Length, frame rate and looping of the result."""
    wind: Wind = Wind()
    """Wind that carries flakes away outside the flame, by ``buoyancy.drag``, and bends the flame of
    sources ``profile``, ``silk`` and ``fluid``. The flame of ``frames`` stays as it is, so that
    wind on them is refused where it has nothing to carry."""
    phases: PhasesOrNone = "none"
    """How the fire is lit and put out, or ``none``: it burns for ever."""
    variants: int = Field(default=1, ge=1, le=MAX_VARIANTS)
    """Number of fires of this recipe on shared pages, for scenes with several: animations ``v0``,
    ``v1``, ... Generated fire and flakes have a seed of their own in each, a clip is cut into so
    many loops. No two ever show the same drawing, or its mirror image."""
    features: Features = Features()
    """Which edges of the flame can shed sparks (eq. 1-3)."""
    buoyancy: Buoyancy = Buoyancy()
    """The velocity field that carries the flakes (eq. 12)."""
    flakes: FlakesOrNone = Flakes()
    """The flakes, or ``none``."""
    motion_blur: MotionBlurOrNone = MotionBlur()
    """Blur along the field (eq. 14-17), or ``none``."""
    composite: Composite = Composite()
    """How the flakes are composited onto the flame."""
    atlas: Atlas = Atlas()
    """The pages: packing, pixels and sizes."""
    fit: FitOrNone = "none"
    """A budget for the pages, in which the tool chooses the height of frames and which are kept.
    ``roblox``: a grid of 2 × 2, 4 × 4 or 8 × 8 frames on at most 1024 px; ``unity-mobile``: a page
    of at most 2048 px and 4 MiB; ``vrchat``: of 2048 px and 8 MiB; ``web``: of 4096 px and 16 MiB.
    ``none``: pages are as large as the effect is."""
    maps: Maps = Maps()
    """Further images beside the pages: motion vectors and layers."""
    exports: Annotated[tuple[Export, ...], LIST, DIFFERENT] = ("json",)
    """Files to write that describe the pages to engines and other clients."""
    tracks: Annotated[tuple[TrackName, ...], LIST, DIFFERENT] = ("json",)
    """Files to write with the motion of the flakes: their places in every frame (``json``,
    ``csv``), the same as a Niagara cache (``hjson``), or their spawns for Unity's VFX Graph
    (``pcache``). ``light``: the light of the fire, for a lamp in the scene."""
    movies: Annotated[tuple[MovieName, ...], LIST, DIFFERENT] = ()
    """Files to write that play without an engine, one for each animation: ``webm`` (VP9 with alpha,
    for browsers and overlays of streams), ``webp`` and ``apng`` (lossless), ``gif`` (one palette; a
    pattern of dots for alpha), ``mp4`` (H.264 for video editors: the picture over black, and beside
    it its alpha in grey)."""

    @property
    def is_pixel_art(self) -> bool:
        """Whether frames or flakes are drawn in hard pixels."""
        nearest = isinstance(self.source, FramesSource) and self.source.sampling == "nearest"
        return nearest or (self.flakes != "none" and self.flakes.sprite == "pixel")

    @property
    def budget(self) -> Fit | None:
        """The budget of its pages, if it has one."""
        return self.fit if isinstance(self.fit, Fit) else None

    @property
    def texture_choices(self) -> list[tuple[GpuFormat, ...]]:
        """The compressed textures that its pages may have: a budget leaves those of one kind of
        blocks to each family of devices, if they hold colours."""
        if self.budget is None or self.atlas.pixels != "color":
            return [self.atlas.gpu]
        return choices_of_blocks(self.atlas.gpu)

    @property
    def has_fire(self) -> bool:
        """Whether its own source is fire, which is played; all sprites may be single ones."""
        return self.source is not None and not isinstance(self.source, SpritesSource)

    @property
    def may_have_sprites(self) -> bool:
        """Whether there may be single sprites: its own, or those of members."""
        return isinstance(self.source, SpritesSource) or bool(self.atlas.members)

    @property
    def changes_in_game(self) -> bool:
        """Whether a game changes it while it runs: the wind on it, or whether it burns."""
        return bool(self.wind.levels) or self.phases != "none"

    @property
    def has_effect(self) -> bool:
        """Whether frames are changed: flakes are added, or the flame is blurred."""
        return self.blurs_flame or self.flakes != "none"

    @property
    def bakes_flakes(self) -> bool:
        """Whether flakes are drawn into the pixels of the pages."""
        return self.flakes != "none" and self.flakes.bake

    @property
    def may_have_flakes(self) -> bool:
        """Whether flakes may fly: its own, or those of members."""
        return self.flakes != "none" or bool(self.atlas.members)

    @property
    def needs_field(self) -> bool:
        """Whether the motion of the air is needed even without flakes."""
        return self.blurs_flame or self.maps.haze

    @property
    def blurs_flame(self) -> bool:
        """Whether the flame is blurred along the field."""
        return self.motion_blur != "none" and self.motion_blur.flame

    @property
    def shutter(self) -> float:
        """Fraction of a frame's time during which the shutter is open, 0..1."""
        return 0.0 if self.motion_blur == "none" else self.motion_blur.shutter

    def some_flakes(self) -> Flakes:
        """Return the section of a recipe that has flakes.

        Raises:
            ValueError: It has none.
        """
        if self.flakes == "none":
            raise ValueError("the recipe has no flakes")
        return self.flakes

    def in_one_round(self) -> Self:
        """Return the recipe with flakes that repeat with their loop: what it changes into takes
        them on."""
        if self.flakes == "none":
            return self
        return self.model_copy(update={"flakes": self.flakes.model_copy(update={"rounds": 1})})

    def without_flakes(self) -> Self:
        """Return the recipe without flakes."""
        return self.model_copy(update={"flakes": "none"})

    @model_validator(mode="after")
    def _refuse_contradictions(self) -> Self:
        if problems := tuple(self._contradictions()):
            raise ContradictionError(*problems)
        return self

    def _contradictions(self) -> Iterator[Problem]:
        if self.timeline.tail and (why := _why_no_flakes(self.flakes)):
            yield Problem(
                ("timeline", "tail"),
                f"waits for flakes to burn out, but {why}; remove one of them",
            )
        yield from _rounds_in_pages(self.flakes, self.maps)
        yield from _idle_keys(self)
        if self.wind.levels:
            yield from _against_levels(self)
        if self.phases != "none":
            yield from _against_phases(self)
        if self.budget is not None:
            yield from _against_fit(self, self.budget)
        if self.variants > 1:
            yield from _against_variants(self)
        if isinstance(self.source, FramesSource) and self.views != Views():
            yield Problem(
                ("views",),
                "frames have one side only; leave views out, or make 3D fire with source.kind: "
                "silk, fluid or profile",
            )
        if isinstance(self.source, ProfileSource) and self.views.distance is not None:
            yield Problem(
                ("views", "distance"),
                "fire learnt from a clip is seen as its clip was filmed; remove it, or make 3D "
                "fire with source.kind: silk or fluid",
            )
        if isinstance(self.source, ProfileSource):
            for key in self.source.keys_of_learning():
                yield Problem(
                    ("source", key),
                    "says how to learn from a clip, but source.path is a profile that was learnt "
                    "already; remove it, or learn again with it: fire-atlas learn CLIP "
                    f"--set {key}=...",
                )
        if isinstance(self.source, SilkSource) and self.source.tile_width is not None:
            yield from _against_tiles(self.views)
        if isinstance(self.source, ProfileSource | SilkSource | FluidSource):
            yield from _clip_only_keys(self.timeline)
        if isinstance(self.source, SpritesSource):
            yield from _fire_only_keys(self)

    @model_validator(mode="before")
    @classmethod
    def _as_the_paper(cls, given: Any) -> Any:
        """Set what ``features.preset: paper`` stands for, where the recipe does not state it."""
        features = given.get("features") if isinstance(given, dict) else None
        if not isinstance(features, dict) or features.get("preset") != "paper":
            return given
        given_blocks = {name: given.get(name, {}) for name in PAPER}
        blocks = {name: block for name, block in given_blocks.items() if isinstance(block, dict)}
        return {**given, **{name: {**PAPER[name], **block} for name, block in blocks.items()}}

    @model_validator(mode="before")
    @classmethod
    def _without_effect_on_sprites(cls, given: Any) -> Any:
        """Give ``flakes`` and ``motion_blur`` their default for sprites, which have neither."""
        source = given.get("source") if isinstance(given, dict) else None
        if isinstance(source, dict) and source.get("kind") == "sprites":
            return {"flakes": "none", "motion_blur": "none", **given}
        return given

    @model_validator(mode="before")
    @classmethod
    def _pages_within_budget(cls, given: Any) -> Any:
        """Give ``atlas.max_size`` and ``atlas.max_pages`` their defaults by ``fit``, whose frames
        have no tracks."""
        if not isinstance(given, dict):
            return given
        fit, atlas = given.get("fit"), given.get("atlas", {})
        if isinstance(fit, str) and fit in READY_BUDGETS and isinstance(atlas, dict):
            fit, pages = READY_BUDGETS[fit]
            atlas = {**pages, **atlas}
        if not (isinstance(fit, dict) and isinstance(atlas, dict)):
            return given
        if fit.get("page") is not None:
            atlas = {"max_size": fit["page"], **atlas}
        atlas = {"max_pages": fit.get("pages") or 1, **atlas}
        return {"tracks": (), **given, "fit": fit, "atlas": atlas}

    @model_validator(mode="before")
    @classmethod
    def _pages_for_engines(cls, given: Any) -> Any:
        """Give ``atlas.alpha`` and ``atlas.bleed`` their defaults where engines show the pages.

        Their materials can add light, as straight pages cannot. Godot's filter mixes in the colour
        of transparent px, so that enlarged edges of straight pages would turn dark.
        """
        if not isinstance(given, dict):
            return given
        exports, atlas, source = given.get("exports"), given.get("atlas", {}), given.get("source")
        if not (isinstance(exports, list | tuple) and isinstance(atlas, dict)):
            return given
        if atlas.get("pixels", "color") != "color":
            return given
        is_fire = isinstance(source, dict) and source.get("kind") != "sprites"
        named = [next(iter(each), "") if isinstance(each, dict) else each for each in exports]
        is_for_engines = all(name in ("godot", "unity") for name in named)
        if is_fire and is_for_engines and not _NEED_STRAIGHT & atlas.keys():
            atlas = {"alpha": "premultiplied", **atlas}
        if "godot" in exports and atlas.get("alpha", "straight") == "straight":
            atlas = {"bleed": GODOT_BLEED, **atlas}
        return {**given, "atlas": atlas}


def _idle_keys(recipe: Recipe) -> Iterator[Problem]:
    """Yield the keys of the effect that would do nothing, because of another one."""
    buoyancy, flakes, blur = recipe.buoyancy, recipe.flakes, recipe.motion_blur
    if buoyancy.motion == "flow" and buoyancy.feature_force != "auto":
        yield Problem(
            ("buoyancy", "feature_force"),
            "pushes with motion: features alone; with flow, the optical flow says how the flame "
            "moves. Remove it, or set buoyancy.motion: features",
        )
    if buoyancy.motion == "features" and _differs(recipe, "buoyancy", "coupling"):
        yield Problem(
            ("buoyancy", "coupling"),
            "is how fast air adopts the optical flow, which motion: features does without; remove "
            "it, or set buoyancy.motion: flow",
        )
    if isinstance(recipe.source, FramesSource) and recipe.wind.peak > 0:
        why = _why_no_flakes(flakes)
        if why and not recipe.needs_field:
            yield Problem(("wind",), f"has no flakes to carry: {why}; remove one of them")
        elif buoyancy.drag == 0:
            yield Problem(
                ("wind",),
                "blows against the flakes of a clip by buoyancy.drag, which is 0; set it to 2, or "
                "remove wind",
            )
    if isinstance(blur, MotionBlur) and not blur.flame:
        for key in ("exaggeration", "samples"):
            if _differs(recipe, "motion_blur", key):
                yield Problem(
                    ("motion_blur", key),
                    "is of the flame's blur; add motion_blur.flame: true, or remove it",
                )
    if flakes != "none":
        if flakes.why_none:
            yield from _keys_without_flakes(recipe, flakes, flakes.why_none)
        yield from _idle_keys_of_flakes(recipe, flakes)
        if flakes.variants > 1:
            yield from _against_sets_of_flakes(recipe, flakes)


def _why_no_flakes(flakes: FlakesOrNone) -> str | None:
    """Return why a recipe has no flakes; None if it may have some."""
    return "flakes is none" if flakes == "none" else flakes.why_none


def _keys_without_flakes(recipe: Recipe, flakes: Flakes, why: str) -> Iterator[Problem]:
    """Yield the keys that ask for more of flakes than how they look and fly, where there are none;
    the others are let pass, so that ``--set flakes.rate=0`` shows any fire without them."""
    remedy = f"but {why}; remove one of them"
    asked = {
        "bursts": flakes.bursts not in ("auto", 0),
        "sparks": flakes.sparks not in ("auto", 0),
        "rounds": flakes.rounds not in ("auto", 1),
        "texture": flakes.own_texture is not None,
        "variants": flakes.variants > 1,
    }
    for key, is_asked in asked.items():
        if is_asked:
            yield Problem(("flakes", key), f"asks for flakes, {remedy}")
    if recipe.maps.flakes:
        yield Problem(("maps", "flakes"), f"draws the flakes alone, {remedy}")


def _idle_keys_of_flakes(recipe: Recipe, flakes: Flakes) -> Iterator[Problem]:
    """Yield the keys of flakes that would do nothing, and turbulence that reaches none."""
    if flakes.own_motion == 0:
        if _differs(recipe, "flakes", "lag"):
            yield Problem(
                ("flakes", "lag"),
                "is part of flakes.own_motion, which is 0; set that, or remove it",
            )
        if recipe.buoyancy.drag == 0 and _differs(recipe, "buoyancy", "turbulence"):
            yield Problem(
                ("buoyancy", "turbulence"),
                "reaches flakes by buoyancy.drag or flakes.own_motion, and both are 0; set one of "
                "them, or remove it",
            )
    if flakes.sparks == 0 and flakes.bursts not in ("auto", 0):
        yield Problem(
            ("flakes", "bursts"), "throw sparks, of which flakes.sparks: 0 leaves none; remove one"
        )
    if recipe.features.preset == "paper":
        for key, value, decides in (
            ("class", flakes.fire_class, "rate, sparks"),
            ("style", flakes.style, "size, colors, sprite"),
        ):
            if value != "auto":
                yield Problem(
                    ("flakes", key),
                    f"is unknown to features.preset: paper; remove it, and state what it would "
                    f"decide: {decides}",
                )
    if flakes.sprite == "pixel":
        for key in ("glow", "stretch"):
            if _differs(recipe, "flakes", key):
                yield Problem(
                    ("flakes", key), "is of soft flakes, but sprite is pixel; remove one of them"
                )


def _differs(recipe: Recipe, block: str, key: str) -> bool:
    """Return whether a key has another value than it would have if the recipe did not state it: as
    ``check --resolved`` prints them, keys that do nothing are let pass."""
    settings = getattr(recipe, block)
    preset = PAPER[block] if recipe.features.preset == "paper" else {}
    default = preset.get(key, type(settings).model_fields[key].default)
    return bool(getattr(settings, key) != default)


def _rounds_in_pages(flakes: FlakesOrNone, maps: Maps) -> Iterator[Problem]:
    """Yield a problem if flakes of several rounds are to be drawn into pages, which have one."""
    if flakes == "none" or flakes.rounds in ("auto", 1):
        return
    for shows, remedy in (
        (flakes.bake, "flakes.bake: false plays the flakes from their tracks instead"),
        (maps.flakes, "remove maps.flakes"),
    ):
        if shows:
            yield Problem(
                ("flakes", "rounds"),
                f"the pages show the flakes of one round of the loop; use auto, or {remedy}",
            )


def _against_levels(recipe: Recipe) -> Iterator[Problem]:
    """Yield what cannot be combined with ``wind.levels``."""
    levels = ("wind", "levels")
    if isinstance(recipe.source, FramesSource):
        yield Problem(
            levels,
            "a clip shows one wind; learn from it with source.kind: profile to make fire in "
            "others, or give one wind.level",
        )
    if isinstance(recipe.source, FluidSource):
        yield Problem(
            levels,
            "gas that burns has no states between two winds that would be a fire; use source.kind: "
            "silk, or build a recipe for each wind.level",
        )
    if recipe.views.count > 1:
        yield Problem(
            levels, "are built for one side of the fire; remove views.count, or give one wind.level"
        )
    if recipe.composite.listed_ramps:
        yield Problem(
            ("composite", "ramp"),
            "several ramps are animations of their own, while wind.levels are one fire's; name one "
            "ramp, not in a list",
        )
    if recipe.timeline.loop == "none":
        yield Problem(
            levels, "are loops that a game changes between; remove loop: none of the timeline"
        )
    if recipe.timeline.frames is not None and recipe.timeline.frames < MIN_LOOP_IN_WIND:
        yield Problem(
            ("timeline", "frames"),
            f"with wind.levels a loop needs at least {MIN_LOOP_IN_WIND} frames, to leave time for "
            f"transitions",
        )
    if recipe.flakes != "none" and recipe.flakes.rounds not in ("auto", 1):
        yield Problem(
            ("flakes", "rounds"),
            "with wind.levels the flakes repeat with their loop, so that transitions can take them "
            "on; remove it",
        )


def _against_phases(recipe: Recipe) -> Iterator[Problem]:
    """Yield what cannot be combined with ``phases``."""
    phases = ("phases",)
    if recipe.wind.levels:
        yield Problem(
            phases,
            "are of a fire in one wind: for each of wind.levels it would be lit and put out "
            "otherwise; remove one of them, or build a recipe for each wind.level",
        )
    if recipe.views.count > 1:
        yield Problem(phases, "are built for one side of the fire; remove views.count, or phases")
    if recipe.composite.listed_ramps:
        yield Problem(
            ("composite", "ramp"),
            "several ramps are animations of their own, while phases are one fire's; name one "
            "ramp, not in a list",
        )
    if recipe.timeline.loop == "none":
        yield Problem(
            phases,
            "are of a fire that loops; what plays once has a beginning and an end of its own. "
            "Remove phases, or loop: none of the timeline",
        )
    if recipe.flakes != "none" and recipe.flakes.rounds not in ("auto", 1):
        yield Problem(
            ("flakes", "rounds"),
            "with phases the flakes repeat with their loop, so that those that fly when it is left "
            "fly on; remove it",
        )


def _against_fit(recipe: Recipe, fit: Fit) -> Iterator[Problem]:
    """Yield what cannot be combined with ``fit``."""
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
    if recipe.variants > 1:
        yield Problem(
            ("fit",),
            "leaves out the same frames of all animations, but variants are fires of their own; "
            "remove it, or variants",
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
    if atlas.layout == "grid" and isinstance(fit.cells, tuple):
        for count in fit.cells:
            if math.isqrt(count) ** 2 != count:
                yield Problem(
                    ("fit", "cells"),
                    f"{count} cells are no grid with as many columns as rows; use 4, 16 or 64, or "
                    f"one number, the largest",
                )
    if atlas.layout == "grid" and atlas.grid is not None:
        yield Problem(
            ("atlas", "grid"),
            "states the number of cells, which fit chooses; remove it, and state fit.cells",
        )


def _against_variants(recipe: Recipe) -> Iterator[Problem]:
    """Yield what cannot be combined with ``variants``."""
    variants = ("variants",)
    if recipe.source is None:
        yield Problem(
            variants,
            "are of a recipe's own fire, and this one only packs members; give variants to these",
        )
    if isinstance(recipe.source, FramesSource) and recipe.timeline.loop == "none":
        yield Problem(
            variants,
            "of a clip are loops that are cut from it, but loop: none of the timeline plays it "
            "once; remove one of them",
        )


def _against_sets_of_flakes(recipe: Recipe, flakes: Flakes) -> Iterator[Problem]:
    """Yield what cannot be combined with ``flakes.variants``."""
    sets = ("flakes", "variants")
    if recipe.variants > 1:
        yield Problem(
            sets,
            "are sets of flakes over one flame, but each of variants is a fire with flakes of its "
            "own already; remove one of them",
        )
    if flakes.bake:
        yield Problem(
            sets,
            "are played from their tracks, but the pages show flakes already, of one set; add "
            "flakes.bake: false, or use variants, which draws several fires",
        )
    if recipe.maps.flakes:
        yield Problem(
            sets, "are played from their tracks, but maps.flakes draws one set; remove one of them"
        )
    playing = {
        export_name(export)
        for export in recipe.exports
        if not isinstance(export, UnityExport) or export.unity.flakes
    }
    if not playing & {"godot", "unity"} and not {*recipe.tracks} - {"light"}:
        yield Problem(
            sets,
            "are in the tracks and in what engines play, and this recipe writes neither; add "
            "tracks: [json], or remove it",
        )


def _against_tiles(views: Views) -> Iterator[Problem]:
    """Yield the views in which a tile would have a seam."""
    if views.count > 1:
        yield Problem(
            ("views", "count"),
            "a tile (sheets.tile) is one only from the front; remove it, or remove tile",
        )
    if views.distance is not None:
        yield Problem(
            ("views", "distance"),
            "in perspective what is near moves out of a tile (sheets.tile) further than what is "
            "far; remove it, or remove tile",
        )


def _clip_only_keys(timeline: Timeline) -> Iterator[Problem]:
    """Yield the keys of ``timeline`` that apply to clips but not to generated fire."""
    if timeline.loop in ("crossfade", "pingpong"):
        yield Problem(
            ("timeline", "loop"),
            f"{timeline.loop} joins the ends of a clip, but generated fire loops already; use "
            f"auto, or none to play once",
        )
    for key, is_set in (("overlap", timeline.overlap != "auto"), ("tail", bool(timeline.tail))):
        if is_set:
            yield Problem(
                ("timeline", key), "applies to clips only, but this fire is generated; remove it"
            )


def _fire_only_keys(recipe: Recipe) -> Iterator[Problem]:
    """Yield the keys that change fire, if the source are sprites, which stay as they are."""
    for key in ("flakes", "motion_blur"):
        if getattr(recipe, key) != "none":
            yield Problem((key,), "is of fire, but sprites are only packed; remove it")
    if recipe.phases != "none":
        yield Problem(("phases",), "are of fire, but sprites are only packed; remove it")
    if recipe.variants > 1:
        yield Problem(("variants",), "are of fire, but sprites are only packed; remove it")
    for key in ("views", "wind", "features", "buoyancy", "composite"):
        if getattr(recipe, key) != type(getattr(recipe, key))():
            yield Problem((key,), "is of fire, but sprites are only packed; remove it")
    if not recipe.timeline.keeps_all_frames:
        yield Problem(
            ("timeline",),
            "edits a clip, but the animations of sprites keep their frames; remove all of it but "
            "loop: none, which lets them play once",
        )
    if "light" in recipe.tracks:
        yield Problem(
            ("tracks", recipe.tracks.index("light")),
            "is the light that a fire gives, and sprites give none; remove it",
        )

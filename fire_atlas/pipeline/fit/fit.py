"""Fit an animation into a budget: of heights and frames, those that come closest to the whole.

A ladder of heights is tried; then, three times, those between the best one and its neighbours. At
each, choices of frames are tried from the smallest error up. Memory is that of the pages on which
they are packed. All this is done for each choice among the compressed textures that the recipe
lists. The order and the end of the trials depend on nothing but the frames.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise, product
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from fire_atlas.atlas.gpu import with_textures
from fire_atlas.atlas.sheet import Heat, Sprite
from fire_atlas.atlas.trim import trim_rects
from fire_atlas.core.context import BuildContext
from fire_atlas.core.errors import OutputError, RecipeError
from fire_atlas.formats.textures.memory import UNCOMPRESSED, largest_memory
from fire_atlas.pipeline.animation.contribution import Contribution, FinishedAnimation
from fire_atlas.pipeline.fit.frames import as_textures, at_heights, squared_errors
from fire_atlas.pipeline.fit.selection import Selection, holds, selections
from fire_atlas.pipeline.pages.content import PageContent
from fire_atlas.pipeline.pages.layout import placed, trim_margin
from fire_atlas.recipe.fit import Fit
from fire_atlas.recipe.gpu import blocks_of, formats_for, page_channels
from fire_atlas.recipe.models import Recipe
from fire_atlas.recipe.output import Atlas, PageGrid, export_name

_MIB = 1 << 20

_LADDER = tuple(2 ** (-step / 2) for step in range(7))
"""Heights to begin with, as shares of the largest."""

_ROUNDS = 3
"""How often heights are tried beside the best."""

_LEAST_HEIGHT = 16
"""No fire is made smaller than so many px."""

_CURVE = (1 / 4, 1 / 2, 1, 2, 4)
"""The budgets for which the curve says what they would give, as shares of the recipe's."""

_EVEN_ONLY = {"phaser", "tpsheet", "unity"}
"""Exports whose clients show all frames equally long."""


_Sizes: TypeAlias = tuple[tuple[tuple[int, int], ...], ...]
"""Widths and heights of the frames of each animation, px."""


class Offer(NamedTuple):
    """What a budget could be spent on.

    Attributes:
        height: Of the frames, px.
        kept: Which of them.
        memory: Bytes of the pages.
        error: Root mean square of the difference to the whole, linear light, 1 is white.
        blocks: How the pages are compressed, if the recipe leaves a choice.
    """

    height: int
    kept: tuple[int, ...]
    memory: int
    error: float
    blocks: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class _Level:
    """All frames at one height.

    Attributes:
        animations: By name.
        firsts: Of each animation, the first frame with the same pixels as each frame.
        choices: Choices among the frames, the best first.
    """

    animations: Mapping[str, FinishedAnimation]
    firsts: Sequence[Sequence[int]]
    choices: Sequence[Selection]


def fit(
    contribution: Contribution, recipe: Recipe, budget: Fit, context: BuildContext
) -> tuple[Contribution, Atlas]:
    """Return a recipe's animations with the frames and in the height that its budget is best spent
    on, and the settings of their pages; a note and the statistics say which.

    Raises:
        RecipeError: Nothing fits, or its animations differ in length.
    """
    limit = None if budget.memory is None else int(budget.memory * _MIB)
    limits = [None] if limit is None else [int(limit * share) for share in _CURVE]
    with context.timer.measure("fit"):
        searches = searches_of(contribution.animations, recipe, budget, context)
        for search in searches:
            for _ in range(_ROUNDS):
                search.add_neighbours([search.best(other) for other in limits])
        found, curve = closest(searches, limit), [closest(searches, other) for other in limits]
        if found is None:
            raise RecipeError(searches[-1].why_nothing_fits(limit), key=("fit",))
    search, best = found
    context.progress.note(search.sentence(best))
    animations = search.left(best.height, best.kept)
    fitted = replace(
        contribution,
        animations=animations,
        statistics={
            **_statistics(contribution.statistics, animations),
            "fit": {
                **_entry(best),
                "of": {"frames": search.count, "height": search.full_height},
                **({} if limit is None else {"curve": list(_points(limits, curve))}),
            },
        },
    )
    return fitted, search.atlas_for(best.kept)


def _entry(trial: Offer) -> dict[str, Any]:
    return {
        "frames": len(trial.kept),
        "height": trial.height,
        "memory": trial.memory,
        "error": round(trial.error, 6),
        **({"blocks": trial.blocks} if trial.blocks else {}),
    }


def _points(
    limits: Sequence[int | None], curve: Sequence["tuple[FitSearch, Offer] | None"]
) -> Iterator[dict[str, Any]]:
    for limit, found in zip(limits, curve, strict=True):
        if found is not None:
            yield {"budget": limit, **_entry(found[1])}


def _statistics(
    whole: Mapping[str, Any], animations: Mapping[str, FinishedAnimation]
) -> dict[str, Any]:
    """Return the figures of a recipe's animations with the number and the size of their frames."""

    def fitted(figures: Mapping[str, Any], animation: FinishedAnimation) -> dict[str, Any]:
        first = animation.frames[0]
        size = {"frames": len(animation.frames), "frame_size": [first.width, first.height]}
        return {**figures, **size}

    if "animations" not in whole:
        (animation,) = animations.values()
        return fitted(whole, animation)
    of_each = {name: fitted(whole["animations"][name], each) for name, each in animations.items()}
    return {**whole, "animations": of_each}


def _left(
    animation: FinishedAnimation, kept: tuple[int, ...], *, is_even: bool
) -> FinishedAnimation:
    """Return an animation of which only some frames are left, each shown until the next, or all
    equally long."""
    shown = holds(kept, len(animation.frames))
    frames = [animation.frames[i] for i in kept]
    if is_even or len(set(shown)) == 1:
        fps = animation.fps * len(kept) / len(animation.frames)
        return replace(animation, frames=frames, fps=fps)
    return replace(animation, frames=frames, holds=shown)


def searches_of(
    animations: Mapping[str, FinishedAnimation],
    recipe: Recipe,
    budget: Fit,
    context: BuildContext,
) -> list["FitSearch"]:
    """Return a search for each choice among the textures of a recipe, the one that takes most
    memory first.

    Raises:
        RecipeError: The animations differ in length.
    """
    choices = recipe.texture_choices
    atlases = [recipe.atlas.model_copy(update={"gpu": formats}) for formats in choices]
    scaled = _ScaledFrames(animations, recipe.atlas, budget, context)
    return [
        FitSearch(
            animations, recipe.model_copy(update={"atlas": atlas}), budget, context, scaled,
            is_chosen=len(choices) > 1,
        )
        for atlas in sorted(atlases, key=_least_bytes, reverse=True)
    ]  # fmt: skip


def closest(searches: Sequence["FitSearch"], limit: int | None) -> "tuple[FitSearch, Offer] | None":
    """Return the search and its trial that are closest to the whole within ``limit`` bytes, of
    equals the first; None if no search has any."""
    found = [(search, search.best(limit)) for search in searches]
    trials = [(search, trial) for search, trial in found if trial is not None]
    return min(trials, key=lambda of: of[1].error, default=None)


class _ScaledFrames:
    """All frames at the heights that are tried, and how far each is from each of the whole: made
    once for all searches.

    Attributes:
        whole: The animations at the largest height.
        top: That height, px.
        is_pixel_art: Whether there is no other height.
    """

    def __init__(
        self,
        animations: Mapping[str, FinishedAnimation],
        atlas: Atlas,
        budget: Fit,
        context: BuildContext,
    ) -> None:
        full_height = next(iter(animations.values())).frames[0].height
        self.is_pixel_art = any(animation.pixel_art for animation in animations.values())
        self.top = full_height
        if budget.shown and not self.is_pixel_art:
            self.top = min(full_height, budget.shown)
        self._atlas, self._context = atlas, context
        self.whole = {
            name: at_heights(animation, [self.top], atlas, context.workers)[0]
            for name, animation in animations.items()
        }
        self._made: dict[int, dict[str, FinishedAnimation]] = {}
        self._errors: dict[tuple[int, str], NDArray[np.float64]] = {}

    def at(
        self, heights: Sequence[int], blocks: Sequence[str]
    ) -> Iterator[tuple[Mapping[str, FinishedAnimation], NDArray[np.float64]]]:
        """Yield the animations at each of ``heights``, and the squared errors (i, j) of its frames
        j as frames i of the whole, the mean of those compressed to each of ``blocks``."""
        kinds = tuple(blocks) or ("",)
        new = [
            height
            for height in heights
            if any((height, kind) not in self._errors for kind in kinds)
        ]
        wanted = [
            kind for kind in kinds if any((height, kind) not in self._errors for height in new)
        ]
        if new:
            self._make(new, wanted)
        for height in heights:
            errors = sum(self._errors[height, kind] for kind in kinds)
            yield self._made[height], np.asarray(errors / len(kinds))

    def _make(self, heights: Sequence[int], kinds: Sequence[str]) -> None:
        workers, atlas = self._context.workers, self._atlas
        self._context.progress.stage("fit", len(self.whole))
        unmade = [height for height in heights if height not in self._made]
        found = dict.fromkeys(product(heights, kinds), np.zeros(()))
        for name, whole in self.whole.items():
            made = at_heights(whole, unmade, atlas, workers) if unmade else []
            for height, animation in zip(unmade, made, strict=True):
                self._made.setdefault(height, {})[name] = animation
            sprites = [_sprites(self._made[height][name]) for height in heights]
            textures = as_textures(sprites, [kind for kind in kinds if kind], atlas, workers)
            for kind, shown in zip(kinds, textures, strict=True):
                errors = squared_errors(_sprites(whole), shown, atlas, workers)
                for height, of_height in zip(heights, errors, strict=True):
                    found[height, kind] = found[height, kind] + of_height
            self._context.progress.advance()
        self._errors |= found


class FitSearch:
    """The trials of one fire, in the formats of its recipe.

    Attributes:
        count: Number of frames of the whole.
        full_height: Their height, px.
        levels: All frames at each height that is tried.
    """

    def __init__(
        self,
        animations: Mapping[str, FinishedAnimation],
        recipe: Recipe,
        budget: Fit,
        context: BuildContext,
        scaled: _ScaledFrames | None = None,
        *,
        is_chosen: bool = False,
    ) -> None:
        """Begin with the ladder of heights.

        Args:
            animations, recipe, budget, context: As of ``fit``.
            scaled: The frames that it has in common with other searches; None if there are none.
            is_chosen: Whether trials say how pages are compressed, as there is a choice.

        Raises:
            RecipeError: The animations differ in length.
        """
        first, *others = animations.values()
        self.count, self.full_height = len(first.frames), first.frames[0].height
        if any(len(other.frames) != self.count for other in others):
            raise RecipeError(
                "leaves out the same frames of all animations, but these differ in length; give "
                "them one by timeline.frames, or remove fit",
                key=("fit",),
            )
        self._recipe, self._context = recipe, context
        named = () if recipe.atlas.pixels != "color" else map(blocks_of, recipe.atlas.gpu)
        self._blocks = tuple(dict.fromkeys(named))
        self._told = self._blocks if is_chosen else ()
        cells = budget.cells or self.count * len(animations)
        self._exact = None if isinstance(cells, int) else cells
        most = cells if isinstance(cells, int) else max(cells)
        self._most = max(most // len(animations), 1)
        self._scaled = scaled or _ScaledFrames(animations, recipe.atlas, budget, context)
        exports = {export_name(export) for export in recipe.exports}
        self._is_even = recipe.atlas.layout == "grid" or bool(exports & _EVEN_ONLY)
        self._packed: dict[_Sizes, int | None] = {}
        self.levels: dict[int, _Level] = {}
        top = self._scaled.top
        least = top if self._scaled.is_pixel_art else min(_LEAST_HEIGHT, top)
        self.add([height for share in _LADDER if (height := round(top * share)) >= least])

    def add(self, heights: Sequence[int]) -> None:
        """Try further heights."""
        new = sorted(set(heights) - self.levels.keys(), reverse=True)
        for height, (animations, errors) in zip(
            new, self._scaled.at(new, self._blocks), strict=True
        ):
            firsts = [_firsts_of_equal(_sprites(animation)) for animation in animations.values()]
            choices = [
                choice
                for choice in selections(errors, self._most, is_even=self._is_even)
                if self._exact is None or len(choice.kept) * len(animations) in self._exact
            ]
            self.levels[height] = _Level(animations, firsts, choices)

    def add_neighbours(self, trials: Sequence[Offer | None]) -> None:
        """Try the heights halfway between those of ``trials`` and the next ones tried so far."""
        heights, wanted = sorted(self.levels), list[int]()
        for trial in trials:
            if trial is not None and trial.error > 0:
                at = heights.index(trial.height)
                near = heights[max(at - 1, 0) : at + 2]
                wanted += [round(math.sqrt(one * other)) for one, other in pairwise(near)]
        if set(wanted) - self.levels.keys():
            self.add(wanted)

    def best(self, limit: int | None) -> Offer | None:
        """Return the trial closest to the whole whose pages take at most ``limit`` bytes and are
        as the recipe allows; None if there is none.

        A smaller height is taken only where it has more frames as well: on average a blurred frame
        is closer to one that it stands for, but nobody wants that.
        """
        found: tuple[Selection, Offer] | None = None
        for height in sorted(self.levels, reverse=True):
            larger = found
            for choice in self.levels[height].choices:
                if larger is not None:
                    if choice.error >= larger[0].error:
                        break
                    if len(choice.kept) <= len(larger[0].kept):
                        continue
                memory = self._memory(height, choice.kept, limit)
                if memory is not None:
                    error = self.rms(choice.error)
                    found = choice, Offer(height, choice.kept, memory, error, self._told)
                    break
        return None if found is None else found[1]

    def rms(self, error: float) -> float:
        """Return the root mean square of a sum of squared errors, of white."""
        frames = [frame for each in self._scaled.whole.values() for frame in each.frames]
        values = sum(frame.width * frame.height for frame in frames) * 3 * 2
        return float(np.sqrt(error / values))

    def _memory(self, height: int, kept: tuple[int, ...], limit: int | None) -> int | None:
        """Return the bytes of the pages of a choice; None if they are too many, or too large."""
        atlas = self._recipe.atlas
        pages = 1024 if atlas.max_pages == "none" else atlas.max_pages
        sizes = self._sizes(height, kept, is_sorted=pages == 1)
        if sizes not in self._packed:
            area = sum(width * height for of_one in sizes for width, height in of_one)
            if atlas.pot and pages == 1:
                area = 1 << (area - 1).bit_length()
            if area > pages * atlas.max_size**2:
                return None
            if limit is not None and area * _least_bytes(atlas) > limit:
                return None
            self._packed[sizes] = self._context.workers.start(
                lambda: self.pack(height, kept)
            ).result()
        memory = self._packed[sizes]
        return None if memory is None or (limit is not None and memory > limit) else memory

    def _sizes(self, height: int, kept: tuple[int, ...], *, is_sorted: bool) -> _Sizes:
        """Return the sizes of all different frames of each animation, px: on one page they take
        the same room in any order."""
        atlas, level, found = self._recipe.atlas, self.levels[height], []
        is_grid = atlas.layout == "grid"
        trim = "animation" if is_grid and atlas.trim == "frame" else atlas.trim
        for animation, firsts in zip(level.animations.values(), level.firsts, strict=True):
            sprites = [animation.frames[i].sprites[0] for i in kept]
            margin = trim_margin(atlas, animation.has_hard_edges)
            rects = trim_rects(sprites, trim, margin=margin)
            places = {
                (rect.width, rect.height, i if is_grid or not atlas.dedupe else firsts[i]): None
                for i, rect in zip(kept, rects, strict=True)
            }
            sizes = [(width, height) for width, height, _ in places]
            found.append(tuple(sorted(sizes) if is_sorted else sizes))
        return tuple(found)

    def left(self, height: int, kept: tuple[int, ...]) -> dict[str, FinishedAnimation]:
        """Return the animations at a height of which only some frames are left."""
        return {
            name: _left(animation, kept, is_even=self._is_even)
            for name, animation in self.levels[height].animations.items()
        }

    def atlas_for(self, kept: tuple[int, ...]) -> Atlas:
        """Return the settings of pages for a choice: with the cells of a square grid, if the budget
        states exact numbers of cells."""
        atlas, side = self._recipe.atlas, math.isqrt(len(kept) * len(self._scaled.whole))
        if self._exact is None or atlas.layout != "grid":
            return atlas
        return atlas.model_copy(update={"grid": PageGrid(columns=side, rows=side)})

    def pack(self, height: int, kept: tuple[int, ...], atlas: Atlas | None = None) -> int | None:
        """Return the bytes of the pages on which a choice is packed, with the recipe's settings or
        others; None if there are too many, or a frame is too large for one."""
        animations, atlas = self.left(height, kept), atlas or self.atlas_for(kept)
        recipe = self._recipe.model_copy(update={"atlas": atlas})
        try:
            sheet = placed(recipe, PageContent(animations, {}))[0]
        except OutputError:  # a frame is too large for a page
            return None
        if atlas.max_pages != "none" and len(sheet.pages) > atlas.max_pages:
            return None
        if atlas.pixels == "heat":
            sheet = replace(sheet, heat=Heat(atlas.pixels, "", ()))
        return largest_memory(with_textures(sheet, atlas))

    def sentence(self, trial: Offer) -> str:
        """Return what was chosen."""
        blocks = "".join(f", {blocks}" for blocks in trial.blocks)
        return (
            f"fit: {len(trial.kept)} of {self.count} frames, {trial.height} of "
            f"{self.full_height} px high{blocks}: {trial.memory / _MIB:.2f} MiB; as it is played "
            f"it is {100 * trial.error:.2g} % of white off the whole"
        )

    def why_nothing_fits(self, limit: int | None) -> str:
        """Return which of the recipe's statements stand in the way, or what the least would be."""
        height, atlas = min(self.levels), self._recipe.atlas
        choices = self.levels[height].choices
        if not choices:
            return (
                f"nothing fits: of {self.count} frames in each of {len(self._scaled.whole)} "
                f"animations, none of fit.cells can be kept; ask for fewer"
            )
        smallest = min(choices, key=lambda choice: len(choice.kept)).kept
        in_the_way = list[str]()
        for key in sorted(atlas.model_fields_set - {"max_size", "max_pages", "pixels", "alpha"}):
            default = Atlas.model_fields[key].default
            if getattr(atlas, key) != default:
                memory = self.pack(height, smallest, atlas.model_copy(update={key: default}))
                if memory is not None and (limit is None or memory <= limit):
                    in_the_way.append(f"atlas.{key}")
        least = self.pack(height, smallest, atlas)
        frames = "1 frame" if len(smallest) == 1 else f"{len(smallest)} frames"
        if self._scaled.is_pixel_art:
            in_the_way.append("the size of pixel art, which is never changed")
        takes = "does not fit a page" if least is None else f"takes {least / _MIB:.4g} MiB"
        advice = (
            f"in the way: {', '.join(in_the_way)}" if in_the_way else "a larger budget is needed"
        )
        return f"nothing fits: {frames}, {height} px high, {takes}; {advice}"


def _sprites(animation: FinishedAnimation) -> list[Sprite]:
    return [frame.sprites[0] for frame in animation.frames]


def _firsts_of_equal(sprites: Sequence[Sprite]) -> list[int]:
    first: dict[tuple[tuple[int, ...], bytes], int] = {}
    return [
        first.setdefault((sprite.image.shape, sprite.image.tobytes()), i)
        for i, sprite in enumerate(sprites)
    ]


def _least_bytes(atlas: Atlas) -> float:
    """Return the bytes that a pixel takes at least, in the format that takes most."""
    if not atlas.gpu:
        return UNCOMPRESSED["r8" if atlas.pixels == "heat" else "rgba8"]
    from fire_atlas.formats.textures.blocks import FORMATS

    blocks = [FORMATS[blocks_of(f)] for f in formats_for(atlas.gpu, page_channels(atlas.pixels))]
    return max(format_.block_bytes / format_.side**2 for format_ in blocks)

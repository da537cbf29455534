"""Search for the frames and the height that come closest to the whole in a budget."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from fire_atlas.atlas.page_rules import PackingUnits
from fire_atlas.core.context import BuildContext
from fire_atlas.core.errors import RecipeError
from fire_atlas.pipeline.animation.contribution import FinishedAnimation
from fire_atlas.pipeline.fit.packed import Cells, PackedChoices, least_bytes, memory_of, packed
from fire_atlas.pipeline.fit.scaled import ScaledFrames
from fire_atlas.pipeline.fit.selection import Selection, holds, selections
from fire_atlas.recipe.fit import Fit
from fire_atlas.recipe.gpu import blocks_of, blocks_suffix
from fire_atlas.recipe.models import Recipe
from fire_atlas.recipe.output import Atlas, PageGrid, export_name

_MIB = 1 << 20

_LADDER = tuple(2 ** (-step / 2) for step in range(7))
"""Heights to begin with, as shares of the largest."""

_LEAST_HEIGHT = 16
"""No fire is made smaller than so many px."""

_EVEN_ONLY = {"phaser", "tpsheet", "unity"}
"""Exports whose clients show all frames equally long."""


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


class Shared(NamedTuple):
    """What all searches for one fire have in common.

    Attributes:
        scaled: Its frames at the heights that are tried.
        packed: The pages on which choices are packed.
    """

    scaled: ScaledFrames
    packed: PackedChoices


class _Candidate(NamedTuple):
    """A choice, and what it takes.

    Attributes:
        choice: Which frames.
        cells: Their places.
        area: What these cover, px.
    """

    choice: Selection
    cells: Cells
    area: int


@dataclass(frozen=True, slots=True)
class _Level:
    """All frames at one height.

    Attributes:
        animations: By name.
        choices: Choices among their frames, the best first.
    """

    animations: Mapping[str, FinishedAnimation]
    choices: Sequence[Selection]


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
        shared: Shared,
        *,
        is_chosen: bool = False,
    ) -> None:
        """Begin with the ladder of heights.

        Args:
            animations, recipe, budget, context: As of ``fit``.
            shared: What it has in common with other searches.
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
        self._scaled, self._packed = shared
        exports = {export_name(export) for export in recipe.exports}
        self._is_even = recipe.atlas.layout == "grid" or bool(exports & _EVEN_ONLY)
        self._units, self._bytes = PackingUnits.of(recipe.atlas), least_bytes(recipe.atlas)
        self._known: dict[int, list[_Candidate]] = {}
        self._memories: dict[Cells, int | None] = {}
        self.levels: dict[int, _Level] = {}
        top = self._scaled.top
        least = top if self._scaled.is_pixel_art else min(_LEAST_HEIGHT, top)
        self.add([height for share in _LADDER if (height := round(top * share)) >= least])

    def add(self, heights: Sequence[int]) -> None:
        """Try further heights."""
        new = sorted(set(heights) - self.levels.keys(), reverse=True)
        errors = self._scaled.errors(new, self._blocks)
        for height, animations, of_height in zip(new, self._scaled.at(new), errors, strict=True):
            choices = [
                choice
                for choice in selections(of_height, self._most, is_even=self._is_even)
                if self._exact is None or len(choice.kept) * len(animations) in self._exact
            ]
            self.levels[height] = _Level(animations, choices)

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
            least, error = (0, math.inf) if found is None else (len(found[0].kept), found[0].error)
            for candidate in self._candidates(height, error):
                choice = candidate.choice
                if choice.error >= error:
                    break
                if len(choice.kept) <= least:
                    continue
                memory = self._memory(height, candidate, limit)
                if memory is not None:
                    offer = Offer(height, choice.kept, memory, self.rms(choice.error), self._told)
                    found = choice, offer
                    break
        return None if found is None else found[1]

    def _candidates(self, height: int, below: float) -> Sequence[_Candidate]:
        """Return the choices of a level, the best first, but for those that a better one of as many
        frames has the same cells as; none if no error is ``below`` what is known."""
        animations, choices = self.levels[height].animations, self.levels[height].choices
        if not choices or choices[0].error >= below:
            return ()
        if height not in self._known:
            kept = [choice.kept for choice in choices]
            first: dict[tuple[int, Cells], Selection] = {}
            cells = self._packed.cells(list(animations.values()), kept, self._recipe.atlas)
            for choice, taken in zip(choices, cells, strict=True):
                first.setdefault((len(choice.kept), taken), choice)
            self._known[height] = [
                _Candidate(choice, taken, taken.area * self._units.px**2)
                for (_, taken), choice in first.items()
            ]
        return self._known[height]

    def rms(self, error: float) -> float:
        """Return the root mean square of a sum of squared errors, of white."""
        frames = [frame for each in self._scaled.whole.values() for frame in each.frames]
        values = sum(frame.width * frame.height for frame in frames) * 3 * 2
        return float(np.sqrt(error / values))

    def _memory(self, height: int, candidate: _Candidate, limit: int | None) -> int | None:
        """Return the bytes of the pages of a choice; None if they are too many, or too large."""
        cells = candidate.cells
        if cells not in self._memories:
            # To pack them takes a thousand times as long as these bounds.
            most = self._most_area(limit)
            if candidate.area > most or self._least_area(cells) > most:
                return None
            self._memories[cells] = self._context.workers.start(
                lambda: self._packed_memory(height, candidate)
            ).result()
        memory = self._memories[cells]
        return None if memory is None or (limit is not None and memory > limit) else memory

    def _most_area(self, limit: int | None) -> float:
        """Return how many px pages within ``limit`` bytes have at most."""
        atlas, side = self._recipe.atlas, self._units.rules.largest * self._units.px
        most = math.inf if atlas.max_pages == "none" else atlas.max_pages * side**2
        return most if limit is None else min(most, int(limit / self._bytes))

    def _least_area(self, cells: Cells) -> float:
        """Return how many px the pages of cells have at least."""
        rules, is_one_page = self._units.rules, self._recipe.atlas.max_pages == 1
        return (cells.least_page(rules) if is_one_page else cells.area) * self._units.px**2

    def _packed_memory(self, height: int, candidate: _Candidate) -> int | None:
        kept = candidate.choice.kept
        recipe = self._recipe.model_copy(update={"atlas": self.atlas_for(kept)})
        sheet = self._packed.sheet(candidate.cells, recipe, self.left(height, kept))
        return None if sheet is None else memory_of(sheet, recipe.atlas)

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
        recipe = self._recipe.model_copy(update={"atlas": atlas or self.atlas_for(kept)})
        sheet = packed(recipe, self.left(height, kept))
        return None if sheet is None else memory_of(sheet, recipe.atlas)

    def sentence(self, trial: Offer) -> str:
        """Return what was chosen."""
        return (
            f"fit: {len(trial.kept)} of {self.count} frames, {trial.height} of "
            f"{self.full_height} px high{blocks_suffix(trial.blocks)}: {trial.memory / _MIB:.2f} "
            f"MiB; as it is played it is {100 * trial.error:.2g} % of white off the whole"
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

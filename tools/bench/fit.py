"""What a budget gives: frames, height and error beside every n-th frame at the same memory.

``python -m tools.bench.fit [NAME|CLIP...]`` animates ready recipes, or clips given by their paths,
and fits each into 1, 2, 4 and 8 MiB. Generated fire is of draft size. It prints a row of each: the
frames that are kept, their height, the bytes of the pages as they are packed and the error, %
of white; then, of every n-th frame in full height, the smallest n of which the pages take no more,
with its error. At the end the CPU seconds of the animation and of each budget. It returns 1 if a
budget is not kept, or every n-th frame comes closer.
"""

import sys
import tempfile
import time
from pathlib import Path

from fire_atlas.core.context import BuildContext
from fire_atlas.core.shipped import shipped
from fire_atlas.core.workers import Workers
from fire_atlas.pipeline.animation.contribute import contribute
from fire_atlas.pipeline.animation.contribution import Contribution
from fire_atlas.pipeline.fit.budget_search import FitSearch
from fire_atlas.pipeline.fit.fit import fit, searches_of
from fire_atlas.pipeline.input.check import CheckedRecipe, load_checked
from fire_atlas.pipeline.input.open import open_input, open_ramps, open_texture
from fire_atlas.pipeline.pages.content import PageContent
from fire_atlas.pipeline.pages.layout import placed
from fire_atlas.recipe.fit import Fit
from fire_atlas.recipe.fluid import FluidSource
from fire_atlas.recipe.load import load_tree
from fire_atlas.recipe.silk import SilkSource
from fire_atlas.recipe.source import ProfileSource
from fire_atlas.recipe.tree import read_tree

_NAMES = (
    "candle", "torch", "cartoon", "pixel_art", "bonfire", "fire_wall", "explosion", "fluid_torch",
)  # fmt: skip
"""Recipes of each kind of source, in which no game changes the fire."""

_BUDGETS = (1, 2, 4, 8)
"""MiB."""

_MIB = 1 << 20


def loaded(recipe: Path) -> CheckedRecipe:
    """Return a recipe with a budget, small if it generates fire in a size that it leaves open."""
    changes = ["fit={memory: 1}", "tracks=[]", "maps={}", "exports=[json]", "phases=none"]
    tree = read_tree(recipe)
    source, height = load_tree(tree).recipe.source, tree.value(("source", "height"))
    if isinstance(source, SilkSource | ProfileSource | FluidSource) and height is None:
        changes.append("source.size=draft")
    if isinstance(source, FluidSource):
        changes.append("source.resolution=draft")
    return load_checked(read_tree(recipe, changes))


def animated(recipe: CheckedRecipe, context: BuildContext) -> Contribution:
    """Return the finished animations of a recipe."""
    cells, ramps = open_texture(recipe, context), open_ramps(recipe, context)
    return contribute(recipe, open_input(recipe, context), cells, ramps, context)


def every_nth(search: FitSearch, limit: int) -> tuple[int, float] | None:
    """Return the smallest n, and the error, of every n-th frame in full height whose pages take no
    more than ``limit`` bytes; None if not even the first fits."""
    height = max(search.levels)
    error_of = {choice.kept: choice.error for choice in search.levels[height].choices}
    for step in range(1, search.count + 1):
        kept = tuple(range(0, search.count, step))
        memory = search.pack(height, kept)
        if kept in error_of and memory is not None and memory <= limit:
            return step, search.rms(error_of[kept])
    return None


def rows(path: Path, context: BuildContext) -> bool:
    """Print the rows of a recipe; return whether each budget is kept and nothing comes closer."""
    recipe, began = loaded(path), time.process_time()
    whole = animated(recipe, context)
    seconds, is_sound = [time.process_time() - began], True
    search, *_ = searches_of(whole.animations, recipe.recipe, Fit(memory=8), context)
    for budget in _BUDGETS:
        began = time.process_time()
        fitted, atlas = fit(whole, recipe.recipe, Fit(memory=budget), context)
        seconds.append(time.process_time() - began)
        found = fitted.statistics["fit"]
        packed = recipe.recipe.model_copy(update={"atlas": atlas})
        (sheet,) = placed(packed, PageContent(fitted.animations, {}))
        channels = 1 if atlas.pixels == "heat" else 4
        memory = sum(page.width * page.height * channels for page in sheet.pages)
        nth = every_nth(search, budget * _MIB)
        told = "-" if nth is None else f"every {nth[0]}: {100 * nth[1]:.3f} %"
        is_kept = memory == found["memory"] <= budget * _MIB
        is_closest = nth is None or found["error"] <= nth[1] + 1e-6
        is_sound = is_sound and is_kept and is_closest
        print(
            f"| {path.stem} | {budget} MiB | {found['frames']} of {found['of']['frames']} | "
            f"{found['height']} of {found['of']['height']} px | {memory} | "
            f"{100 * found['error']:.3f} % | {told} |{'' if is_kept and is_closest else ' WORSE'}",
            flush=True,
        )
    told = ", ".join(f"{each:.1f}" for each in seconds[1:])
    print(f"{path.stem}: animated in {seconds[0]:.1f} CPU s, budgets {told}", flush=True)
    return is_sound


def main() -> int:
    """Print the table; return 1 if a row of it is not as promised."""
    named = sys.argv[1:] or _NAMES
    sound = list[bool]()
    with Workers(2) as workers, tempfile.TemporaryDirectory() as folder:
        for name in named:
            recipe = shipped("recipes") / f"{name}.yaml"
            if not recipe.exists():
                clip = Path(name).resolve()
                recipe = Path(folder) / f"{clip.parent.name if clip.is_dir() else clip.stem}.yaml"
                recipe.write_text(f"source: {{path: {clip}, fps: 24}}\n", encoding="utf-8")
            sound.append(rows(recipe, BuildContext.silent(workers)))
    return int(not all(sound))


if __name__ == "__main__":
    raise SystemExit(main())

"""What it costs that an animation stays on one page: density, pages and time.

Run it from the checkout: ``python -m tools.bench.animations [sets]``. Packs random sets of 2 to 12
animations of 4 to 60 frames onto pages of at most 512, 1024 and 2048 px, 2 px apart, once with
animations kept together and once as if all frames were one animation. Exits 1 if an animation is
split that a page can hold.
"""

import sys
import time
from collections.abc import Sequence
from itertools import islice
from typing import NamedTuple

import numpy as np

from fire_atlas.atlas.pack import Packing, pack
from fire_atlas.atlas.page_rules import PageRules, Size
from tests.support.animations import numbered, random_animations
from tools.bench.scene import argument

MAX_SIZES = (512, 1024, 2048)


class Result(NamedTuple):
    """A set packed with animations kept together, beside the same frames packed freely."""

    lost: float
    pages: int
    free_pages: int
    ratio: float
    wrongly_split: int
    split: int


def timed(sizes: list[Size], animations: list[range], rules: PageRules) -> tuple[Packing, float]:
    start = time.process_time()
    packing = pack(sizes, animations, rules)
    return packing, time.process_time() - start


def measure(animations: list[list[Size]], max_size: int) -> Result:
    rules, sizes = PageRules(max_size, padding=2), [size for each in animations for size in each]
    kept, seconds = timed(sizes, numbered(animations), rules)
    free, free_seconds = timed(sizes, [range(len(sizes))], rules)
    places = iter(kept.places)
    split = [
        each for each in animations if len({place.page for place in islice(places, len(each))}) > 1
    ]
    alone = [len(pack(each, [range(len(each))], rules).pages) for each in split]
    covered = sum(width * height for width, height in sizes)
    areas = [sum(width * height for width, height in each.pages) for each in (kept, free)]
    return Result(
        covered / areas[1] - covered / areas[0], len(kept.pages), len(free.pages),
        seconds / free_seconds, alone.count(1), len(split),
    )  # fmt: skip


def report(title: str, results: Sequence[Result]) -> None:
    lost, ratios = [each.lost for each in results], [each.ratio for each in results]
    extra = [each.pages - each.free_pages for each in results]
    print(
        f"{title:16} density lost: median {100 * np.median(lost):5.2f},"
        f" worst {100 * max(lost):5.2f} points; one page more in {extra.count(1)},"
        f" two in {extra.count(2)} of {len(results)};"
        f" split: {sum(each.split for each in results)}, of which a page could hold"
        f" {sum(each.wrongly_split for each in results)};"
        f" time: median {np.median(ratios):.2f}, worst {max(ratios):.2f} x",
        flush=True,
    )


def main() -> int:
    seeds = range(argument(1, 40))
    results = {
        size: [measure(random_animations(seed), size) for seed in seeds] for size in MAX_SIZES
    }
    for size, each in results.items():
        report(f"at most {size} px", each)
    of_all = [result for each in results.values() for result in each]
    report("all", of_all)
    report("several pages", [result for result in of_all if result.free_pages > 1])
    return 1 if any(result.wrongly_split for result in of_all) else 0


if __name__ == "__main__":
    sys.exit(main())

"""Rows of a campaign: tries of several kinds."""

import random
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

Work = Callable[[str, Sequence[int], int], list[list[str]]]
"""Does the tries with these numbers of one kind, with a seed; returns the faults of each."""


_FEWEST = 3
"""So many tries of a kind are drawn at least: to prepare for one takes longer than to do it."""


def chosen(tries: Mapping[str, int], count: int | None, seed: int) -> dict[str, list[int]]:
    """Return the numbers of all tries of each kind, or those of ``count`` drawn by chance: of all
    kinds by their share, or of as many kinds as there are tries for."""
    if count is None:
        return {kind: list(range(times)) for kind, times in tries.items()}
    chance, whole, drawn = random.Random(seed), sum(tries.values()), dict[str, list[int]]()
    for kind in chance.sample(list(tries), len(tries)):
        share = max(_FEWEST, round(count * tries[kind] / whole))
        share = min(share, tries[kind], count - sum(map(len, drawn.values())))
        if share > 0:
            drawn[kind] = sorted(chance.sample(range(tries[kind]), share))
    return drawn


def run_rows(work: Work, tries: Mapping[str, Sequence[int]], seed: int) -> list[str]:
    """Do all tries, print how many of each kind were done and went wrong; return the faults.

    Two kinds at a time, in processes of their own; a single kind in this one.
    """
    if len(tries) == 1:
        return [
            fault for kind in tries for fault in _told(kind, tries, work(kind, tries[kind], seed))
        ]
    with ProcessPoolExecutor(2, get_context("spawn")) as processes:
        running = {kind: processes.submit(work, kind, tries[kind], seed) for kind in tries}
        return [
            fault
            for kind, future in running.items()
            for fault in _told(kind, tries, future.result())
        ]


def _told(
    kind: str, tries: Mapping[str, Sequence[int]], results: Sequence[Sequence[str]]
) -> Iterator[str]:
    """Print how the tries of one kind went; yield their faults."""
    print(f"{len(results):7} {kind}: {sum(map(bool, results))} wrong", flush=True)
    for number, found in zip(tries[kind], results, strict=True):
        yield from (f"{kind} {number}: {fault}" for fault in found)

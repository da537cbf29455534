"""Unity's YAML as lines: enough to exchange a key's lines and leave every other byte alone.

A key's lines are that with the key and all that follow it and are indented deeper; items of a list
stand as deep as the key they belong to.
"""

import re
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple, TypeAlias

Path: TypeAlias = tuple[str, ...]


class Span(NamedTuple):
    """Lines ``start`` to ``stop`` (excluded)."""

    start: int
    stop: int


def find(lines: Sequence[str], path: Path) -> Span | None:
    """Return the lines of the key at ``path``, its own first."""
    span = Span(-1, len(lines))
    for key in path:
        inner = Span(span.start + 1, span.stop)
        matching = (found for name, found in _keys(lines, inner) if name == key)
        found = next(matching, None)
        if found is None:
            return None
        span = found
    return span


def replaced(old: Sequence[str], new: Sequence[str], path: Path) -> list[str]:
    """Return ``old`` with the lines that ``new`` has at ``path``; the same depth is assumed.

    Where ``old`` lacks the key, it comes last in its block; where it lacks the block, that comes.
    """
    source, target = find(new, path), find(old, path)
    if source is None:
        return list(old)
    if target is None:
        block = find(old, path[:-1])
        if block is None or block.stop - block.start == 1:
            return replaced(old, new, path[:-1])
        target = Span(block.stop, block.stop)
    return [*old[: target.start], *new[source.start : source.stop], *old[target.stop :]]


def _keys(lines: Sequence[str], inside: Span) -> Iterator[tuple[str, Span]]:
    """Yield the keys directly inside some lines, and the lines of each."""
    if inside.start >= inside.stop:
        return
    depth = _depth(lines[inside.start])
    key = re.compile(rf" {{{depth}}}([^\s:-][^:]*):(?: |$)")
    starts = [(i, found[1]) for i in range(*inside) if (found := key.match(lines[i]))]
    for (start, name), (stop, _) in pairwise([*starts, (inside.stop, "")]):
        yield name, Span(start, stop)


def _depth(line: str) -> int:
    return len(line) - len(line.lstrip(" "))

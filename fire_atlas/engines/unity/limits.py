"""What Unity cannot show or import, checked before any work is done."""

from collections.abc import Iterator, Sequence

from fire_atlas.formats.limits import upright_only
from fire_atlas.recipe.output import Atlas, Export, exports_called
from fire_atlas.recipe.problem import Problem


def unity_limits(atlas: Atlas, exports: Sequence[Export]) -> Iterator[Problem]:
    """Yield the exports for Unity that cannot show such pages or import their files."""
    yield from upright_only(atlas, exports, "unity")
    if atlas.format == "webp":
        for path, _ in exports_called(exports, "unity"):
            yield Problem(path, "unity cannot be had with atlas.format webp: Unity imports PNG")

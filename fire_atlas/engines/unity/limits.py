"""Limits of Unity on pages and exports, checked before a build starts."""

from collections.abc import Iterator, Sequence

from fire_atlas.formats.limits import upright_only
from fire_atlas.recipe.output import Atlas, Export, exports_called
from fire_atlas.recipe.problem import Problem


def unity_limits(atlas: Atlas, exports: Sequence[Export]) -> Iterator[Problem]:
    """Yield a problem for each Unity export whose pages Unity cannot show or import."""
    yield from upright_only(atlas, exports, "unity")
    if atlas.format == "webp":
        for path, _ in exports_called(exports, "unity"):
            yield Problem(path, "unity does not import atlas.format webp; set it to png")

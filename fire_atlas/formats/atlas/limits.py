"""What the clients of atlas descriptions cannot show."""

from collections.abc import Iterator, Sequence

from fire_atlas.formats.limits import upright_only
from fire_atlas.recipe.output import Atlas, Export
from fire_atlas.recipe.problem import Problem


def atlas_limits(atlas: Atlas, exports: Sequence[Export]) -> Iterator[Problem]:
    """Yield the exports whose clients cannot show such pages."""
    yield from upright_only(atlas, exports, "phaser", "aseprite")

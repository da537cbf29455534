"""What the clients of the shipped templates cannot show."""

from collections.abc import Iterator, Sequence

from fire_atlas.formats.limits import upright_only
from fire_atlas.recipe.output import Atlas, Export, exports_called
from fire_atlas.recipe.problem import Problem


def template_limits(atlas: Atlas, exports: Sequence[Export]) -> Iterator[Problem]:
    """Yield the exports whose clients cannot show such pages, or would blend them wrongly."""
    yield from upright_only(atlas, exports, "css", "tpsheet")
    if (atlas.alpha, atlas.blend_space) == ("straight", "srgb"):
        return
    for path, _ in exports_called(exports, "css"):
        yield Problem(
            path,
            f"css cannot be had with atlas.alpha {atlas.alpha} and blend_space "
            f"{atlas.blend_space}: browsers blend images with straight alpha in sRGB",
        )

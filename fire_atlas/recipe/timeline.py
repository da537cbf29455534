"""Recipe block ``timeline``: how the clip plays."""

from typing import Annotated, Literal

from fire_atlas.recipe.base import OFF, Settings


class Timeline(Settings):
    """How the clip plays."""

    loop: Annotated[Literal["auto", "none"], OFF] = "auto"
    """``auto``: a clip whose end meets its beginning plays round and round, and flakes fly on from
    its last frame into its first. ``none``: it plays once."""

"""Recipe block ``views``: the directions a 3D source is seen from."""

from pydantic import Field

from fire_atlas.recipe.base import Settings


class Views(Settings):
    """From where a 3D fire is seen: around the vertical axis, evenly."""

    count: int = Field(default=1, ge=1, le=64)
    """How many directions. View k looks from 360°·k/count, counter-clockwise seen from above; with
    more than one, frames are called ``name/view_0/0000``."""
    elevation: float = Field(default=0.0, ge=-90, le=90)
    """How far above the horizon the eye is, degrees."""

"""Options of the export ``godot``."""

from typing import Literal

from fire_atlas.recipe.base import Settings


class GodotOptions(Settings):
    """What Godot is to be given."""

    version: Literal[4, 3] = 4
    """Major version of the engine; each reads its own text alone."""

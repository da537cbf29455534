"""Recipe blocks of the asset half: atlas, exports, tracks."""

from typing import Annotated, Literal

from pydantic import Field

from fire_atlas.recipe.base import OFF, Settings

ExportName = Literal["json"]
TrackName = Literal["json", "csv"]


class Atlas(Settings):
    """The pages."""

    layout: Literal["packed", "grid"] = "packed"
    """``packed``: tight; ``grid``: uniform cells, row by row."""
    max_size: int = Field(default=4096, ge=16, le=16384)
    """Largest side of a page, px."""
    padding: int = Field(default=2, ge=0, le=64)
    """Empty px between neighbours."""
    trim: Annotated[Literal["frame", "animation", "none"], OFF] = "frame"
    """Cut empty borders: of each ``frame``, by one box for the ``animation``, or not at all."""
    alpha: Literal["straight", "premultiplied", "additive"] = "straight"
    """How coverage is stored. ``additive``: light on black with alpha 0."""
    blend_space: Literal["srgb", "linear"] = "srgb"
    """Where the client blends: ``srgb`` (Godot 2D, Pixi, Phaser, canvas, Unity gamma) or
    ``linear`` (Unity linear)."""

"""Recipe block ``source``: where the fire comes from."""

from typing import Annotated, Literal

from pydantic import Field

from fire_atlas.recipe.base import BY_KIND, FRAMES, OFF, SILK, Settings
from fire_atlas.recipe.silk import SilkSource


class Grid(Settings):
    """Cells of a sprite sheet. Cell sizes need not be whole pixels."""

    columns: int = Field(ge=1, le=1024)
    """Cells in a row."""
    rows: int = Field(ge=1, le=1024)
    """Rows of cells."""


class FramesSource(Settings):
    """Frames somebody drew, filmed or rendered."""

    kind: Literal["frames"] = "frames"
    """Footage or sprites that exist already."""
    path: str = Field(min_length=1, pattern=r"^[^\x00]+$")
    """A folder of images, a glob (``fire_*.png``), one image, a sprite sheet (with ``grid``), a
    GIF, APNG or animated WebP, or a video. Relative to the recipe file."""
    grid: Grid | None = None
    """Cut ``path`` (one image) into cells, left to right, top to bottom."""
    fps: float | None = Field(default=None, gt=0, le=240)
    """Frames per second. Default: what the file says; 24 for folders and sheets. Files with
    delays of their own are resampled to it."""
    start: int = Field(default=0, ge=0)
    """First frame to use, counted from 0."""
    count: int | None = Field(default=None, ge=1)
    """How many frames to use. Default: all that follow ``start``."""
    height: int | None = Field(default=None, ge=1, le=16384)
    """Resize frames to this height, px; the width follows. Default: as they are."""
    sampling: Literal["smooth", "nearest"] = "smooth"
    """How ``height`` resizes: ``smooth``, or ``nearest`` for pixel art."""
    matte: Annotated[Literal["auto", "alpha", "luminance", "none"], OFF] = "auto"
    """Where coverage comes from: the frames' ``alpha``; ``luminance`` (fire on black: light
    becomes coverage, colour is un-multiplied); ``none`` (an opaque scene). ``auto`` decides and
    says why."""


Source = Annotated[
    Annotated[FramesSource, FRAMES] | Annotated[SilkSource, SILK],
    BY_KIND,
]
"""Where the fire comes from, by ``kind``."""

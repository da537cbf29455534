"""Recipe block ``source``: where the fire comes from."""

from typing import Annotated, Literal

from pydantic import Field

from fire_atlas.recipe.base import BY_KIND, FRAMES, OFF, PROFILE, SILK, Settings
from fire_atlas.recipe.silk import SilkSource


class Grid(Settings):
    """Cells of a sprite sheet. Cell sizes need not be whole pixels."""

    columns: int = Field(ge=1, le=1024)
    """Cells in a row."""
    rows: int = Field(ge=1, le=1024)
    """Rows of cells."""


class ClipInput(Settings):
    """A clip that exists as files, and which of its frames to use."""

    path: str = Field(min_length=1, pattern=r"^[^\x00]+$")
    """A folder of images, a glob (``fire_*.png``), one image, a sprite sheet (with ``grid``), a
    GIF, APNG or animated WebP, or a video. Relative to the recipe file."""
    grid: Grid | None = None
    """Cut ``path`` (one image) into cells, left to right, top to bottom."""
    fps: float | None = Field(default=None, ge=0.01, le=240)
    """Frames per second. Default: what the file says; 24 for folders and sheets. Files with
    delays of their own are resampled to it."""
    start: int = Field(default=0, ge=0)
    """First frame to use, counted from 0."""
    count: int | None = Field(default=None, ge=1)
    """How many frames to use. Default: all that follow ``start``."""
    matte: Annotated[Literal["auto", "alpha", "luminance", "none"], OFF] = "auto"
    """Where coverage comes from: the frames' ``alpha``; ``luminance`` (fire on black: light
    becomes coverage, colour is un-multiplied); ``none`` (an opaque scene). ``auto`` decides and
    says why."""


class FramesSource(ClipInput):
    """Frames somebody drew, filmed or rendered."""

    kind: Literal["frames"] = "frames"
    """Frames or sprites that exist already."""
    height: int | None = Field(default=None, ge=1, le=16384)
    """Resize frames to this height, px; the width follows. Default: as they are."""
    sampling: Literal["smooth", "nearest"] = "smooth"
    """How ``height`` resizes: ``smooth``, or ``nearest`` for pixel art."""


class ProfileSource(ClipInput):
    """New fire, generated from what was learnt of a short clip."""

    kind: Literal["profile"] = "profile"
    """Fire learnt from a clip (or a profile file), of any length, in any wind, from any side."""
    path: str = Field(min_length=1, pattern=r"^[^\x00]+$")
    """The clip to learn from, 8-60 frames of one fire, in any form footage can have; or a
    profile that ``fire-atlas learn`` wrote (``candle.profile.json``). Relative to the recipe
    file."""
    side_path: str | None = Field(default=None, min_length=1, pattern=r"^[^\x00]+$")
    """A clip of the same fire from the right, at a right angle to ``path``; ``grid``, ``fps``,
    ``start``, ``count`` and ``matte`` are of both. Default: all sides look like ``path``."""
    threshold: float | None = Field(default=None, gt=0, lt=255)
    """Brightness, 0-255, above which a pixel of the clip is flame. Default: chosen from the
    clip."""
    cells: int = Field(default=5, ge=2, le=32)
    """Cells in a row and in a column of the colour table that is learnt."""
    slices: int = Field(default=12, ge=1, le=64)
    """Vertical slices of fire round the axis."""
    particles: int = Field(default=100, ge=4, le=2000)
    """Particles alive in each slice."""
    height: int | None = Field(default=None, ge=16, le=4096)
    """Height of the frames, px. Default: the scale of the clip."""


Source = Annotated[
    Annotated[FramesSource, FRAMES]
    | Annotated[ProfileSource, PROFILE]
    | Annotated[SilkSource, SILK],
    BY_KIND,
]
"""Where the fire comes from, by ``kind``."""


class Views(Settings):
    """From where a 3D fire is seen: around the vertical axis, evenly."""

    count: int = Field(default=1, ge=1, le=64)
    """How many directions. View k looks from 360°·k/count, counter-clockwise seen from above; with
    more than one, frames are called ``name/view_0/0000``."""
    elevation: float = Field(default=0.0, ge=-90, le=90)
    """How far above the horizon the eye is, degrees."""

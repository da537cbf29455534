"""Make the moving pictures at the top of the README and the wall of docs/silk.md:
``python -m tools.first_pictures [FOLDER]``.

Each shows ready recipes of 24 frames a second, built into FOLDER (default: a temporary one), over a
dark ground.
"""

import os
import sys
import tempfile
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from fire_atlas.cli import main
from fire_atlas.core.shipped import shipped
from fire_atlas.formats.atlas.texture_packer import read_atlas
from fire_atlas.preview.blend import blend
from fire_atlas.preview.cut_frames import cut_frames

DOCS = Path(__file__).parents[1] / "docs"

BANNER = ("bonfire", "silk_campfire", "fire_ring", "blue_flame", "silk_torch")
SQUARES = (
    "flame_jet", "burning_crate", "campfire_above", "ground_fire", "fireball", "endless_candle",
)  # fmt: skip
BEHIND = {"burning_crate": "crate.png"}
"""Of a fire that is drawn over a picture: that sample."""
RAMPS = ("soul", "poison", "copper", "gas")
ONCE = ("explosion", "fireball", "muzzle_flash")
"""What plays once, for as long as its recipe says."""
LOOPS = ("campfire", "silk_torch", "silk_campfire", "fluid_windy_torch", "embers")
"""What has a picture of its own, as what plays once has."""
TILES = 3
"""How many frames of `fire_wall` stand side by side."""

_FRAMES, _FPS = 24, 24
_GROUND = (16, 16, 20)
_BANNER_HEIGHT, _SQUARE, _RAMP_HEIGHT, _WALL_HEIGHT = 300, 208, 260, 128
_GAP = 6

Film = list[NDArray[np.uint8]]
"""Frames (height, width, 3)."""


def draw() -> None:
    """Write docs/banner.webp, squares.webp, ramps.webp, fire_wall.webp and those of one fire."""
    fires = [_fitted(film, _BANNER_HEIGHT) for name in BANNER for film in _films(name).values()]
    _save("banner", fires)
    squares = [_square(film) for name in SQUARES for film in _films(name).values()]
    _save("squares", squares)
    films = _films("soul_fire")
    _save("ramps", [_fitted(films[name], _RAMP_HEIGHT) for name in RAMPS])
    (wall,) = _films("fire_wall").values()
    _save("fire_wall", [_fitted(wall, _WALL_HEIGHT)] * TILES, gap=0)
    for name in (*ONCE, *LOOPS):
        (film,) = _films(name).values()
        _save(name, [_fitted(film, _SQUARE)], fps=_FPS // 2 if name in ONCE else _FPS)


@cache
def _films(name: str) -> dict[str, Film]:
    """Build a ready recipe and return its animations over the ground, each of ``_FRAMES``."""
    assert main(["init", name, "-q"]) == 0
    settings = ["atlas.trim=none", "atlas.dedupe=false", "exports=[json]", "tracks=[]"]
    if name not in ONCE:
        settings.append(f"timeline.frames={_FRAMES}")
    chosen = [word for setting in settings for word in ("--set", setting)]
    assert main(["build", f"{name}.yaml", "-q", *chosen]) == 0
    atlas = read_atlas(Path("build") / f"{name}.json")
    sheet, frames = atlas.sheet, list(cut_frames(atlas))
    behind = _behind(BEHIND[name], frames[0]) if name in BEHIND else _GROUND
    shown = {
        frame.name: blend(pixels, behind, sheet.alpha, sheet.blend_space)
        for frame, pixels in zip(atlas.frames, frames, strict=True)
    }
    return {
        animation.name.rpartition("/")[2]: [
            shown[frame] for frame in animation.frames[:: max(1, len(animation.frames) // _FRAMES)]
        ]
        for animation in sheet.animations
    }


def _behind(sample: str, frame: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return a sample as large as a ``frame``, over the ground."""
    size = frame.shape[1], frame.shape[0]
    with Image.open(shipped("samples") / sample) as image:
        picture = np.asarray(image.convert("RGBA").resize(size, Image.Resampling.LANCZOS))
    return blend(picture, _GROUND, "straight", "srgb")


def _fitted(film: Film, height: int) -> Film:
    """Return a film ``height`` px high."""
    width = round(film[0].shape[1] * height / film[0].shape[0])
    return [
        np.asarray(Image.fromarray(frame).resize((width, height), Image.Resampling.LANCZOS))
        for frame in film
    ]


def _square(film: Film) -> Film:
    """Return a film in the middle of a square."""
    found = []
    for frame in film:
        image = Image.fromarray(frame)
        image.thumbnail((_SQUARE, _SQUARE), Image.Resampling.LANCZOS)
        square = Image.new("RGB", (_SQUARE, _SQUARE), _GROUND)
        square.paste(image, ((_SQUARE - image.width) // 2, (_SQUARE - image.height) // 2))
        found.append(np.asarray(square))
    return found


def _save(name: str, films: Sequence[Film], gap: int = _GAP, fps: int = _FPS) -> None:
    """Write films side by side, ``gap`` px apart, as a WebP that loops."""
    frames = []
    for i in range(min(_FRAMES, max(map(len, films)))):
        parts = [film[i % len(film)] for film in films]
        ground = np.full((parts[0].shape[0], gap, 3), _GROUND, np.uint8)
        row = [piece for part in parts for piece in (part, ground)][:-1]
        frames.append(Image.fromarray(np.hstack(row)))
    frames[0].save(
        DOCS / f"{name}.webp", save_all=True, append_images=frames[1:],
        duration=[round(1000 / fps)] * len(frames), loop=0, quality=60, method=6,
    )  # fmt: skip
    print(name)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as temporary:
        os.chdir(sys.argv[1] if len(sys.argv) > 1 else temporary)
        draw()

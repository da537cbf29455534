"""Make docs/phases.png: ``python -m tools.phases_picture``: fires of each kind, lit and put out."""

import os
import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from fire_atlas.cli import main
from fire_atlas.formats.atlas.texture_packer import read_atlas
from fire_atlas.preview.blend import blend
from fire_atlas.preview.cut_frames import cut_frames

TARGET = Path(__file__).parents[1] / "docs" / "phases.png"

FIRES = ("campfire", "candle", "fluid_campfire", "silk_campfire", "cartoon", "pixel_art")
"""Ready recipes, a row each."""

SHOWN = {
    "ignite": (0.05, 0.3, 0.5, 0.7),
    "burn": (0.0,),
    "extinguish": (0.3, 0.5, 0.62, 0.75, 0.95),
}
"""Which moments of each animation are shown, from 0 at its beginning to 1."""

_CELL, _HEIGHT = 120, 128
_GROUND = (16, 16, 20)


def draw() -> None:
    """Build the recipes with phases and write the picture."""
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        rows = [np.hstack(_row(name)) for name in FIRES]
    Image.fromarray(np.vstack(rows)).quantize(128).save(TARGET, optimize=True)


def _row(name: str) -> list[NDArray[np.uint8]]:
    """Return what is shown of a fire, a cell (height, width, 3) for each moment."""
    assert main(["init", name, "-q"]) == 0
    settings = ["phases={ignite: 1, extinguish: 1.6}", "atlas.trim=none", "atlas.dedupe=false"]
    chosen = [word for setting in settings for word in ("--set", setting)]
    assert main(["build", f"{name}.yaml", "-q", *chosen]) == 0
    atlas = read_atlas(Path("build") / f"{name}.json")
    cuts = dict(zip((frame.name for frame in atlas.frames), cut_frames(atlas), strict=True))
    cells = []
    for animation in atlas.sheet.animations:
        for moment in SHOWN.get(animation.name, ()):
            frame = cuts[animation.frames[round(moment * (len(animation.frames) - 1))]]
            shown = blend(frame, _GROUND, atlas.sheet.alpha, atlas.sheet.blend_space)
            cells.append((list(SHOWN).index(animation.name), moment, _cell(shown)))
    return [cell for *_, cell in sorted(cells, key=lambda each: each[:2])]


def _cell(shown: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return a frame, (h, w, 3), in the middle of a cell, on its ground."""
    height, width = shown.shape[:2]
    scale = min(_HEIGHT / height, _CELL / width)
    size = round(width * scale), round(height * scale)
    sharp = height < _HEIGHT
    small = Image.fromarray(shown).resize(
        size, Image.Resampling.NEAREST if sharp else Image.Resampling.BOX
    )
    cell = Image.new("RGB", (_CELL, _HEIGHT), _GROUND)
    cell.paste(small, ((_CELL - size[0]) // 2, _HEIGHT - size[1]))
    return np.asarray(cell)


if __name__ == "__main__":
    draw()

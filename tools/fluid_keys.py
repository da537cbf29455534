"""Make docs/fluid-keys.png: ``python -m tools.fluid_keys`` draws what keys of gas do.

A row for each key, with five of its values, at one moment, over the ground of the other pictures.
"""

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from fire_atlas.cli import main
from fire_atlas.formats.atlas.texture_packer import read_atlas
from fire_atlas.preview.blend import blend
from fire_atlas.preview.cut_frames import cut_frames

PICTURE = Path(__file__).parents[1] / "docs" / "fluid-keys.png"

ROWS: tuple[tuple[str, tuple[Any, ...], dict[str, Any]], ...] = (
    ("source.fuel_rate", (0.4, 0.7, 1.0, 1.4, 1.8), {}),
    ("source.radius", (0.14, 0.17, 0.2, 0.24, 0.28), {}),
    ("source.heat", (0.6, 0.8, 1.0, 1.3, 1.7), {}),
    ("source.lift", (0.3, 0.6, 1.0, 1.7, 3.0), {}),
    ("source.turbulence", (0.0, 0.5, 1.0, 1.8, 3.0), {}),
    ("source.smoke", (0.0, 0.2, 0.5, 1.0, 2.0), {}),
    ("source.detail", (0.0, 0.25, 0.5, 0.75, 1.0), {}),
    ("wind.level", (0, 1, 2, 3, 5), {}),
    ("source.blast", (0.1, 0.3, 0.55, 0.8, 1.1), {"fire": "explosion"}),
    ("source.speed", (2.0, 4.0, 6.5, 9.0, 12.0), {"fire": "flamethrower"}),
)
"""Keys, five values of each, and the ready fire that shows them, the campfire if none is named."""

_SIDE, _LABEL, _GAP = 132, 16, 2
_MOMENT, _FRAMES = 14, 24
_GROUND = (16, 16, 20)


def draw() -> None:
    """Write the picture."""
    row_height, width = _SIDE + _LABEL + _GAP, 5 * (_SIDE + _GAP)
    picture = Image.new("RGB", (width, len(ROWS) * row_height), _GROUND)
    pen, font = ImageDraw.Draw(picture), ImageFont.load_default(11)
    with tempfile.TemporaryDirectory() as folder:
        for row, (key, values, source) in enumerate(ROWS):
            for column, value in enumerate(values):
                at = column * (_SIDE + _GAP), row * row_height
                label = f"{key.removeprefix('source.')}: {value:g}"
                pen.text((at[0] + 4, at[1] + 1), label, (190, 190, 196), font)
                shown = Image.fromarray(_frame(Path(folder), key, value, source))
                picture.paste(shown, (at[0], at[1] + _LABEL))
    picture.save(PICTURE, optimize=True)


def _frame(folder: Path, key: str, value: Any, source: dict[str, Any]) -> NDArray[np.uint8]:
    """Return a frame of gas with ``key`` at ``value``, over the ground."""
    recipe = {
        "source": {
            "kind": "fluid", "resolution": 40, "width": _SIDE, "height": _SIDE, **source,
        },
        "timeline": {"frames": _FRAMES},
        "flakes": "none",
        "motion_blur": "none",
        "atlas": {"alpha": "premultiplied", "trim": "none", "dedupe": False},
    }  # fmt: skip
    path = folder / "gas.yaml"
    path.write_text(yaml.safe_dump(recipe), encoding="utf-8")
    line = ["build", str(path), "-o", str(folder), "-q", "--force", "--set", f"{key}={value}"]
    assert main(line) == 0
    atlas = read_atlas(folder / "gas.json")
    pixels = list(cut_frames(atlas))[_MOMENT]
    return blend(pixels, _GROUND, atlas.sheet.alpha, atlas.sheet.blend_space)


if __name__ == "__main__":
    draw()

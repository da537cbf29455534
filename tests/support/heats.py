"""Fires in heat, and the colours that a client is to show of them: an own look-up in the ramp."""

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from fire_atlas.cli import main
from fire_atlas.core.shipped import shipped
from fire_atlas.formats.atlas.texture_packer import read_atlas

RAMPS = ["learnt", "gas", "copper", "poison", "soul", "frost"]
Values = NDArray[np.float64]


def built(folder: Path, name: str = "fire", **keys: Any) -> None:
    """Build a campfire in heat, in six ramps."""
    folder.mkdir(exist_ok=True)
    atlas = {"pixels": "heat", "ramp": RAMPS, **keys.pop("atlas", {})}
    recipe = folder / f"{name}.yaml"
    recipe.write_text(json.dumps({
        "source": {"path": str(shipped("samples") / "campfire"), "height": 96, "fps": 12},
        "flakes": "none", "exports": ["json"], "atlas": atlas, **keys,
    }))  # fmt: skip
    assert main(["build", str(recipe), "-o", str(folder)]) == 0


class HeatFire:
    """What a build wrote: the heat of whole frames (h, w), 0..1, and the ramps (rows, 256, 4)."""

    def __init__(self, folder: Path, name: str = "fire") -> None:
        """Read the files of a build."""
        self.frames = read_atlas(folder / f"{name}.json").frames
        with Image.open(folder / f"{name}.png") as image:
            self._page = np.asarray(image.convert("RGBA")) / 255
        with Image.open(folder / f"{name}.ramp.png") as image:
            self.ramps: Values = np.asarray(image.convert("RGBA")) / 255

    def heat(self, i: int) -> Values:
        """Return the heat of a whole frame."""
        each = self.frames[i]
        heat = np.zeros((each.frame_height, each.frame_width))
        page = self._page[each.y : each.y + each.height, each.x : each.x + each.width]
        rows = slice(each.trim_y, each.trim_y + each.height)
        heat[rows, each.trim_x : each.trim_x + each.width] = page[
            ..., "rgba".index(each.channel or "r")
        ]
        return heat

    def light(self, heat: Values, row: int = 0) -> Values:
        """Return the premultiplied colours (h, w, 4) of heat, linear between entries of a ramp."""
        at = heat * 255
        return np.dstack([np.interp(at, range(256), entry) for entry in self.ramps[row].T])

    def shown(self, heat: Values, row: int = 0, ground: int = 0) -> Values:
        """Return what is seen of heat before a grey ground, (h, w, 3), of 255."""
        light = self.light(heat, row)
        return (255 * light[..., :3] + (1 - light[..., 3:]) * ground).clip(0, 255)

"""Make docs/fluid-keys.webp: ``python -m tools.fluid_keys``.

A row for each of an artist's keys of simulated gas: five values, and one frame of the fire with
each.
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from fire_atlas.core.pixels import as_plane, encode_bytes
from fire_atlas.core.workers import Workers
from fire_atlas.generators.fluid.process import record_apart
from fire_atlas.generators.fluid.renderer import FluidView, fluid_camera
from fire_atlas.generators.fluid.scene import build_scene
from fire_atlas.generators.fluid.volume import Volume
from fire_atlas.generators.settings import GenerationSettings
from fire_atlas.recipe.fluid import FluidSource
from fire_atlas.recipe.source import Views
from fire_atlas.recipe.wind import Wind

PICTURE = Path(__file__).parents[1] / "docs" / "fluid-keys.webp"

_FPS, _FRAMES = 24, 24
_WIDTH, _HEIGHT = 132, 156
_GAP, _LABEL = 4, 17
_SCALE = 2
"""Frames are drawn so many times as large, and reduced."""
_GROUND, _TEXT = (40, 44, 52), (214, 214, 208)


@dataclass(frozen=True)
class Row:
    """Five values of a key.

    Attributes:
        key: The key: of ``source``, or of ``wind``.
        values: Its values.
        fire: The ready fire.
        needs: Further keys of ``source``.
        frame: The frame that is shown.
    """

    key: str
    values: tuple[Any, ...]
    fire: str = "campfire"
    needs: dict[str, Any] = field(default_factory=dict)
    frame: int = 9


ROWS = (
    Row("radius", (0.12, 0.16, 0.2, 0.26, 0.32)),
    Row("fuel_rate", (0.25, 0.5, 1, 1.4, 1.8)),
    Row("heat", (0.5, 0.75, 1, 1.4, 2)),
    Row("lift", (0.25, 0.5, 1, 1.5, 2.5)),
    Row("turbulence", (0, 0.5, 1, 2, 3)),
    Row("detail", (0, 0.25, 0.5, 0.75, 1)),
    Row("wind.level", (0, 1, 2, 3.5, 5), "torch"),
    Row("smoke", (0, 0.2, 0.5, 1, 2)),
    Row(
        "smoke_colour", ("#2b2826", "#8c8884", "#d8d4ce", "#b08a5a", "#5f7fa8"), "smoke",
        {"radius": 0.11},
    ),
    Row("speed", (0.3, 0.8, 1.6, 3, 5), "steam"),
    Row("direction", ("left", [-1, 0, 1], "up", [1, 0, 1], "right"), "steam", {"speed": 3}),
    Row("blast", (0.1, 0.3, 0.55, 0.75, 1.1), "explosion", {"radius": 0.1, "heat": 0.8}, 5),
    Row("burning", ([0, 0.1], [0, 0.25], [0, 0.4], [0, 0.6], [0, 0.9]), frame=13),
)  # fmt: skip


def draw() -> None:
    """Write the picture."""
    font = ImageFont.load_default(12)
    step = _LABEL + _HEIGHT + _GAP
    size = 5 * (_WIDTH + _GAP) - _GAP, len(ROWS) * step
    sheet = Image.new("RGB", size, (16, 16, 20))
    pen = ImageDraw.Draw(sheet)
    with Workers(None) as workers:
        for number, row in enumerate(ROWS):
            for place, value in enumerate(row.values):
                left, top = place * (_WIDTH + _GAP), number * step
                shown = str(value).replace("'", "")
                said = f"{row.key}: {shown}" if place == 0 else shown
                pen.text((left + 2, top + 1), said, _TEXT, font)
                picture = Image.fromarray(_frame(row, value, workers))
                picture = picture.resize((_WIDTH, _HEIGHT), Image.Resampling.LANCZOS)
                sheet.paste(picture, (left, top + _LABEL))
            print(row.key, flush=True)
    sheet.save(PICTURE, "webp", quality=72, method=6)


def _frame(row: Row, value: Any, workers: Workers) -> NDArray[np.uint8]:
    """Simulate a fire with a key at a value, and return a frame of it over the ground."""
    block, _, name = row.key.rpartition(".")
    source = FluidSource.model_validate(
        {
            "kind": "fluid", "fire": row.fire, "resolution": 44,
            "width": _WIDTH * _SCALE, "height": _HEIGHT * _SCALE, **row.needs,
            **({} if block else {name: value}),
        }
    )  # fmt: skip
    wind = Wind.model_validate({name: value} if block else {})
    settings = GenerationSettings(2, wind, _FRAMES, _FPS, True, Views())
    scene = build_scene(source, settings)
    volumes: list[Volume] = []
    record_apart(scene, workers.jobs, volumes.append, lambda: None)
    view = FluidView(scene, volumes, fluid_camera(source, 0, 0), "srgb")
    frame = view.frame(row.frame)
    colour = as_plane(frame[..., :3] / np.maximum(frame[..., 3:], np.float32(1e-6)))
    ground = np.array(_GROUND, np.float32)
    return np.asarray(np.rint(ground + (encode_bytes(colour) - ground) * frame[..., 3:]), np.uint8)


if __name__ == "__main__":
    draw()

"""The real Godot 4.6 decodes a page of 16 bits a channel to the 8 bits that it works with."""

import base64
import json
from pathlib import Path

import numpy as np
from PIL import Image

from fire_atlas.cli import main
from fire_atlas.core.shipped import shipped
from tests.support.godot4 import Godot4

DECODE = """\
extends Node


func answer(job: Dictionary) -> Array:
	var image := Image.new()
	image.load_png_from_buffer(Marshalls.base64_to_raw(job["page"]))
	return [image.get_width(), image.get_format(), Marshalls.raw_to_base64(image.get_data())]
"""
RGBA8 = 5


def test_it_shows_the_page_of_8_bits(godot4: Godot4, tmp_path: Path) -> None:
    recipe, game = tmp_path / "fire.yaml", tmp_path / "game"
    source = {"path": str(shipped("samples") / "campfire"), "count": 3, "height": 60}
    recipe.write_text(json.dumps({"source": source, "tracks": [], "exports": []}))
    assert main(["build", "-q", str(recipe)]) == 0
    assert main(["build", "-q", str(recipe), "-o", str(game), "--set", "atlas.bits=16"]) == 0
    (game / "decode.gd").write_text(DECODE)
    page = base64.b64encode((game / "fire.png").read_bytes()).decode()
    (game / "fire.png").unlink()  # nothing imports it
    job = {"do": "ask", "script": "res://decode.gd", "page": page}
    ((width, kind, data),) = godot4.run(game, [job])
    assert kind == RGBA8
    shown = np.frombuffer(base64.b64decode(data), np.uint8).reshape(-1, width, 4).astype(int)
    with Image.open(tmp_path / "build" / "fire.png") as image:
        wanted = np.asarray(image.convert("RGBA")).astype(int)
    assert np.abs(shown - wanted).max() <= 1

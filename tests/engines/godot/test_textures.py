"""The player, in Godot 4, draws flakes with the cells that the tracks name."""

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fire_atlas.cli import main
from fire_atlas.core.pixels import Bytes, decode_bytes, encode_bytes
from fire_atlas.core.shipped import shipped
from fire_atlas.effect.composition.composite import exposed_together
from fire_atlas.effect.flakes.texture import draw_textured
from fire_atlas.formats.atlas.texture_packer import read_atlas
from fire_atlas.formats.tracks.tracks_json import read_tracks
from fire_atlas.preview.blend import blend
from fire_atlas.preview.cut_frames import cut_frames, texture_of
from tests.support.godot4 import Godot4, picture
from tests.support.textures import saved, sheet

FIRST, LAST = 2, 9
"""A frame with few flakes, and one with many."""

CASES: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "painted": ({"tint": "none"}, {"alpha": "straight"}),
    "mask": ({"tint": "heat"}, {"alpha": "premultiplied"}),
    "added": ({"tint": "none"}, {"alpha": "additive"}),
}
"""Settings of flakes and of the atlas."""


def built(folder: Path, name: str, flakes: dict[str, Any], atlas: dict[str, Any]) -> None:
    texture = {"path": "drops.png", "grid": {"columns": 3, "rows": 1}}
    look = {"texture": texture, "bake": False, "rate": 60, "size": [0.05, 0.1]}
    recipe = folder / f"{name}.yaml"
    recipe.write_text(json.dumps({
        "source": {"path": str(shipped("samples") / "campfire"), "count": 10, "height": 160},
        "flakes": {**look, **flakes}, "timeline": {"loop": "none"}, "atlas": atlas,
        "exports": ["json", "godot"],
    }))  # fmt: skip
    assert main(["build", "-q", str(recipe), "-o", str(folder)]) == 0


def wanted(folder: Path, name: str, frame: int) -> tuple[Bytes, NDArray[np.bool_]]:
    """What our own frame shows of flame and flakes, and where there is one flake alone."""
    atlas, tracks = read_atlas(folder / f"{name}.json"), read_tracks(folder / f"{name}.flakes.json")
    assert tracks is not None and tracks.texture is not None
    texture, cells = texture_of(atlas, tracks), tracks.texture.cells[frame]
    assert texture is not None
    page = blend(list(cut_frames(atlas))[frame], (0, 0, 0), atlas.sheet.alpha, "srgb")
    rows, size = tracks.frames[frame], page.shape[:2]
    light = draw_textured(rows, cells, texture, *size).rgb()
    assert light.max() > 0.2
    each = [draw_textured(rows[[i]], cells[[i]], texture, *size).rgb() for i in range(len(rows))]
    count = sum((one.max(axis=2) > 0).astype(int) for one in each)
    alone = (page.max(axis=2) == 0) & (count == 1)
    return encode_bytes(exposed_together(decode_bytes(page), light)), alone


def job(folder: Path, name: str, frame: int, *, film: bool) -> dict[str, Any]:
    """Draw a frame over black, by the scene that adds up all light as film does, or the plain."""
    region = read_atlas(folder / f"{name}.json").frames[frame]
    x, y = region.anchor[0] * region.frame_width, region.anchor[1] * region.frame_height
    scene = {"scene": f"res://{name}.tscn", "flakes": frame}
    if film:
        scene = {"scene": f"res://{name}_film.tscn", "sprite": "Film/Fire"}
    shot = {"do": "draw", "animation": name, "frame": frame, "background": "000000", "at": [x, y]}
    return {**shot, **scene}


def test_in_godot_4_flakes_show_their_cells_as_in_our_frames(
    godot4: Godot4, tmp_path: Path
) -> None:
    saved(sheet(), tmp_path / "drops.png")
    for name, settings in CASES.items():
        built(tmp_path, name, *settings)
    jobs = [job(tmp_path, name, LAST, film=True) for name in CASES]
    jobs += [job(tmp_path, name, FIRST, film=False) for name in CASES]
    shots = [picture(answer).astype(int) for answer in godot4.run(tmp_path, jobs, (200, 200))]
    for name, summed, plain in zip(CASES, shots[:3], shots[3:], strict=True):
        own, _ = wanted(tmp_path, name, LAST)
        difference = np.abs(summed[: own.shape[0], : own.shape[1]] - own)
        # A mask is lit up to 350 times, and with it what the engine's filter rounds.
        largest = 6 if CASES[name][0]["tint"] == "none" else 32
        assert difference.max() <= largest and np.quantile(difference, 0.999) <= 4
        own, alone = wanted(tmp_path, name, FIRST)
        assert (own[alone] > 100).any()
        assert np.abs(plain[: own.shape[0], : own.shape[1]] - own)[alone].max() <= 6

"""The preview page, in a real browser, draws flakes with the cells that the tracks name."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fire_atlas.core.pixels import decode_bytes, encode_bytes
from fire_atlas.effect.composition.composite import exposed_together
from fire_atlas.effect.flakes.texture import draw_textured
from fire_atlas.formats.atlas.texture_packer import read_atlas
from fire_atlas.formats.tracks.tracks_json import read_tracks
from fire_atlas.preview.blend import blend
from fire_atlas.preview.cut_frames import cut_frames, texture_of
from tests.preview.browser import Browser, assert_quiet, built, picture
from tests.support.textures import saved, sheet

GRID = {"columns": 3, "rows": 1}


@pytest.mark.parametrize(
    ("tint", "play", "atlas"),
    [
        ("heat", "life", {"alpha": "additive", "rotate": True}),
        ("none", "cell", {"alpha": "straight", "blend_space": "linear", "scales": [1, 0.5]}),
    ],
)
def test_flakes_are_drawn_with_their_cells_as_in_our_frames(
    tint: str, play: str, atlas: dict[str, Any], browser: Browser, tmp_path: Path
) -> None:
    texture = {"path": saved(sheet(), tmp_path / "drops.png"), "grid": GRID, "play": play}
    look = {"texture": texture, "tint": tint, "size": [0.05, 0.2], "rate": 300}
    look |= {"life": [0.06, 0.16]}
    page = built(tmp_path, flakes={"bake": False, "rounds": 1, **look}, atlas=atlas, count=4)
    read = read_atlas(page.with_name("fire.json"))
    tracks = read_tracks(page.with_name("fire.flakes.json"))
    assert tracks is not None and tracks.texture is not None
    cells, own = tracks.texture.cells[-1], texture_of(read, tracks)
    assert own is not None and len(np.unique(cells)) == 3
    seen = browser.visit(
        page, ("press", "End"), ("press", "f"), ("press", "f"), ("pixels", "#picture")
    )
    assert_quiet(seen, page)
    drawn = picture(seen.results[0])[..., :3].astype(int)
    height, width = drawn.shape[:2]
    frame = list(cut_frames(read))[-1]
    flame = decode_bytes(blend(frame, (16, 16, 20), read.sheet.alpha, read.sheet.blend_space))
    light = draw_textured(tracks.frames[-1], cells, own, height, width).rgb()
    wanted = encode_bytes(exposed_together(flame, light)).astype(int)
    assert np.abs(drawn - wanted).max() <= 3
    assert (np.abs(wanted - encode_bytes(flame)).max(axis=2) > 20).sum() > 200

"""The player that the page on web clients points to draws embers as our frames do."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np

from fire_atlas.effect.flakes.drawing import draw_flakes
from fire_atlas.effect.flakes.tracks import COLUMNS
from fire_atlas.formats.tracks.tracks_json import write_tracks_json
from tests.preview.browser import Browser, assert_quiet, picture
from tests.support.embers import SIDE, SMALL, overlapping, shown, tracks_of

PLAYER = Path(__file__).parents[2] / "docs" / "engines" / "webgl_flakes.js"

PAGE = """<!DOCTYPE html><canvas id="picture" width="{side}" height="{side}"></canvas><script>
{player}
const gl = document.getElementById("picture").getContext("webgl2", {{
  premultipliedAlpha: true, preserveDrawingBuffer: true, antialias: false,
}});
const flakes = new FlakePlayer(gl, {tracks});
window.show = (time, round) => flakes.draw(time, round);
window.show(0, 0);
document.body.dataset.ready = "";
</script>"""


def test_all_rounds_of_embers_are_drawn_as_in_our_frames(browser: Browser, tmp_path: Path) -> None:
    kinds = [overlapping(), *(row[None] for row in SMALL.values())]
    empty = np.zeros((0, len(COLUMNS)))
    frames = [kinds[0], empty, kinds[1], empty, kinds[2], kinds[3]]
    tracks = replace(tracks_of(np.concatenate(kinds)), frames=tuple(frames), rounds=3)
    page = tmp_path / "player.html"
    player = PLAYER.read_text(encoding="utf-8").replace("export class", "class")
    data = json.dumps(json.loads(write_tracks_json("fire", tracks).data))
    page.write_text(PAGE.format(side=SIDE, player=player, tracks=data), encoding="utf-8")
    steps = []
    for round_ in range(4):
        for frame in range(2):
            steps += [("run", f"window.show({frame}, {round_})"), ("pixels", "#picture")]
    seen = browser.visit(page, *steps)
    assert_quiet(seen, page)
    for i, result in enumerate(seen.results[1::2]):
        own = shown(draw_flakes(frames[i % 6], SIDE, SIDE).rgb())
        drawn = picture(result)
        premultiplied = drawn[..., :3] * (drawn[..., 3:] / 255.0)
        assert np.abs(premultiplied - own).max() <= 3

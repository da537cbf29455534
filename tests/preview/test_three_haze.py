"""three.js, in a real browser, shows a grid of lines through the hot air of a fire."""

import base64
import json
from pathlib import Path

import numpy as np

from tests.preview.browser import Browser, assert_quiet, picture
from tests.support.hazes import BRIGHT, DARK, HazePage, bent, built, grid, lines, seam_ratio
from tests.support.requirements import node_modules

PLAYER = Path(__file__).parents[2] / "docs" / "engines" / "three_haze.js"

PAGE = """<!DOCTYPE html><canvas id="picture" width="{width}" height="{height}"></canvas>
<script>const exports = {{}}, module = {{ exports }};</script><script>{three}</script><script>
const THREE = exports;
{player}
const image = new Image();
image.onload = () => {{
  const canvas = document.getElementById("picture");
  const renderer = new THREE.WebGLRenderer({{ canvas, preserveDrawingBuffer: true }});
  const [width, height] = [canvas.width, canvas.height];
  const scene = new THREE.Scene();
  const camera = new THREE.OrthographicCamera(0, width, 0, -height, -10, 10);
  const fill = (x, y, w, h, byte) => {{
    const grey = byte / 255;
    const color = new THREE.Color().setRGB(grey, grey, grey, THREE.SRGBColorSpace);
    const material = new THREE.MeshBasicMaterial({{ color }});
    const mesh = new THREE.Mesh(new THREE.PlaneGeometry(w, h), material);
    mesh.position.set(x + w / 2, -y - h / 2, byte / 1000);
    scene.add(mesh);
  }};
  fill(0, 0, width, height, {dark});
  for (const line of {lines}) fill(...line, {bright});
  const texture = new THREE.Texture(image);
  Object.assign(texture, {{ generateMipmaps: false, minFilter: THREE.LinearFilter }});
  texture.needsUpdate = true;
  const atlas = {atlas};
  const haze = new FireHaze(renderer, atlas, texture);
  const {{ anchor }} = Object.values(atlas.frames)[0];
  haze.mesh.position.set(anchor.x * width, -anchor.y * height, 1);
  haze.mesh.scale.setScalar({zoom});
  window.show = (frame) => {{ haze.show(frame); haze.render(scene, camera); }};
  window.show(0);
  document.body.dataset.ready = "";
}};
image.src = "data:image/png;base64,{image}";
</script>"""


def test_lines_bend_as_the_vectors_say_above_the_fire_alone_and_the_haze_closes(
    browser: Browser, tmp_path: Path
) -> None:
    build, zoom = built(tmp_path), 2
    haze = HazePage.read(build)
    height, width = (zoom * length for length in haze.of(0).shape[:2])
    page = tmp_path / "haze.html"
    player = PLAYER.read_text(encoding="utf-8").replace("export class", "class")
    player = player.replace('import * as THREE from "three";', "")
    three = (node_modules() / "three" / "build" / "three.cjs").read_text(encoding="utf-8")
    text = PAGE.format(
        width=width, height=height, three=three.replace("</script", "<\\/script"), player=player,
        dark=DARK, bright=BRIGHT, lines=json.dumps(lines(width, height)), zoom=zoom,
        atlas=(build / "fire.json").read_text(encoding="utf-8"),
        image=base64.b64encode((build / "fire.haze.png").read_bytes()).decode(),
    )  # fmt: skip
    page.write_text(text, encoding="utf-8")
    steps: list[tuple[str, str]] = []
    for i in range(len(haze.frames)):
        steps += [("run", f"window.show({i})"), ("pixels", "#picture")]
    seen = browser.visit(page, *steps, size=(width, height))
    assert_quiet(seen, page)
    shown = [picture(result)[..., :3] for result in seen.results[1::2]]
    assert 0.8 <= seam_ratio(shown) <= 1.25
    straight = grid(width, height)
    for i in (0, 9):
        # Blending of neighbours is in linear light here: compared where lines are not cut.
        wanted, found = bent(haze.of(i), zoom), shown[i][..., 1].astype(np.float32)
        assert np.abs(wanted - straight).mean() > 3, "lines bend"
        sure = (wanted == BRIGHT) | (wanted == DARK)
        assert np.abs(found - wanted)[sure].mean() < 1
        assert np.abs((found > 130) != (wanted > 130)).mean() < 0.02
        foot = round(haze.frames[i]["anchor"]["y"] * height)
        assert np.array_equal(found[foot:], straight[foot:])

"""three.js, PixiJS 8 and Phaser 3 and 4, in a real browser, look up the colours of heat."""

import base64
import io
import json
import re
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from PIL import Image
from scipy.spatial import cKDTree

from tests.preview.browser import Browser, assert_quiet, picture
from tests.support.heats import RAMPS, HeatFire, Values, built
from tests.support.requirements import node_modules

ENGINES = Path(__file__).parents[2] / "docs" / "engines"
FRAME, GROUND = 5, 64
SIZE = 96, 104
"""Of the canvas, px. Even, since Phaser's camera moves pictures of odd sizes by half a pixel."""

LIBRARIES = {
    "three": "three/build/three.cjs",
    "pixi": "pixi.js/dist/pixi.min.js",
    "phaser": "phaser/dist/phaser.min.js",
    "phaser4": "phaser4/dist/phaser.min.js",
}

NAMES = {
    "three": "const THREE = module.exports;",
    "pixi": "const { Mesh, MeshGeometry, Shader } = PIXI;",
    "phaser": "",
}
"""What the imports of the players give."""

START = {
    "three": """
const load = (url) => new THREE.TextureLoader().loadAsync(url);
const renderer = new THREE.WebGLRenderer({ preserveDrawingBuffer: true, antialias: false });
renderer.setSize(width, height);
renderer.setClearColor(new THREE.Color().setRGB(GROUND / 255, GROUND / 255, GROUND / 255, "srgb"));
const scene = new THREE.Scene();
const camera = new THREE.OrthographicCamera(0, width, 0, -height, -10, 10);
const fire = new FireHeat(atlas, await load(page), await load(ramp));
fire.mesh.position.set(pivot[0], -pivot[1], 0);
scene.add(fire.mesh);
return { canvas: renderer.domElement, fire, load, render: () => renderer.render(scene, camera) };
""",
    "pixi": """
const data = { alphaMode: "premultiplied-alpha" };
const load = (src) => PIXI.Assets.load({ src, parser: "texture", data });
const app = new PIXI.Application();
await app.init({ width, height, preference: "webgl", background: GROUND * 0x10101, antialias: false,
  autoStart: false, preserveDrawingBuffer: true });
const fire = new FireHeat(atlas, await load(page), await load(ramp));
fire.position.set(...pivot);
app.stage.addChild(fire);
return { canvas: app.canvas, fire, load, render: () => app.render() };
""",
    "phaser": """
const load = (src) => images[src];
const images = {};
for (const src of [page, ramp, grey]) {
  images[src] = Object.assign(new Image(), { src });
  await images[src].decode();
}
const made = await new Promise((done) => {
  const create = function () { done(this); };
  new Phaser.Game({ type: Phaser.WEBGL, width, height, banner: false, scene: { create },
    backgroundColor: GROUND * 0x10101, audio: { noAudio: true },
    render: { preserveDrawingBuffer: true, antialias: false } });
});
await new Promise((next) => setTimeout(next));
made.game.loop.stop();
const fire = new FireHeat(made, ...pivot, atlas, images[page], images[ramp]);
made.add.existing(fire);
let now = performance.now();
return { canvas: made.game.canvas, fire, load, render: () => made.game.step((now += 16), 16) };
""",
}
"""Begin a game with one fire."""

PAGE = """<!DOCTYPE html><body data-ready style="min-height: 1px">
<script>var module = {{ exports: {{}} }}, exports = module.exports;</script>
<script>{library}</script><script>
{names}
{players}
const [width, height, pivot, atlas, page, ramp, grey, GROUND] = {given};
const started = (async () => {{ {start} }})();
window.draw = async (moment, {{ alpha, ...values }}) => {{
  const {{ canvas, fire, load, render }} = await started;
  canvas.id = "picture";
  document.body.append(canvas);
  if (values.ramp) values.ramp = await load(grey);
  if (alpha) fire.alpha = alpha;
  fire.show(moment);
  fire.set(values);
  render();
}};
</script>"""


def encoded(data: bytes) -> str:
    return f"data:image/png;base64,{base64.b64encode(data).decode()}"


def grey_ramp() -> bytes:
    """A ramp from nothing to white."""
    file, steps = io.BytesIO(), np.arange(256, dtype=np.uint8)
    Image.fromarray(np.repeat(steps[None, :, None], 4, axis=2)).save(file, "PNG")
    return file.getvalue()


def off_ramp(shown: Values, ramp: Values) -> float:
    """Return the largest distance, ΔE, of colours (h, w, 3) of 255 to the nearest of a ramp's."""
    one, other = (
        cv2.cvtColor((each.reshape(1, -1, 3) / 255).astype(np.float32), cv2.COLOR_RGB2Lab)[0]
        for each in (shown, ramp)
    )
    return float(cKDTree(other).query(one)[0].max())


def without_modules(script: str) -> str:
    """Return a module as a script of a page that has all its modules already."""
    return re.sub(r"^import .*$", "", script, flags=re.M).replace("export ", "")


@pytest.fixture(scope="module")
def fires(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same fire in heat, in heat4, and as light that is added."""
    folder = tmp_path_factory.mktemp("heat")
    built(folder, "fire")
    built(folder, "four", atlas={"pixels": "heat4"})
    built(folder, "glow", atlas={"alpha": "additive"})
    return folder


def drawn(
    browser: Browser, client: str, folder: Path, name: str, *moments: tuple[float, dict[str, Any]]
) -> list[Values]:
    """Return what a client shows of moments with other settings, (h, w, 3) of 255."""
    atlas = json.loads((folder / f"{name}.json").read_bytes())
    entry = next(iter(atlas["frames"].values()))
    width, height = entry["sourceSize"]["w"], entry["sourceSize"]["h"]
    given = [
        *SIZE, [entry["anchor"]["x"] * width, entry["anchor"]["y"] * height], atlas,
        encoded((folder / f"{name}.png").read_bytes()),
        encoded((folder / f"{name}.ramp.png").read_bytes()), encoded(grey_ramp()), GROUND,
    ]  # fmt: skip
    library = (node_modules() / LIBRARIES[client]).read_text(encoding="utf-8")
    if client != "three":  # they would take a page with modules for Node
        library = f"module = undefined; exports = undefined;{library}"
    page = folder / f"{client}-{name}.html"
    program = client.rstrip("4")
    page.write_text(PAGE.format(
        library=library.replace("</script", "<\\/script"), names=NAMES[program],
        players="".join(without_modules((ENGINES / file).read_text(encoding="utf-8"))
                        for file in ("heat.js", f"{program}_heat.js")),
        given=json.dumps(given), start=START[program],
    ), encoding="utf-8")  # fmt: skip
    steps: list[tuple[str, str]] = []
    for moment, values in moments:
        steps += [("run", f"draw({moment}, {json.dumps(values)})"), ("pixels", "#picture")]
    seen = browser.visit(page, *steps, size=SIZE)
    assert_quiet(seen, page)
    return [picture(each)[:height, :width, :3].astype(float) for each in seen.results[1::2]]


@pytest.mark.parametrize("client", LIBRARIES)
@pytest.mark.parametrize("name", ["fire", "four", "glow"])
def test_one_fire_burns_in_six_ramps_and_dies(
    client: str, name: str, browser: Browser, fires: Path
) -> None:
    """Within 2 of 255 of our own look-up; heat fades, not colour, also round the loop's end."""
    fire = HeatFire(fires, name)
    last = len(fire.frames) - 1
    rows = [(float(FRAME), {"row": row}) for row in range(len(RAMPS))]
    steps = [(FRAME + 0.5, {"row": 0}), (3.25, {}), (last + 0.5, {})]
    erosions = [(float(FRAME), {"threshold": each}) for each in (0.0, 0.3, 0.6, 1.0)]
    exchanged = [(float(FRAME), {"threshold": 0, "ramp": True})]
    shots = drawn(browser, client, fires, name, *rows, *steps, *erosions, *exchanged)
    heat = fire.heat(FRAME)
    for row in range(len(RAMPS)):
        assert np.abs(shots.pop(0) - fire.shown(heat, row, GROUND)).max() <= 2, RAMPS[row]
    for moment, _ in steps:
        here, there = fire.heat(int(moment)), fire.heat((int(moment) + 1) % len(fire.frames))
        part = moment % 1
        wanted = fire.shown(here + part * (there - here), ground=GROUND)
        shot = shots.pop(0)
        assert np.abs(shot - wanted).max() <= 2, moment
        colours = [fire.shown(each, ground=GROUND) for each in (here, there)]
        mixed = colours[0] + part * (colours[1] - colours[0])
        assert np.abs(wanted - mixed).max() > 20, "fading colours looks different"
        ramp = fire.shown(np.linspace(0, 1, 1024)[None], ground=GROUND)[0]
        assert off_ramp(shot, ramp) <= 2 < 6 < off_ramp(mixed, ramp)
    for _, values in erosions:
        shot, left = shots.pop(0), np.maximum(heat - values["threshold"], 0)
        assert np.abs(shot - fire.shown(left, ground=GROUND)).max() <= 2, values
    assert (shot == GROUND).all()
    wanted = 255 * heat + (1 - heat) * GROUND
    assert np.abs(shots.pop(0) - wanted[..., None]).max() <= 2


@pytest.mark.parametrize("client", ["pixi", "phaser", "phaser4"])
def test_it_fades_as_other_objects_of_its_client_do(
    client: str, browser: Browser, fires: Path
) -> None:
    fire = HeatFire(fires)
    (shot,) = drawn(browser, client, fires, "fire", (FRAME, {"alpha": 0.5}))
    whole = fire.shown(fire.heat(FRAME), ground=GROUND)
    assert np.abs(shot - (whole + GROUND) / 2).max() <= 2


def test_it_ends_with_its_last_frame_if_it_does_not_loop(browser: Browser, tmp_path: Path) -> None:
    built(tmp_path, "once", timeline={"loop": "none"})
    fire = HeatFire(tmp_path, "once")
    last = len(fire.frames) - 1
    moments: list[tuple[float, dict[str, Any]]] = [(last + 0.5, {}), (last + 20.0, {}), (-3.0, {})]
    shots = drawn(browser, "three", tmp_path, "once", *moments)
    for frame, shot in zip((last, last, 0), shots, strict=True):
        assert np.abs(shot - fire.shown(fire.heat(frame), ground=GROUND)).max() <= 2


def test_moments_before_a_loop_are_those_before_its_end(browser: Browser, fires: Path) -> None:
    fire = HeatFire(fires)
    (shot,) = drawn(browser, "three", fires, "fire", (-2.0, {}))
    wanted = fire.shown(fire.heat(len(fire.frames) - 2), ground=GROUND)
    assert np.abs(shot - wanted).max() <= 2

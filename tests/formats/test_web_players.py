"""PixiJS 8, Phaser 3 and 4 and melonJS, in a real browser, show every frame as it went in."""

import json
import re
import subprocess
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from fire_atlas.atlas.drawing import Edges, draw_page
from fire_atlas.atlas.encode import encode_frame, encode_sprites, shrink
from fire_atlas.atlas.mesh import with_meshes
from fire_atlas.atlas.pages import build_sheets
from fire_atlas.atlas.sheet import AnimationFrames
from fire_atlas.cli import main
from fire_atlas.core.pixels import Bytes, Pixels
from fire_atlas.core.workers import Workers
from fire_atlas.formats.pages.page_file import write_page
from fire_atlas.pipeline.files.exports import exported_files
from fire_atlas.recipe.output import Atlas
from tests.docs.markdown import section
from tests.support.sheets import product_of

WEB = Path(__file__).parent / "web"

WIDTH, HEIGHT, FOOT = 44, 56, (20, 48)
CANVAS, AT = 160, (80, 120)
FPS = 24


@dataclass(frozen=True)
class Case:
    """An atlas, the file of it that a client loads, and the client."""

    client: str
    export: str
    ending: str
    atlas: dict[str, Any] = field(default_factory=dict)
    scale: float = 1
    title: str = "fire"
    shares_pages: bool = False
    loads: tuple[str | list[str], ...] = ()
    """Files that PixiJS loads in turn, those of a list at once; by default the first."""

    @property
    def name(self) -> str:
        settings = "-".join(f"{key}_{value}" for key, value in (*self.atlas.items(), *self.order))
        return "".join(
            c if c.isalnum() or c in "-_" else "_"
            for c in f"{self.client}-{self.export}-{settings}-{self.scale}-{self.title}"
        )

    @property
    def order(self) -> list[tuple[str, Any]]:
        return [("loads", "-".join(map(str, self.loads)))] if self.loads else []

    @property
    def json(self) -> str:
        return f"fire{'' if self.scale == 1 else f'@{self.scale:g}x'}{self.ending}"


PAGES: dict[str, Any] = {"max_size": 64}
PREMULTIPLIED: dict[str, Any] = {"alpha": "premultiplied"}
HALF: dict[str, Any] = {"scales": [1, 0.5]}
MESH: dict[str, Any] = {"mesh": {"vertices": 6}}
ORDERS: list[tuple[str | list[str], ...]] = [
    ("fire.json",),
    (["fire.json", "fire-1.json"],),
    (["fire-1.json", "fire.json"],),
    ("fire.json", "fire-1.json"),
    ("fire-1.json", "fire.json"),
]
SHARED = {"torch": 9, "candle": 7, "ember": 5}
"""Numbers of frames of animations that share pages; one page holds two of them at most."""
CASES = [
    Case("pixi", "json", ".json"),
    Case("pixi", "json", ".json", {"alpha": "premultiplied"}),
    Case("pixi", "json", ".json", PAGES),
    Case("pixi", "json", ".json", {**PAGES, "alpha": "premultiplied", "trim": "none"}),
    Case("pixi", "json", ".json", HALF, 0.5),
    Case("pixi", "json", ".json", {**HALF, "alpha": "premultiplied", **PAGES}, 0.5),
    Case("pixi", "json", ".json", {"rotate": True}),
    Case("pixi", "json", ".json", MESH),
    Case("pixi", "json", ".json", {**MESH, **HALF, "rotate": True, "alpha": "premultiplied"}, 0.5),
    Case("pixi", "json", ".json", {"trim": "animation", "extrude": 2, "border": 3, "bleed": 2}),
    Case("pixi", "json", ".json", {"layout": "grid", "pot": True, "format": "webp"}),
    *(
        Case("pixi", "json", ".json", atlas, title=title, shares_pages=True)
        for atlas in ({"max_size": 112, "dedupe": False}, {"max_size": 200, "layout": "grid"})
        for title in SHARED
    ),
    *(Case("pixi", "json", ".json", PAGES, loads=order) for order in ORDERS),
    Case(
        "pixi", "json", ".json", {**PAGES, "trim": "none"},
        loads=("fire-2.json", "fire.json", "fire-1.json"),
    ),
    *(
        Case(client, "phaser", ".phaser.json", atlas)
        for client in ("phaser360", "phaser370")
        for atlas in ({}, PAGES)
    ),
    *(
        case
        for client in ("phaser", "phaser4")
        for case in (
            Case(client, "phaser", ".phaser.json"),
            Case(client, "phaser", ".phaser.json", PAGES),
            Case(client, "phaser", ".phaser.json", HALF, 0.5),
            Case(client, "phaser", ".phaser.json", {"trim": "none", "extrude": 1, "bleed": 3}),
            Case(client, "json", ".json", {"trim": "animation", "square": True}),
            Case(client, "json-array", ".array.json"),
            Case(client, "aseprite", ".aseprite.json"),
        )
    ),
]  # fmt: skip


TWO_ATLASES = ("fire", "smoke")
"""Names of atlases in one folder, each of two pages."""

TICK = 1000 / 240
"""Steps in which animations are played, ms."""

DOCS = {
    "docs-pixi": (
        "PixiJS", 0, "pixi.js/dist/pixi.min.js",
        Case("page", "json", ".json", PREMULTIPLIED, title="campfire"),
        """
        window.draw = async () => {
          %s
          return { frames: [], playing: sprite.playing && textures.map((each) => each.label) };
        };
        """,
    ),
    "docs-phaser": (
        "Phaser", 0, "phaser/dist/phaser.min.js",
        Case("page", "phaser", ".phaser.json", title="campfire"),
        """
        window.draw = () => new Promise((done) => new Phaser.Game({
          width: 400, height: 400, banner: false, audio: { noAudio: true }, scene: {
            preload() { %s },
            create() {
              %s
              const [sprite] = this.children.list;
              const { currentAnim, isPlaying } = sprite.anims;
              const names = currentAnim.frames.map((each) => each.frame.name);
              done({ frames: [], playing: isPlaying && names });
            },
          },
        }));
        """,
    ),
}  # fmt: skip
"""Pages made of lines of `docs/engines/web.md`: section, number of its block, the client's script,
the atlas that lies in `build`, and the page's script, with the block in it as it stands; it is cut
at the comments `// preload` and `// create`."""


FIRES, SECONDS = 24, 3
"""How many fires are placed, and how long they play."""

APART: dict[str, tuple[str, str | None, str, str]] = {
    "apart-pixi": (
        "PixiJS", "pixi.js/dist/pixi.min.js", "json",
        """
        window.draw = async () => {
          const sheet = await PIXI.Assets.load("build/street.json"), textures = sheet.animations.v2;
          const frames = textures.map((each) => (
            { texture: each, time: sheet.data.frames[each.label].duration }
          ));
          const began = FIRES.map(() => {
            const sprite = new PIXI.AnimatedSprite(frames, false);
            LINES
            let frames_passed = 0;
            sprite.onFrameChange = () => (frames_passed += 1);
            const told = { start: sprite.currentFrame, speed: sprite.animationSpeed };
            for (const tick of TICKS) sprite.update({ deltaTime: tick * 0.06 });
            return { ...told, passed: frames_passed };
          });
          return { frames: [], began };
        };
        """,
    ),
    **{
        f"apart-{program}": (
            "Phaser", f"{program}/dist/phaser.min.js", "phaser",
            """
            window.draw = () => new Promise((done) => new Phaser.Game({
              width: 40, height: 40, banner: false, audio: { noAudio: true }, scene: {
                preload() {
                  this.load.multiatlas("street", "build/street.phaser.json", "build/");
                  this.load.animation("street-animations", "build/street.phaser.json");
                },
                create() {
                  this.game.loop.stop();
                  const began = FIRES.map(() => {
                    const sprite = this.add.sprite(20, 20, "street");
                    LINES
                    let passed = 0, now = 0;
                    sprite.on("animationupdate", () => (passed += 1));
                    const { currentFrame, timeScale } = sprite.anims;
                    for (const tick of TICKS) sprite.anims.update((now += tick), tick);
                    return { start: currentFrame.index - 1, speed: timeScale, passed };
                  });
                  done({ frames: [], began });
                },
              },
            }));
            """,
        )
        for program in ("phaser", "phaser4")
    },
    "apart-three": (
        "three.js", None, "json",
        """
        window.draw = async () => {
          const fps = 24, count = 9;
          const began = FIRES.map(() => {
            const start = 10 * Math.random(), pace = 0.9 + 0.2 * Math.random(), shown = [];
            let seconds = 0;
            for (const tick of [0, ...TICKS]) {
              seconds += tick / 1000;
              LINES
              shown.push(frame);
            }
            const passed = shown.filter((frame, i) => i && frame !== shown[i - 1]).length;
            return { start: shown[0], speed: pace, passed };
          });
          return { frames: [], began };
        };
        """,
    ),
    "apart-css": (
        "CSS", None, "css",
        """
        const fires = FIRES.map(() => document.body.appendChild(document.createElement("i")));
        for (const each of fires) each.className = "v1";
        window.draw = async () => {
          LINES
          const [first] = fires.map((each) => each.getAnimations({ subtree: true })[0]);
          const { duration } = first.effect.getTiming();
          const began = fires.map((each) => {
            const [playing] = each.getAnimations({ subtree: true });
            return { start: (-playing.effect.getTiming().delay / duration * 9) % 9, speed: 1 };
          });
          return { frames: [], began };
        };
        """,
    ),
}  # fmt: skip
"""Pages made of lines of `docs/variants.md`: what stands before the lines, the client's script, the
export that lies in `build`, and the page's script, where the lines stand for LINES."""


TRIMS: dict[str, dict[str, Any]] = {
    "whole": {"trim": "none"}, "margin": {}, "cut": {"trim_margin": 0},
}  # fmt: skip
"""Settings of a drawing with hard edges, by the folder that it is built into."""

TURNED = """
  window.draw = async ({ size: [width, height] }) => {
    const app = new PIXI.Application();
    await app.init({ width, height, backgroundAlpha: 0, preference: "webgl", antialias: false,
      autoStart: false, preserveDrawingBuffer: true });
    const { gl } = app.renderer, frames = [];
    for (const name of %s) {
      const { textures } = await PIXI.Assets.load(`${name}/ui.json`);
      const sprite = app.stage.addChild(new PIXI.Sprite(textures.icon));
      sprite.anchor.set(0.5);
      sprite.position.set(width / 2, height / 2);
      sprite.rotation = 0.5;
      app.render();
      sprite.destroy();
      const pixels = new Uint8Array(4 * width * height);
      gl.bindFramebuffer(gl.FRAMEBUFFER, null);
      gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
      frames.push(btoa(String.fromCharCode(...pixels)));
    }
    return { frames };
  };
"""


def turned_page(folder: Path) -> None:
    """Write a page that draws a turned square, filtered, of pages that are trimmed in each way."""
    (folder / "art").mkdir(parents=True)
    drawing = np.zeros((40, 40, 4), np.uint8)
    drawing[8:32, 10:30] = (255, 140, 0, 255)
    Image.fromarray(drawing).save(folder / "art/icon.png")
    for name, atlas in TRIMS.items():
        recipe = {"source": {"kind": "sprites", "path": "art"}, "atlas": atlas}
        (folder / "ui.yaml").write_text(json.dumps(recipe))
        assert main(["build", "-q", str(folder / "ui.yaml"), "-o", str(folder / name)]) == 0
    head = '<!doctype html><body><script src="/modules/pixi.js/dist/pixi.min.js"></script>'
    (folder / "index.html").write_text(f"{head}<script>{TURNED % [*TRIMS]}</script></body>")


def docs_page(name: str, folder: Path) -> None:
    """Write a page with the lines of the docs, and the folder that they load from."""
    section_name, number, program, case, script = DOCS[name]
    text = section("docs/engines/web.md", section_name)
    lines = re.findall(r"^```js\n(.*?)^```$", text, re.M | re.S)[number]
    _, *parts = re.split(r"^// (?:preload|create)\n", f"// preload\n{lines}", flags=re.M)
    parts = [part for part in parts if part]
    (folder / "build").mkdir(parents=True)
    write(case, folder / "build", "campfire")
    head = f'<!doctype html><body><script src="/modules/{program}"></script>'
    (folder / "index.html").write_text(f"{head}<script>{script % tuple(parts)}</script></body>")


def lines_of_variants(client: str) -> str:
    """Return the lines of `docs/variants.md` for a client: those under the comment of its name."""
    (block,) = re.findall(
        r"^```js\n(.*?)^```$", section("docs/variants.md", "Out of step"), re.M | re.S
    )
    parts = re.split(r"^// (PixiJS|Phaser|three\.js|CSS)\b.*\n", block, flags=re.M)
    return dict(zip(parts[1::2], parts[2::2], strict=True))[client]


def apart_page(name: str, folder: Path) -> None:
    """Write a page that places fires as the docs say, and the atlas that they show."""
    client, program, export, script = APART[name]
    ending = ".phaser.json" if export == "phaser" else f".{export}"
    (folder / "build").mkdir(parents=True)
    title = "v1" if export == "css" else "v2"
    write(Case("page", export, ending, title=title), folder / "build", "street")
    script = script.replace("LINES", lines_of_variants(client))
    script = script.replace("FIRES", f"Array({FIRES}).fill()")
    script = script.replace("TICKS", f"Array({round(1000 * SECONDS / TICK)}).fill({TICK})")
    head = "<!doctype html><body>"
    if program is not None:
        head += f'<script src="/modules/{program}"></script>'
    if export == "css":
        style = (folder / "build/street.css").read_text().replace('url("', 'url("build/')
        head += f"<style>{style}</style>"
    (folder / "index.html").write_text(f"{head}<script>{script}</script></body>")


def clip(case: Case) -> list[Pixels]:
    """Return the frames of the animation of a case."""
    return frames()[: SHARED.get(case.title)]


def frames() -> list[Pixels]:
    """Frames that move, two without two of their corners, one empty, one of a single px, one that
    fills the frame, one repeated."""
    chance = np.random.default_rng(12)
    made = []
    for _ in range(9):
        pixels = np.zeros((HEIGHT, WIDTH, 4), np.float32)
        x, y = chance.integers(0, 24, 2)
        patch = chance.random((*chance.integers(9, 30, 2), 4), np.float32)
        patch[..., :3] *= patch[..., 3:]
        room = pixels[y : y + patch.shape[0], x : x + patch.shape[1]]
        room[:] = patch[: room.shape[0], : room.shape[1]]
        made.append(pixels)
    for pixels in (made[1], made[2]):
        middle = np.abs(np.add.outer(np.arange(HEIGHT), np.arange(WIDTH)) - 46) < 14
        pixels[~middle] = 0
    made[3][:] = 0
    made[5][:] = 0
    made[5][17, 40] = 1
    made[6][:] = np.array([0.1, 0.2, 0.4, 0.8])
    made[8] = made[1].copy()
    return made


def write(case: Case, folder: Path, name: str = "fire") -> list[str]:
    """Write the atlas of a case as a build does; return the names of the animation's frames."""
    settings = Atlas.model_validate(case.atlas)
    encoded = [encode_sprites(pixels, settings) for pixels in frames()]
    counts = SHARED if case.shares_pages else {case.title: len(encoded)}
    drawn = [sprites for count in counts.values() for sprites in encoded[:count]]
    animations = [
        AnimationFrames(title, tuple(s[0] for s in encoded[:count]), 1000 / FPS, True, FOOT)
        for title, count in counts.items()
    ]
    sheets = build_sheets(name, animations, settings)
    shown = list(zip(*drawn, strict=True))
    if settings.mesh != "none":
        sheets = tuple(
            with_meshes(sheet, [[each] for each in sprites], settings.mesh.vertices)
            for sheet, sprites in zip(sheets, shown, strict=True)
        )
    for sheet, sprites in zip(sheets, shown, strict=True):
        for i, page in enumerate(sheet.pages):
            with Workers(1) as workers, (folder / page.file).open("wb") as file:
                image = draw_page(sheet, i, sprites, Edges.of(settings, sheet.scale))
                write_page(file, image, settings, workers)
    for description in exported_files([case.export], product_of(*sheets), {}):  # type: ignore[list-item]
        (folder / description.name).write_bytes(description.data)
    assert (len(sheets[0].pages) > 1) == ("max_size" in case.atlas)
    return next(list(each.frames) for each in sheets[0].animations if each.name == case.title)


def zoom(case: Case) -> int:
    """Pixi shows a smaller variant as large as the whole one; Phaser shows it px for px."""
    return round(1 / case.scale) if case.client == "pixi" else 1


@pytest.fixture(scope="module")
def drawn(node: str, chromium: Path, tmp_path_factory: pytest.TempPathFactory) -> Any:
    """What every client drew in every case: one browser for all."""
    root = tmp_path_factory.mktemp("web")
    (root / "out").mkdir()
    jobs = []
    for case in CASES:
        (root / case.name).mkdir()
        names = write(case, root / case.name)
        jobs.append({
            "id": case.name, "client": case.client, "folder": str(root / case.name),
            "json": case.json, "title": case.title, "size": [CANVAS, CANVAS], "at": AT, "zoom": 1,
            "premultiplied": case.atlas.get("alpha") == "premultiplied", "names": names,
            "meshes": "mesh" in case.atlas, "loads": case.loads or None,
        })  # fmt: skip
    common = {"size": [CANVAS, CANVAS], "at": AT, "zoom": 1, "premultiplied": False}
    (root / "two").mkdir()
    for name in TWO_ATLASES:
        case = Case("pixi", "json", ".json", PAGES, title=name)
        names = write(case, root / "two", name)
        jobs.append({
            **common, "id": f"two-{name}", "client": "pixi", "folder": str(root / "two"),
            "json": f"{name}.json", "loads": [[f"{each}.json" for each in TWO_ATLASES]],
            "title": name, "names": names,
        })  # fmt: skip
    (root / "second").mkdir()
    write(Case("pixi", "json", ".json", PAGES), root / "second")
    jobs.append({
        **common, "id": "second", "client": "pixi", "folder": str(root / "second"),
        "json": "fire-1.json", "title": "fire", "names": [],
    })  # fmt: skip
    (root / "melon").mkdir()
    names = write(Case("melon", "json-array", ".array.json"), root / "melon")
    jobs.append({
        **common, "id": "melon-atlas", "client": "melon", "folder": str(root / "melon"),
        "json": "fire.array.json", "names": names,
    })  # fmt: skip
    for name in DOCS:
        docs_page(name, root / name)
        jobs.append(
            {**common, "id": name, "client": "page", "folder": str(root / name), "names": []}
        )
    for name in APART:
        apart_page(name, root / name)
        jobs.append(
            {**common, "id": name, "client": "page", "folder": str(root / name), "names": []}
        )
    turned_page(root / "turned")
    jobs.append(
        {**common, "id": "turned", "client": "page", "folder": str(root / "turned"), "names": []}
    )
    (root / "cases.json").write_text(json.dumps(jobs))
    ran = subprocess.run(
        [node, WEB / "play.mjs", root / "cases.json", root / "out"],
        capture_output=True, text=True, encoding="utf-8", timeout=280, check=False,
    )  # fmt: skip
    assert ran.returncode == 0, ran.stderr
    results = json.loads(ran.stdout)
    for job in jobs:
        result = results[job["id"]]
        result["folder"] = Path(str(job["folder"]))
        data = np.fromfile(root / "out" / f"{job['id']}.rgba", np.uint8)
        result["pixels"] = data.reshape(result["frames"], CANVAS, CANVAS, 4)
        result["expected_names"] = job["names"]
    return results


def canvas(pixels: Pixels, case: Case) -> NDArray[np.float64]:
    """The frame as a client has to show it: premultiplied bytes, its foot at the given place."""
    alpha = case.atlas.get("alpha", "straight")
    image: Bytes = encode_frame(shrink(pixels, round(1 / case.scale)), alpha, "srgb")
    shown = image.astype(np.float64)
    if alpha == "straight":
        shown[..., :3] *= shown[..., 3:] / 255
    shown = shown.repeat(zoom(case), axis=0).repeat(zoom(case), axis=1)
    size = case.scale * zoom(case)
    x, y = AT[0] - round(FOOT[0] * size), AT[1] - round(FOOT[1] * size)
    whole = np.zeros((CANVAS, CANVAS, 4))
    whole[y : y + shown.shape[0], x : x + shown.shape[1]] = shown
    return whole


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_every_frame_is_drawn_as_it_was_and_where_it_was(case: Case, drawn: Any) -> None:
    result = drawn[case.name]
    assert result["errors"] == []
    assert result["frames"] == len(clip(case))
    allowed = 1 if case.atlas.get("alpha") == "premultiplied" else 2
    for pixels, shown in zip(clip(case), result["pixels"], strict=True):
        assert np.abs(shown - canvas(pixels, case)).max() <= allowed
    assert result["pixels"][0].any()


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_the_animation_plays_every_frame_in_order_and_starts_over(case: Case, drawn: Any) -> None:
    result, count = drawn[case.name], len(clip(case))
    names = result["expected_names"]
    if case.export == "aseprite":
        names = [str(i) for i in range(count)]
    assert result["names"] == names
    assert result["played"][:count] == [*names[1:], names[0]]
    if "durations" in result:
        # Phaser's animations have a rate, and Aseprite's frames whole milliseconds.
        stated = {"phaser": [0] * count, "aseprite": [42, 41, 42, 42, 41, 42, 42, 41, 42]}
        wanted = stated.get(case.export, [1000 / FPS] * count)
        assert result["durations"] == pytest.approx(wanted, abs=1e-3)
        assert result["repeat"] == -1


@pytest.mark.parametrize(
    "case", [each for each in CASES if each.client == "pixi"], ids=lambda case: case.name
)
def test_pixi_finds_a_whole_animation_in_one_sheet_unless_no_page_holds_it(
    case: Case, drawn: Any
) -> None:
    needs_several = "max_size" in case.atlas and not case.shares_pages
    assert (drawn[case.name]["sheets"] > 1) == needs_several


def test_the_clients_are_those_that_are_promised(drawn: Any) -> None:
    versions = {case.client: drawn[case.name]["version"].split(".")[0] for case in CASES}
    assert versions == {
        "pixi": "8", "phaser": "3", "phaser360": "3", "phaser370": "3", "phaser4": "4",
    }  # fmt: skip


@pytest.mark.parametrize(
    "case", [each for each in CASES if each.export == "phaser"], ids=lambda case: case.name
)
def test_phaser_plays_a_round_in_the_time_of_its_frames(case: Case, drawn: Any) -> None:
    """Before 3.80 it adds a frame's duration, where one is stated, to that of the rate."""
    assert drawn[case.name]["round"] == pytest.approx(1000 * len(clip(case)) / FPS, abs=TICK)


def test_pixi_shows_the_second_of_two_pages_alone(drawn: Any) -> None:
    result = drawn["second"]
    assert result["errors"] == []
    on_page = json.loads((result["folder"] / "fire-1.json").read_text())["frames"]
    assert result["names"] == sorted(on_page) and 0 < len(on_page) < len(frames())
    case = Case("pixi", "json", ".json", PAGES)
    for name, shown in zip(result["names"], result["pixels"], strict=True):
        pixels = frames()[int(name.removeprefix("fire/"))]
        assert np.abs(shown - canvas(pixels, case)).max() <= 2


@pytest.mark.parametrize("name", TWO_ATLASES)
def test_pixi_shows_two_atlases_of_one_folder(name: str, drawn: Any) -> None:
    result = drawn[f"two-{name}"]
    assert result["errors"] == []
    case = Case("pixi", "json", ".json", PAGES)
    for pixels, shown in zip(frames(), result["pixels"], strict=True):
        assert np.abs(shown - canvas(pixels, case)).max() <= 2


def test_melonjs_finds_every_frame_its_place_and_its_pivot(drawn: Any) -> None:
    result = drawn["melon-atlas"]
    assert result["errors"] == []
    frames_of = json.loads((result["folder"] / "fire.array.json").read_text())["frames"]
    assert len(frames_of) == len(frames())
    for frame in frames_of:
        seen, trim = result["regions"][frame["filename"]], frame["spriteSourceSize"]
        assert seen["frame"] == [frame["frame"][key] for key in "xywh"]
        assert seen["trim"] == ([trim[key] for key in "xywh"] if frame["trimmed"] else None)
        assert seen["size"] == [WIDTH, HEIGHT]
        pivot = FOOT[0] - trim["x"], FOOT[1] - trim["y"]
        assert seen["pivot"] == pytest.approx(pivot, abs=1e-3)


def test_a_transparent_px_keeps_hard_edges_smooth_where_pixi_turns_them(drawn: Any) -> None:
    """Without it, the edge of the rectangle cuts the edge of the drawing off, in steps."""
    assert drawn["turned"]["errors"] == []
    whole, margin, cut = drawn["turned"]["pixels"].astype(int)
    assert np.abs(margin - whole).max() <= 16
    assert np.abs(cut - whole).max() > 60


@pytest.mark.parametrize("page", DOCS)
def test_lines_of_the_docs_play_the_fire_as_they_stand(page: str, drawn: Any) -> None:
    assert drawn[page]["errors"] == []
    assert drawn[page]["playing"] == [f"campfire/{i:04}" for i in range(len(frames()))]


@pytest.mark.parametrize("page", APART)
def test_lines_of_the_docs_let_fires_begin_apart(page: str, drawn: Any) -> None:
    """Each begins at a moment of its own, and plays up to a tenth slower or faster."""
    assert drawn[page]["errors"] == []
    began, count = drawn[page]["began"], len(frames())
    starts, speeds = [fire["start"] for fire in began], [fire["speed"] for fire in began]
    assert len(starts) == FIRES and all(0 <= start < count for start in starts)
    # The chance that so many evenly drawn frames are of four kinds or fewer is below 1e-6.
    assert len({int(start) for start in starts}) > 4
    if page == "apart-css":
        assert set(speeds) == {1}
        return
    assert 0.9 <= min(speeds) < max(speeds) <= 1.1 and len(set(speeds)) == FIRES
    for fire in began:
        assert fire["passed"] == pytest.approx(SECONDS * FPS * fire["speed"], abs=1.01)

"""Sprites in the files of each client, and in PixiJS and Phaser: by their names, with borders."""

import json
import re
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from fire_atlas.cli import main
from fire_atlas.core.pixels import Bytes
from tests.engines.unity.type_trees import importer
from tests.sources.test_sprites import icon
from tests.support.icons import draw_theme

WEB = Path(__file__).parent / "web"
SIZE, AT = 64, (32, 32)
BORDER = [5, 3, 4, 2]


def built(folder: Path, **keys: Any) -> Path:
    """Build the icons in ``art`` as ``ui``; return the folder of its files."""
    source = {"kind": "sprites", "path": "art", **keys.pop("source", {})}
    (folder / "ui.yaml").write_text(json.dumps({"source": source, **keys}))
    assert main(["build", "-q", str(folder / "ui.yaml")]) == 0
    return folder / "build"


@pytest.fixture
def art(tmp_path: Path) -> dict[str, Bytes]:
    """Pictures by name: a nine-patch, an animation, and one equal to another."""
    names = ("hud/close", "hud/open", "panel", "coin_1", "coin_2", "1")
    drawn = {name: icon(tmp_path / f"art/{name}.png", 20 + i, 16) for i, name in enumerate(names)}
    drawn["menu/close"] = drawn["hud/close"]
    (tmp_path / "art/menu").mkdir()
    Image.fromarray(drawn["menu/close"]).save(tmp_path / "art/menu/close.png")
    return drawn


SOURCE = {"borders": {"panel": BORDER}, "pivots": {"panel": [0, 0]}}


def test_unity_has_sprites_with_borders_and_a_controller_for_animations_alone(
    tmp_path: Path, art: dict[str, Bytes]
) -> None:
    out = built(tmp_path, source=SOURCE, exports=["unity"])
    _, meta = importer((out / "ui.png.meta").read_text())
    found = {sprite["name"]: sprite for sprite in meta["spriteSheet"]["sprites"]}
    assert found.keys() == {name.replace("/", "_") for name in art}
    left, top, right, bottom = BORDER
    assert found["panel"]["border"] == {"x": left, "y": bottom, "z": right, "w": top}
    assert found["panel"]["pivot"] == {"x": 0, "y": 1}
    assert found["hud_close"]["border"] == dict.fromkeys("xyzw", 0)
    assert found["hud_close"]["rect"] == found["menu_close"]["rect"]
    assert found["hud_close"]["internalID"] != found["menu_close"]["internalID"]
    assert {path.name for path in out.glob("*.anim")} == {"ui.coin.anim"}
    (out / "ui.controller").unlink()
    only = built(tmp_path, source={"animations": "none"}, exports=["unity"])
    assert {path.suffix for path in only.iterdir()} == {".png", ".meta", ".json"}


def test_tpsheet_css_phaser_and_templates_have_every_name(
    tmp_path: Path, art: dict[str, Bytes]
) -> None:
    (tmp_path / "own.j2").write_text(
        "{% for f in frames %}{{ f.name }} {{ f.border }} {{ f.duration > 0 }}\n{% endfor %}"
    )
    own = {"template": "own.j2", "to": "own.txt"}
    exports = ["json", "json-array", "tpsheet", "css", "phaser", own]
    out = built(tmp_path, source=SOURCE, exports=exports)
    tpsheet = (out / "ui.tpsheet").read_text()
    lines = {line.split(";")[0]: line for line in tpsheet.splitlines() if ";" in line}
    left, top, right, bottom = BORDER
    assert lines.keys() == art.keys() and ":borders=enabled" in tpsheet
    assert lines["panel"].endswith(f" {left};{right};{top};{bottom}")
    assert lines["1"].endswith(" 0;0;0;0")
    css = (out / "ui.css").read_text()
    classes = {"hud-close", "hud-open", "menu-close", "panel", "coin_1", "coin_2", "coin", "_1"}
    assert set(re.findall(r"^\.([\w-]+) ", css, re.MULTILINE)) == classes
    phaser = json.loads((out / "ui.phaser.json").read_text())
    assert {f["filename"] for t in phaser["textures"] for f in t["frames"]} == art.keys()
    assert [anim["key"] for anim in phaser["anims"]] == ["coin"]
    array = json.loads((out / "ui.array.json").read_text())
    assert {frame["filename"] for frame in array["frames"]} == art.keys()
    text = (out / "own.txt").read_text().splitlines()
    assert f"panel {BORDER} False" in text and "coin_1 None True" in text and len(text) == len(art)


@pytest.mark.parametrize(
    ("export", "files", "words"),
    [
        ("css", ["a/b", "a-b"], "the class of both would be .a-b"),
        ("css", ["coin", "coin_1", "coin_2"], "the animation coin and the sprite coin"),
        ("godot", ["a/b", "a-b"], "the file of both would be ui.a-b.tres"),
        ("unity", ["a/b", "a_b"], "'a_b' there"),
    ],
)
def test_names_that_would_meet_are_refused(
    export: str,
    files: list[str],
    words: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    for name in files:
        icon(tmp_path / f"art/{name}.png")
    (tmp_path / "ui.yaml").write_text(
        json.dumps({"source": {"kind": "sprites", "path": "art"}, "exports": [export]})
    )
    assert main(["build", str(tmp_path / "ui.yaml")]) == 1
    assert words in " ".join(capsys.readouterr().err.split())


def test_movies_of_one_name_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("a/b1", "a/b2", "a.b1", "a.b2"):
        icon(tmp_path / f"art/{name}.png")
    (tmp_path / "ui.yaml").write_text(
        json.dumps({"source": {"kind": "sprites", "path": "art"}, "movies": ["gif"]})
    )
    assert main(["build", str(tmp_path / "ui.yaml")]) == 1
    assert "would be the file of another animation" in " ".join(capsys.readouterr().err.split())


def test_meshes_are_tight_but_a_nine_patch_is_drawn_whole(
    tmp_path: Path, art: dict[str, Bytes]
) -> None:
    for name in ("panel", "hud/open"):
        image = art[name].copy()
        image[:9, :9] = 0
        Image.fromarray(image).save(tmp_path / f"art/{name}.png")
    out = built(tmp_path, source=SOURCE, atlas={"mesh": {"vertices": 6}})
    frames = json.loads((out / "ui.json").read_text())["frames"]
    height, width = art["panel"].shape[:2]
    corners = [[0, 0], [width, 0], [width, height], [0, height]]
    assert sorted(frames["panel"]["vertices"]) == sorted(corners)
    assert len(frames["hud/open"]["vertices"]) > 4


def test_bytes_are_the_same_with_any_number_of_workers(
    tmp_path: Path, art: dict[str, Bytes]
) -> None:
    exports = ["json", "phaser", "css", "tpsheet", "godot", "unity"]
    out = built(tmp_path, source=SOURCE, exports=exports, atlas={"scales": [1, 0.5]})
    before = {path.name: path.read_bytes() for path in out.iterdir()}
    for jobs in ("1", "4"):
        other = tmp_path / jobs
        line = ["build", "-q", str(tmp_path / "ui.yaml"), "--jobs", jobs, "-o", str(other)]
        assert main(line) == 0
        assert {path.name: path.read_bytes() for path in other.iterdir()} == before


def test_a_grid_has_a_cell_for_every_sprite(tmp_path: Path, art: dict[str, Bytes]) -> None:
    out = built(tmp_path, atlas={"layout": "grid"})
    frames = json.loads((out / "ui.json").read_text())["frames"]
    assert len({(f["frame"]["x"], f["frame"]["y"]) for f in frames.values()}) == len(art)


def test_preview_and_inspect_show_single_sprites(
    tmp_path: Path, art: dict[str, Bytes], capsys: pytest.CaptureFixture[str]
) -> None:
    out = built(tmp_path)
    for kind in ((), ("--sheet",), ("--gif",)):
        assert main(["preview", str(out / "ui.json"), *kind]) == 0
    assert "hud/close" in (out / "ui.preview.html").read_text()
    assert main(["inspect", str(out / "ui.json")]) == 0
    assert "single sprites" in capsys.readouterr().out


JOBS = {
    "by-pixi": ("pixi", ".json"),
    "by-phaser": ("phaser", ".phaser.json"),
    "by-phaser-4": ("phaser4", ".phaser.json"),
    "by-phaser-of-json": ("phaser", ".json"),
}
"""Client and file of each job, by its name."""


@pytest.fixture(scope="module")
def shown(node: str, chromium: Path, tmp_path_factory: pytest.TempPathFactory) -> Any:
    """What each client found and drew of a theme of icons, and a nine-patch."""
    root = tmp_path_factory.mktemp("icons")
    drawn = draw_theme(root / "art")
    drawn["panel"] = icon(root / "art/panel.png", 32, 22)  # even: whole px around its middle
    out = built(root, source={"borders": {"panel": BORDER}}, exports=["json", "phaser"])
    some = [*list(drawn)[::90], list(drawn)[990], "panel"]
    jobs = [
        {
            "id": name, "client": client, "folder": str(out), "json": f"ui{ending}",
            "title": "ui", "size": [SIZE, SIZE], "at": AT, "sprites": some, "known": list(drawn),
        }
        for name, (client, ending) in JOBS.items()
    ]  # fmt: skip
    (root / "jobs.json").write_text(json.dumps(jobs))
    (root / "out").mkdir()
    ran = subprocess.run(
        [node, WEB / "play.mjs", root / "jobs.json", root / "out"],
        capture_output=True, text=True, encoding="utf-8", timeout=280, check=False,
    )  # fmt: skip
    assert ran.returncode == 0, ran.stderr
    return drawn, some, json.loads(ran.stdout), root / "out"


@pytest.mark.browser
@pytest.mark.slow
@pytest.mark.parametrize("job", JOBS)
def test_clients_draw_each_icon_of_a_theme_by_its_name(job: str, shown: Any) -> None:
    drawn, some, results, out = shown
    result = results[job]
    assert result["errors"] == [] and result["missing"] == []
    pixels = np.frombuffer((out / f"{job}.rgba").read_bytes(), np.uint8)
    for name, canvas in zip(some, pixels.reshape(-1, SIZE, SIZE, 4), strict=True):
        assert np.abs(canvas - on_canvas(drawn[name])).max() <= 2, name
    assert result["borders"]["panel"] == BORDER


def on_canvas(image: Bytes) -> NDArray[np.float64]:
    """A sprite, its middle in that of the canvas, as premultiplied bytes."""
    height, width = image.shape[:2]
    whole = np.zeros((SIZE, SIZE, 4))
    x, y = AT[0] - width // 2, AT[1] - height // 2
    shown = image.astype(np.float64)
    shown[..., :3] *= shown[..., 3:] / 255
    whole[y : y + height, x : x + width] = shown
    return whole

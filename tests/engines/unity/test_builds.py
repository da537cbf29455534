"""Whole builds: pixels, pivots, rebuilds, and what lies in the folder already."""

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from fire_atlas.cli import main
from fire_atlas.core.pixels import Bytes
from fire_atlas.core.shipped import shipped
from fire_atlas.engines.unity.names import guids_in
from tests.engines.unity.type_trees import faults, importer

PLAIN: dict[str, Any] = {
    "flakes": "none",
    "motion_blur": "none",
    "tracks": [],
    "exports": ["unity"],
}
SIZE = (70, 90)
MARK = (255, 0, 255, 255)


def draw_marked(folder: Path, count: int) -> list[tuple[int, int]]:
    """Sprites that move over an empty frame, off its centre, each with one marked pixel."""
    folder.mkdir(exist_ok=True)
    chance = np.random.default_rng(5)
    marks = []
    for i in range(count):
        image: Bytes = np.zeros((SIZE[1], SIZE[0], 4), np.uint8)
        x, y, width, height = 3 + 5 * i, 40 - 4 * i, 12 + i, 17 + 2 * i
        image[y : y + height, x : x + width] = chance.integers(1, 250, (height, width, 4), np.uint8)
        marks.append((x + 2 + i, y + 3 * i))
        image[marks[-1][1], marks[-1][0]] = MARK
        Image.fromarray(image).save(folder / f"{i:03}.png")
    return marks


def build(folder: Path, *args: str, name: str = "fire", code: int = 0, **keys: Any) -> Path:
    recipe = folder / f"{name}.yaml"
    recipe.write_text(json.dumps({"source": {"path": "clip", "fps": 12}, **PLAIN, **keys}))
    assert main(["build", "-q", str(recipe), *args]) == code
    return folder / "build"


def sprites(build: Path, page: str) -> dict[str, dict[str, Any]]:
    _, meta = importer((build / f"{page}.meta").read_text())
    return {sprite["name"]: sprite for sprite in meta["spriteSheet"]["sprites"]}


def cut(build: Path, page: str, sprite: dict[str, Any]) -> Bytes:
    """What Unity shows of a page: its rect counts from the bottom."""
    with Image.open(build / page) as image:
        pixels = np.asarray(image.convert("RGBA"))
    x, y, width, height = (sprite["rect"][key] for key in ("x", "y", "width", "height"))
    bottom = pixels.shape[0] - y
    return pixels[bottom - height : bottom, x : x + width]


@pytest.mark.parametrize(
    "atlas",
    [
        {"pivot": "bottom"},
        {"pivot": [0.3, 0.8], "trim": "none"},
        {"pivot": "center", "trim": "animation", "border": 3},
        {"pivot": "top", "layout": "grid", "padding": 6},
        {"pivot": [-0.5, 1.5], "max_size": 40, "extrude": 1},
        {"pivot": [0.25, 0.25], "scales": [1, 0.5], "pot": True},
    ],
)
def test_a_marked_pixel_stands_where_the_pivot_says(atlas: dict[str, Any], tmp_path: Path) -> None:
    marks = draw_marked(tmp_path / "clip", 6)
    made = build(tmp_path, atlas=atlas, exports=[{"unity": {"pixels_per_unit": 20}}])
    named = {"bottom": (0.5, 1), "center": (0.5, 0.5), "top": (0.5, 0)}
    pivot = atlas["pivot"]
    px, py = named[pivot] if isinstance(pivot, str) else pivot
    found = 0
    for page in sorted(p.name for p in made.glob("fire*.png") if "@" not in p.name):
        for name, sprite in sprites(made, page).items():
            image = cut(made, page, sprite)
            ((row, column),) = np.argwhere((image == MARK).all(axis=-1))
            height, width = image.shape[:2]
            # Unity's rule: the pivot, in parts of the rect, lies at the object; y up.
            x = (column + 0.5 - sprite["pivot"]["x"] * width) / 20
            y = (height - row - 0.5 - sprite["pivot"]["y"] * height) / 20
            mx, my = marks[int(name.removeprefix("fire_"))]
            assert x == pytest.approx((mx + 0.5 - px * SIZE[0]) / 20, abs=1e-4)
            assert y == pytest.approx((py * SIZE[1] - my - 0.5) / 20, abs=1e-4)
            found += 1
    assert found == 6


@pytest.mark.parametrize("atlas", [{}, {"max_size": 40}, {"layout": "grid", "padding": 4}])
def test_rects_cut_out_the_frames(atlas: dict[str, Any], tmp_path: Path) -> None:
    draw_marked(tmp_path / "clip", 6)
    made = build(tmp_path, atlas={"pivot": "bottom", "alpha": "straight", **atlas})
    for page in made.glob("*.png"):
        for name, sprite in sprites(made, page.name).items():
            with Image.open(tmp_path / f"clip/{name.removeprefix('fire_')[1:]}.png") as image:
                frame = np.asarray(image)
            shown = cut(made, page.name, sprite)
            x = sprite["pivot"]["x"] * shown.shape[1]
            y = sprite["pivot"]["y"] * shown.shape[0]
            left, bottom = round(SIZE[0] / 2 - x), round(-y)
            top = SIZE[1] - bottom - shown.shape[0]
            np.testing.assert_array_equal(
                shown, frame[top : top + shown.shape[0], left : left + shown.shape[1]]
            )
            frame = frame.copy()
            frame[top : top + shown.shape[0], left : left + shown.shape[1]] = 0
            assert not frame.any()


def test_frames_that_share_pixels_keep_their_own_sprites(tmp_path: Path) -> None:
    draw_marked(tmp_path / "clip", 2)
    shutil.copy(tmp_path / "clip/000.png", tmp_path / "clip/002.png")
    found = sprites(build(tmp_path), "fire.png")
    assert found["fire_0000"]["rect"] == found["fire_0002"]["rect"] != found["fire_0001"]["rect"]
    assert len({sprite["internalID"] for sprite in found.values()}) == 3


def identities(build: Path) -> dict[str, Any]:
    """GUID of every file, and id of every sprite."""
    guids = {p.name: guids_in(p.read_text()) for p in sorted(build.glob("*.meta"))}
    pages = [p.name for p in build.glob("*.png")]
    ids = {name: s["internalID"] for page in pages for name, s in sprites(build, page).items()}
    return {**guids, **ids}


@pytest.mark.parametrize("change", ["frame", "seed", "folder"])
def test_a_rebuild_changes_no_identity(change: str, tmp_path: Path) -> None:
    draw_marked(tmp_path / "clip", 5)
    keys: dict[str, Any] = {"flakes": {}, "atlas": {"alpha": "premultiplied"}}
    made = build(tmp_path, **keys)
    before, pixels = identities(made), (made / "fire.png").read_bytes()
    if change == "frame":
        draw_marked(tmp_path / "clip", 6)
        build(tmp_path, **keys)
    elif change == "seed":
        build(tmp_path, **keys, seed=3)
    else:
        made = tmp_path / "other"
        build(tmp_path, "-o", str(made), **keys)
    after = identities(made)
    assert {name: after[name] for name in before} == before
    assert len(after) == len(before) + (change == "frame")
    assert ((made / "fire.png").read_bytes() == pixels) == (change == "folder")


def test_what_the_editor_writes_into_a_meta_needs_no_build(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    draw_marked(tmp_path / "clip", 3)
    made = build(tmp_path)
    meta = made / "fire.png.meta"
    text = meta.read_text().replace("filterMode: 1", "filterMode: 0")
    meta.write_text(text.replace("\nTextureImporter", "\nlabels:\n- warm\nTextureImporter"))
    before = {path.name: path.stat().st_mtime_ns for path in made.iterdir()}
    assert main(["build", str(tmp_path / "fire.yaml")]) == 0
    assert "up to date" in capsys.readouterr().out
    assert {path.name: path.stat().st_mtime_ns for path in made.iterdir()} == before
    draw_marked(tmp_path / "clip", 4)
    build(tmp_path)
    assert "filterMode: 0" in meta.read_text() and "- warm" in meta.read_text()
    assert len(sprites(made, "fire.png")) == 4


def test_no_meta_is_left_without_its_page(tmp_path: Path) -> None:
    draw_marked(tmp_path / "clip", 6)
    made = build(tmp_path, atlas={"max_size": 40})
    spare = made / "fire-1.png.meta"
    spare.write_text(spare.read_text().replace("filterMode: 1", "filterMode: 0"))
    build(tmp_path)
    assert not spare.exists() and not (made / "fire-1.png").exists()
    assert (made / "fire.png.meta").exists()


def test_a_page_that_a_person_changed_keeps_its_meta(tmp_path: Path) -> None:
    draw_marked(tmp_path / "clip", 6)
    made = build(tmp_path, atlas={"max_size": 40})
    (made / "fire-1.png").write_bytes(b"mine")
    (made / "fire-1.png.meta").write_text((made / "fire-1.png.meta").read_text() + "  mine: 1\n")
    build(tmp_path)
    assert (made / "fire-1.png").exists() and (made / "fire-1.png.meta").exists()


def test_a_material_that_a_person_changed_stays_with_its_meta(tmp_path: Path) -> None:
    draw_marked(tmp_path / "clip", 2)
    made = build(tmp_path, atlas={"alpha": "premultiplied"})
    kept, gone = made / "fire.mat", made / "fire.shader"
    kept.write_text(kept.read_text().replace("r: 1", "r: 0.5"))
    build(tmp_path, atlas={"alpha": "straight"})
    assert kept.exists() and Path(f"{kept}.meta").exists()
    assert not gone.exists() and not Path(f"{gone}.meta").exists()


def test_a_page_keeps_its_identity_without_the_export(tmp_path: Path) -> None:
    draw_marked(tmp_path / "clip", 2)
    made = build(tmp_path)
    build(tmp_path, exports=["json"])
    assert sorted(p.name for p in made.iterdir()) == [
        "fire.json", "fire.manifest.json", "fire.png", "fire.png.meta",
    ]  # fmt: skip


def test_two_recipes_in_one_folder_live_together(tmp_path: Path) -> None:
    draw_marked(tmp_path / "clip", 3)
    keys: dict[str, Any] = {
        "flakes": {}, "exports": [{"unity": {"namespace": "Game.Fire", "assembly": True}}]
    }  # fmt: skip
    for name in ("fire", "my-fire"):
        build(tmp_path, name=name, **keys)
    made = tmp_path / "build"
    guids = [guid for path in made.glob("*.meta") for guid in guids_in(path.read_text())]
    assert len(guids) == len(set(guids)) == len(list(made.glob("*.meta")))
    assert len(list(made.glob("*.asmdef"))) == 1
    assert json.loads((made / "Game.Fire.asmdef").read_text())["name"] == "Game.Fire"


@pytest.mark.parametrize("bake", [True, False])
def test_baked_flakes_are_not_played_as_well(bake: bool, tmp_path: Path) -> None:
    draw_marked(tmp_path / "clip", 3)
    made = build(tmp_path, flakes={"bake": bake})
    behaviour = (made / "fire.prefab").read_text().split("MonoBehaviour:")[1]
    assert f"m_Enabled: {0 if bake else 1}" in behaviour


@pytest.mark.parametrize(
    ("atlas", "advice"),
    [
        ({"rotate": True}, "unity cannot be combined with atlas.rotate"),
        ({"format": "webp"}, "unity does not import atlas.format webp"),
    ],
)
def test_pages_that_unity_cannot_show_are_refused(
    atlas: dict[str, Any], advice: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    draw_marked(tmp_path / "clip", 2)
    both: list[list[Any]] = [["unity"], [{"unity": {}}]]
    for exports in both:
        build(tmp_path, atlas=atlas, exports=exports, code=2)
        assert advice in capsys.readouterr().err
    assert not (tmp_path / "build").exists()


def test_members_share_pages_and_a_prefab(tmp_path: Path) -> None:
    draw_marked(tmp_path / "clip", 3)
    for name in ("fire", "torch"):
        (tmp_path / f"{name}.yaml").write_text(
            json.dumps({"source": {"path": "clip"}, **PLAIN, "flakes": {}})
        )
    (tmp_path / "level.yaml").write_text(
        json.dumps({"atlas": {"members": ["fire.yaml", "torch.yaml"]}, "exports": ["unity"]})
    )
    assert main(["build", "-q", str(tmp_path / "level.yaml")]) == 0
    made = tmp_path / "build"
    assert {p.name for p in made.glob("*.anim")} == {"level.fire.anim", "level.torch.anim"}
    assert set(sprites(made, "level.png")) == {
        f"level_{name}_000{i}" for name in ("fire", "torch") for i in range(3)
    }
    assert (made / "level.flakes.bytes").read_bytes().count(b"torch") == 1


def test_motion_vectors_are_data_and_a_secondary_texture_of_the_page(tmp_path: Path) -> None:
    draw_marked(tmp_path / "clip", 6)
    out = build(tmp_path, maps={"motion": "unity"}, atlas={"layout": "grid"})
    page, motion = ((out / f"fire{kind}.png.meta").read_text() for kind in ("", ".motion"))
    assert faults("fire.png.meta", page) == faults("fire.motion.png.meta", motion) == []
    _, shown = importer(page)
    (secondary,) = shown["spriteSheet"]["secondaryTextures"]
    assert secondary["name"] == "_MotionTex"
    assert secondary["texture"] == {"fileID": 2800000, "guid": guids_in(motion)[0], "type": 3}
    _, data = importer(motion)
    assert data["mipmaps"]["sRGBTexture"] == 0 and data["alphaIsTransparency"] == 0
    assert data["platformSettings"][0]["textureCompression"] == 0
    assert not data["spriteSheet"]["sprites"]


def test_layers_are_cut_like_the_page(tmp_path: Path) -> None:
    draw_marked(tmp_path / "clip", 6)
    out = build(tmp_path, maps={"flame": True, "flakes": True}, flakes={"rate": 50})
    page = sprites(out, "fire.png")
    assert sprites(out, "fire.flame.png") == sprites(out, "fire.flakes.png") == page


def test_haze_is_a_secondary_texture_and_its_material_keeps_what_a_user_sets(
    tmp_path: Path,
) -> None:
    campfire = {"path": str(shipped("samples") / "campfire"), "height": 100, "fps": 24}
    keys: dict[str, Any] = {"source": campfire, "timeline": {"fps": 12}, "maps": {"haze": True}}
    keys |= {"exports": ["unity", "json"], "atlas": {"scales": [1, 0.5]}}
    out = build(tmp_path, **keys)
    page, haze = ((out / f"fire{kind}.png.meta").read_text() for kind in ("", ".haze"))
    assert faults("fire.png.meta", page) == faults("fire.haze.png.meta", haze) == []
    (secondary,) = importer(page)[1]["spriteSheet"]["secondaryTextures"]
    assert secondary["name"] == "_HazeTex"
    assert secondary["texture"]["guid"] == guids_in(haze)[0]
    assert importer(haze)[1]["mipmaps"]["sRGBTexture"] == 0
    shader = (out / "fire.haze.shader.meta").read_text()
    for scale in ("", "@0.5x"):
        atlas = json.loads((out / f"fire{scale}.json").read_text())
        material = (out / f"fire{scale}.haze.mat").read_text()
        assert f"- _Scale: {atlas['meta']['maps'][0]['scale']}\n" in material
        assert guids_in(shader)[0] in material
    edited = material.replace("_Strength: 1", "_Strength: 2.5").replace("_Scale: ", "_Scale: 9")
    (out / "fire@0.5x.haze.mat").write_text(edited)
    build(tmp_path, "--force", **keys)
    again = (out / "fire@0.5x.haze.mat").read_text()
    assert again == material.replace("_Strength: 1", "_Strength: 2.5")

"""Whole builds with smoke, normals and depth: what the files hold, and what is refused."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image, ImageSequence

from fire_atlas.cli import main
from fire_atlas.core.shipped import shipped
from fire_atlas.formats.atlas.texture_packer import read_atlas
from fire_atlas.preview.blend import blend
from fire_atlas.preview.cut_frames import aligned_frames, shown_alpha
from fire_atlas.preview.field_data import FieldData
from fire_atlas.preview.page import preview_page
from tests.maps.test_builds import build, meta, refused, rgba

SILK: dict[str, Any] = {
    "kind": "silk", "width": 64, "height": 80, "rows": 12, "columns": 8, "sheets": {"count": 3},
}  # fmt: skip
STILL: dict[str, Any] = {"flakes": "none", "timeline": {"loop": "none", "frames": 3}}
FORM = {"normals": True, "depth": True}


def explosion(count: int = 12) -> dict[str, Any]:
    return {"path": str(shipped("samples") / "explosion"), "fps": 24, "count": count, "height": 96}


def over(top: NDArray[np.float64], below: NDArray[np.float64], alpha: str) -> NDArray[np.float64]:
    """Blend RGBA (H, W, 4) over RGB, 0..1, as a client does in sRGB."""
    light = top[..., :3] * (top[..., 3:] if alpha == "straight" else 1)
    return np.asarray(light + (1 - top[..., 3:]) * below)


def frames(folder: Path, kind: str | None = None) -> Iterator[NDArray[np.float64]]:
    """Whole frames of the pages, or of a map, (H, W, 4), 0..1."""
    atlas = read_atlas(folder / "fire.json").sheet
    files = [page.file for page in atlas.pages] if kind is None else atlas.map(kind).files
    pages = [rgba(folder / file) / 255 for file in files]
    for region in atlas.regions:
        whole = np.zeros((region.frame_height, region.frame_width, 4))
        x, y, w, h = region.x, region.y, region.width, region.height
        left, top = region.trim_x, region.trim_y
        whole[top : top + h, left : left + w] = pages[region.page][y : y + h, x : x + w]
        yield whole


@pytest.mark.parametrize("alpha", ["straight", "premultiplied"])
def test_page_over_smoke_shows_what_the_page_showed(tmp_path: Path, alpha: str) -> None:
    kept = {**STILL, "source": explosion(), "atlas": {"alpha": alpha}}
    kept["timeline"] = {"loop": "none"}
    plain = build(tmp_path / "plain", **kept)
    split = build(tmp_path / "split", maps={"smoke": True}, **kept)
    seen = 0.0
    for before, fire, smoke in zip(
        frames(plain), frames(split), frames(split, "smoke"), strict=True
    ):
        for wall in (0.0, 0.5, 1.0):
            ground = np.full((*before.shape[:2], 3), wall)
            wanted = over(before, ground, alpha)
            found = over(fire, over(smoke, ground, alpha), alpha)
            # Three bytes are rounded, each by up to half a step.
            assert np.abs(wanted - found).max() < 3 / 255
        seen = max(seen, float(smoke[..., 3].max()))
    assert seen > 0.9


def movie(folder: Path) -> list[NDArray[np.float64]]:
    """The frames of an APNG, RGBA in 0..1."""
    with Image.open(folder / "fire.apng") as image:
        shown = [each.convert("RGBA") for each in ImageSequence.Iterator(image)]
    return [np.asarray(each) / 255 for each in shown]


@pytest.mark.parametrize("space", ["srgb", "linear"])
@pytest.mark.parametrize("alpha", ["straight", "premultiplied"])
def test_preview_and_movies_show_the_fire_over_its_smoke(
    tmp_path: Path, alpha: str, space: str
) -> None:
    keys: dict[str, Any] = {
        "source": explosion(8), "flakes": "none", "timeline": {"loop": "none"},
        "atlas": {"alpha": alpha, "blend_space": space}, "movies": ["apng"],
    }  # fmt: skip
    plain = build(tmp_path / "plain", **keys)
    split = build(tmp_path / "split", maps={"smoke": True}, **keys)
    for background in ((255, 255, 255), (0, 0, 0)):
        one, two = (
            [blend(each, background, alpha, space).astype(int)
             for each in aligned_frames(read_atlas(folder / "fire.json"))]
            for folder in (plain, split)
        )  # fmt: skip
        # A step of dim alpha in linear light is up to 13 steps of the screen (``atlas.encode``).
        off = max(np.abs(a - b).max() for a, b in zip(one, two, strict=True))
        assert off <= (4 if space == "srgb" else 10)
    for before, after in zip(movie(plain), movie(split), strict=True):
        wall = np.ones((*before.shape[:2], 3))
        shown = over(before, wall, "straight") - over(after, wall, "straight")
        assert np.abs(shown).max() < (5 if space == "srgb" else 13) / 255
    page = preview_page(read_atlas(split / "fire.json"), {}, (0, 0, 0), FieldData({}))
    assert b'"composed"' in page


def test_pages_that_are_added_have_smoke_that_hides(tmp_path: Path) -> None:
    made = build(
        tmp_path, maps={"smoke": True}, source=explosion(), atlas={"alpha": "additive"},
        flakes="none",
    )  # fmt: skip
    (entry,) = meta(made)["maps"]
    assert entry == {
        "kind": "smoke", "image": "fire.smoke.png", "alpha": "premultiplied", "under": True,
        "opticalDepth": "-log(1 - a)",
    }  # fmt: skip
    assert not rgba(made / "fire.png")[..., 3].any()
    assert rgba(made / "fire.smoke.png")[..., 3].max() > 230


def test_a_picture_of_added_fire_has_its_smoke_too(tmp_path: Path) -> None:
    keys: dict[str, Any] = {
        "source": explosion(16), "flakes": "none", "atlas": {"alpha": "additive"},
    }  # fmt: skip
    made = build(tmp_path, maps={"smoke": True}, **keys)
    atlas = read_atlas(made / "fire.json")
    alpha = shown_alpha(atlas.sheet)
    white = [blend(each, (255, 255, 255), alpha, "srgb") for each in aligned_frames(atlas)]
    assert alpha == "premultiplied" and min(each.min() for each in white) < 80


def test_flakes_shine_over_the_smoke(tmp_path: Path) -> None:
    keys: dict[str, Any] = {"source": explosion(), "flakes": {"rate": 400, "size": [0.02, 0.03]}}
    made = build(tmp_path, maps={"smoke": True, "flakes": True, "flame": True}, **keys)
    kinds = [each["kind"] for each in meta(made)["maps"]]
    assert kinds == ["flame", "flakes", "smoke"]
    shown = [fire[..., 3].sum() - flame[..., 3].sum()
             for fire, flame in zip(frames(made), frames(made, "flame"), strict=True)]  # fmt: skip
    assert max(shown) > 10, "flakes are on the pages"
    smoke = np.concatenate([each.ravel() for each in frames(made, "smoke")])
    again = build(tmp_path / "still", maps={"smoke": True}, source=explosion(), flakes="none")
    without = np.concatenate([each.ravel() for each in frames(again, "smoke")])
    assert np.array_equal(smoke, without), "and not in the smoke"


def test_soot_is_black_and_the_page_of_silk_stays_as_it_was(tmp_path: Path) -> None:
    keys = {**STILL, "source": {**SILK, "soot": 3}, "atlas": {"alpha": "premultiplied"}}
    plain = build(tmp_path / "plain", **keys)
    sooty = build(tmp_path / "sooty", maps={"smoke": True}, **keys)
    for before, fire, smoke in zip(
        frames(plain), frames(sooty), frames(sooty, "smoke"), strict=True
    ):
        assert np.abs(before - fire).max() <= 1 / 255
        assert not smoke[..., :3].any() and smoke[..., 3].max() > 0.5


def test_form_is_data_that_its_entry_decodes(tmp_path: Path) -> None:
    made = build(tmp_path, maps=FORM, **STILL, source=SILK, atlas={"scales": [1, 0.5]})
    normals, depth = meta(made)["maps"]
    assert (normals["green"], normals["srgb"], depth["srgb"]) == ("up", False, False)
    assert depth["range"]["heights"] == pytest.approx(depth["range"]["pixels"] / 80, rel=1e-4)
    half = meta(made, "fire@0.5x.json")["maps"][1]
    assert half["range"]["pixels"] == pytest.approx(depth["range"]["pixels"] / 2, rel=2e-3)
    for scale in ("", "@0.5x"):
        image = rgba(made / f"fire{scale}.normals.png")
        assert (image[..., 3] == 255).all()
        vectors = image[..., :3] / 255 * 2 - 1
        assert np.abs(np.linalg.norm(vectors, axis=2) - 1).max() < 0.02
        assert (vectors[..., 2] > -0.01).all(), "all face the viewer"
        deep = (rgba(made / f"fire{scale}.depth.png")[..., 0].astype(float) - 128) / 127
        assert 0.9 < np.abs(deep).max() <= 1, "the range is used"


def test_a_profile_has_normals_that_fit_its_depth(tmp_path: Path) -> None:
    """The slopes of its depth, right and up, are those of its normals: it is one column."""
    clip = {"path": str(shipped("samples") / "candle"), "fps": 24, "height": 160}
    made = build(tmp_path, maps=FORM, **STILL, source={"kind": "profile", **clip})
    reach = meta(made)["maps"][1]["range"]["pixels"]
    slopes, leaning = list[list[Any]](), list[list[Any]]()
    for depth, normal, page in zip(
        frames(made, "depth"), frames(made, "normals"), frames(made), strict=True
    ):
        z = cv2.GaussianBlur((depth[..., 0] * 255 - 128) / 127 * reach, (0, 0), 2)
        n = normal[..., :3] * 2 - 1
        inside = (page[..., 3] > 0.5) & (n[..., 2] > 0.5)
        down, right = np.gradient(z)
        slopes.append([right[inside], -down[inside]])
        leaning.append([(-n[..., k] / n[..., 2])[inside] for k in (0, 1)])
    # Upwards it falls by less than a step of the depth from pixel to pixel.
    for k, least in ((0, 0.95), (1, 0.4)):
        slope, turn = (np.concatenate([each[k] for each in both]) for both in (slopes, leaning))
        assert np.corrcoef(slope, turn)[0, 1] > least
        assert np.polyfit(turn, slope, 1)[0] == pytest.approx(1, abs=0.35 if k == 0 else 0.8)


def test_what_has_neither_smoke_nor_form_is_refused_with_advice(tmp_path: Path) -> None:
    said = refused(tmp_path / "flat", maps=FORM)
    assert "maps.normals" in said and "maps.depth" in said and "source.kind: silk" in said
    clip = {"kind": "profile", "path": str(shipped("samples") / "candle"), "fps": 24}
    assert "maps.smoke" in refused(tmp_path / "profile", source=clip, maps={"smoke": True})
    assert "atlas.rotate" in refused(
        tmp_path / "rotated", source=SILK, maps=FORM, atlas={"rotate": True}
    )
    black = tmp_path / "frames"
    black.mkdir()
    for i in range(4):
        light = np.zeros((40, 30, 3), np.uint8)
        light[10:30, 8 + i : 20] = (255, 120, 20)
        Image.fromarray(light).save(black / f"{i}.png")
    source = {"path": str(black), "fps": 12}
    build(tmp_path / "opaque", source=source, maps={"smoke": True}, code=1, **STILL)
    said = (tmp_path / "opaque" / "said.txt").read_text()
    assert "no alpha of their own (matte: luminance)" in said


def test_a_fire_without_smoke_is_told_so(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its fire needs all of its coverage; that of the explosion does not."""
    pure = tmp_path / "frames"
    pure.mkdir()
    for i in range(4):
        light = np.zeros((40, 30, 4), np.uint8)
        light[10:30, 8 + i : 20] = (255, 120, 0, 180)
        Image.fromarray(light).save(pure / f"{i}.png")
    empty, soot = "no smoke was found", "it is the soot in the flame"
    for name, source, told in (
        ("pure", {"path": str(pure), "fps": 12}, [empty]),
        ("explosion", explosion(4), []),
        ("silk", SILK, [soot]),
    ):
        build(tmp_path / name, source=source, maps={"smoke": True}, **STILL)
        assert main(["build", "--force", str(tmp_path / name / "fire.yaml")]) == 0
        said = " ".join(capsys.readouterr().err.split())
        assert [note for note in (empty, soot) if note in said] == told


def test_a_member_without_form_is_named(tmp_path: Path) -> None:
    member = tmp_path / "flat.yaml"
    member.write_text(json.dumps({"source": explosion(2), "flakes": "none"}))
    keys = {**STILL, "source": SILK, "maps": {"normals": True}}
    said = refused(tmp_path, **keys, atlas={"members": ["flat.yaml"]})
    assert "atlas.members" in said and "maps.normals: frames are flat pictures" in said


def test_smoke_and_form_are_the_same_bytes_with_any_number_of_workers(tmp_path: Path) -> None:
    maps = {"smoke": True, **FORM}
    one, two = (
        build(tmp_path / jobs, "--jobs", jobs, maps=maps, source=SILK, **STILL)
        for jobs in ("1", "2")
    )
    for kind in maps:
        name = f"fire.{kind}.png"
        assert (one / name).read_bytes() == (two / name).read_bytes()


def test_unity_has_normals_and_smoke_as_secondary_textures(tmp_path: Path) -> None:
    maps = {"smoke": True, **FORM}
    made = build(tmp_path, maps=maps, source=SILK, **STILL, exports=["json", "unity"])
    page = (made / "fire.png.meta").read_text()
    for kind, name in (("normals", "_NormalMap"), ("smoke", "_SmokeTex")):
        own = (made / f"fire.{kind}.png.meta").read_text()
        guid = own.split("guid: ")[1].split("\n")[0]
        assert f"guid: {guid}" in page and f"name: {name}" in page
    for kind, srgb in (("normals", 0), ("depth", 0), ("smoke", 1)):
        assert f"sRGBTexture: {srgb}" in (made / f"fire.{kind}.png.meta").read_text()

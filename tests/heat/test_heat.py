"""Heat and ramps: what a ramp may be, how well it holds colours, and what builds write."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from fire_atlas.cli import main
from fire_atlas.core.pixels import Bytes
from fire_atlas.core.shipped import shipped
from fire_atlas.formats.atlas.texture_packer import read_atlas
from fire_atlas.heat.encode import heat_of
from fire_atlas.heat.learn import bins_of, learn_ramp, merged
from fire_atlas.heat.ramp import MAX_STEP, luminance_of
from fire_atlas.heat.ready import ramp_of_light, ready_light
from fire_atlas.preview.cut_frames import cut_frames
from fire_atlas.recipe.ramps import READY_RAMPS

SAMPLE = str(shipped("samples") / "campfire")
CLIP = {"path": SAMPLE, "fps": 24, "count": 9, "height": "source"}
PLAIN: dict[str, Any] = {"source": CLIP, "timeline": {"loop": "none"}, "flakes": "none"}
ALL = ["learnt", *READY_RAMPS]


def build(folder: Path, *arguments: str, **recipe: Any) -> Path:
    """Build the plain clip with these sections of a recipe; return the JSON of its atlas."""
    folder.mkdir(parents=True)
    path = folder / "fire.yaml"
    path.write_text(yaml.safe_dump({**PLAIN, **recipe}))
    assert main(["build", str(path), "-q", *arguments]) == 0
    return folder / "build" / "fire.json"


def frames_of(atlas: Path) -> list[Bytes]:
    return list(cut_frames(read_atlas(atlas)))


def assert_is_ramp(ramp: Bytes, alpha: str, blend_space: str) -> None:
    steps = np.abs(np.diff(ramp.astype(int), axis=0))
    assert ramp.shape == (256, 4)
    assert not ramp[0].any()
    assert steps.max() <= MAX_STEP
    assert (np.diff(luminance_of(ramp, alpha, blend_space)) >= 0).all()


@pytest.mark.parametrize("blend_space", ["srgb", "linear"])
@pytest.mark.parametrize("alpha", ["premultiplied", "additive"])
@pytest.mark.parametrize("name", READY_RAMPS)
def test_ready_ramps_never_jump_nor_darken(name: str, alpha: Any, blend_space: Any) -> None:
    for thins in (False, True) if alpha == "premultiplied" else (False,):
        ramp = ramp_of_light(ready_light(name), alpha, blend_space, thins=thins)
        assert_is_ramp(ramp, alpha, blend_space)
        assert ramp[-1, :3].max() > 200


@settings(max_examples=15, deadline=None)
@given(
    st.lists(st.tuples(*[st.integers(0, 255)] * 4), min_size=1, max_size=24),
    st.sampled_from(["premultiplied", "additive"]),
)
def test_ramps_of_any_colours_never_jump_nor_darken(
    colours: list[tuple[int, int, int, int]], alpha: str
) -> None:
    image = np.array([colours], np.uint8)
    assert_is_ramp(learn_ramp(merged([bins_of(image)]), alpha, "srgb"), alpha, "srgb")


def test_colours_of_a_curve_are_held_and_ordered_by_it() -> None:
    at = np.linspace(0, 1, 200)[:, None]
    curve = np.rint(np.hstack([255 * at, 255 * at**1.5, 120 * at**2, 255 * at**0.7]))
    image = curve.astype(np.uint8)[None]
    ramp = learn_ramp(merged([bins_of(image)]), "premultiplied", "srgb")
    heat = heat_of(image, ramp)[0].astype(int)
    assert (np.diff(heat) >= 0).all()
    assert np.abs(ramp[heat].astype(int) - image[0]).max() <= 6


def test_heat_is_the_nearest_entry() -> None:
    chance = np.random.default_rng(4)
    image, ramp = (chance.integers(0, 256, (n, m, 4), np.uint8) for n, m in ((9, 11), (1, 256)))
    heat = heat_of(image, ramp[0])
    away = ((image[:, :, None].astype(int) - ramp[0].astype(int)) ** 2).sum(axis=3)
    assert (np.take_along_axis(away, heat[..., None].astype(int), 2)[..., 0] == away.min(2)).all()


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """The same clip in colours, in heat and in heat4."""
    root, ramp = tmp_path_factory.mktemp("heat"), {"ramp": ALL}
    return {
        "color": build(root / "color", atlas={"alpha": "premultiplied", "layout": "grid"}),
        "heat": build(root / "heat", atlas={"pixels": "heat", "layout": "grid", **ramp}),
        "heat4": build(root / "heat4", atlas={"pixels": "heat4", **ramp}),
    }


def test_heat_gives_back_the_colours(pages: dict[str, Path]) -> None:
    exact = np.concatenate([each.reshape(-1, 4) for each in frames_of(pages["color"])])
    ours = np.concatenate([each.reshape(-1, 4) for each in frames_of(pages["heat"])])
    shown = exact[:, 3] > 2
    error = np.mean((exact[shown].astype(float) - ours[shown]) ** 2)
    psnr = 10 * np.log10(255**2 / error)
    assert psnr > 45
    manifest = json.loads(pages["heat"].with_name("fire.manifest.json").read_text())
    stated = manifest["statistics"]["heat_error"]["fire"]
    assert 20 * np.log10(255 / stated["rms"]) == pytest.approx(psnr, abs=0.3)
    assert stated["off_ramp"] == 0


def test_four_frames_of_heat_lie_in_one_cell(pages: dict[str, Path]) -> None:
    for four, one in zip(frames_of(pages["heat4"]), frames_of(pages["heat"]), strict=True):
        np.testing.assert_array_equal(four, one)
    document = json.loads(pages["heat4"].read_text())
    entries = list(document["frames"].values())
    assert [each["channel"] for each in entries] == list("rgbargbar")
    assert len({str(each["frame"]) for each in entries}) == 3
    assert document["meta"]["fireAtlas"]["heat"] == {
        "pixels": "heat4", "ramp": "fire.ramp.png", "rows": ALL,
    }  # fmt: skip


def test_pages_of_heat_have_one_channel(pages: dict[str, Path]) -> None:
    with Image.open(pages["heat"].with_suffix(".png")) as heat:
        assert heat.mode == "L"
        size = heat.size
    with Image.open(pages["color"].with_suffix(".png")) as colour:
        assert (colour.mode, colour.size) == ("RGBA", size)
    with Image.open(pages["heat"].with_name("fire.ramp.png")) as ramps:
        assert ramps.size == (256, len(ALL))


def test_cells_of_four_frames_divide_a_grid(tmp_path: Path, pages: dict[str, Path]) -> None:
    atlas = build(tmp_path / "grid", atlas={"pixels": "heat4", "layout": "grid"})
    grid = read_atlas(atlas).sheet.grid
    assert grid is not None
    assert grid.columns * grid.rows == 3
    for four, one in zip(frames_of(atlas), frames_of(pages["heat"]), strict=True):
        np.testing.assert_array_equal(four, one)


def test_a_ready_ramp_changes_colours_and_not_heat(tmp_path: Path, pages: dict[str, Path]) -> None:
    atlas = build(tmp_path / "gas", atlas={"pixels": "heat", "layout": "grid", "ramp": "gas"})
    assert atlas.with_suffix(".png").read_bytes() == pages["heat"].with_suffix(".png").read_bytes()
    blue = np.concatenate([each[..., :3].reshape(-1, 3) for each in frames_of(atlas)]).sum(axis=0)
    assert blue[2] > 1.3 * blue[0]


def test_an_image_is_a_ramp(tmp_path: Path) -> None:
    painted = np.zeros((3, 64, 3), np.uint8)
    painted[..., 1] = np.linspace(0, 255, 64)
    Image.fromarray(painted).save(tmp_path / "green.png")
    atlas = build(tmp_path / "x", atlas={"pixels": "heat", "ramp": "../green.png"})
    ramp = np.array(Image.open(atlas.with_name("fire.ramp.png")))[0]
    assert_is_ramp(ramp, "premultiplied", "srgb")
    assert not ramp[:, [0, 2]].any()
    assert ramp[255, 1] > 250
    manifest = json.loads(atlas.with_name("fire.manifest.json").read_text())
    assert any(each["path"].endswith("green.png") for each in manifest["inputs"])


def test_heat_in_webp_and_at_half_size(tmp_path: Path) -> None:
    atlas = {"pixels": "heat", "scales": [1, 0.5], "format": "webp"}
    whole = build(tmp_path / "webp", atlas=atlas)
    png = build(tmp_path / "png", atlas={**atlas, "format": "png"})
    for name in ("fire.json", "fire@0.5x.json"):
        pairs = zip(*(frames_of(each.with_name(name)) for each in (whole, png)), strict=True)
        assert all((a == b).all() and a.any() for a, b in pairs)


def test_the_same_bytes_at_one_and_two_workers(tmp_path: Path) -> None:
    folders = [tmp_path / name for name in ("a", "b")]
    for jobs, folder in enumerate(folders, 1):
        build(folder, "--jobs", str(jobs), atlas={"pixels": "heat4"}, flakes={"rate": 30})
    for name in ("fire.png", "fire.ramp.png", "fire.json"):
        first, second = ((folder / "build" / name).read_bytes() for folder in folders)
        assert first == second


@pytest.mark.parametrize(
    ("recipe", "advice"),
    [
        ({"atlas": {"pixels": "heat"}, "exports": ["css"]}, "would show grey"),
        ({"atlas": {"pixels": "heat", "alpha": "straight"}}, "leave alpha out"),
        ({"atlas": {"ramp": "gas"}}, "set pixels to heat"),
        ({"atlas": {"pixels": "heat4"}, "maps": {"motion": "godot"}}, "set atlas.pixels to heat"),
        ({"atlas": {"pixels": "heat", "ramp": "gaz"}}, "neither a ready ramp"),
        ({"atlas": {"pixels": "heat", "ramp": ["gas", "gas"]}}, "twice"),
    ],
)
def test_what_heat_cannot_do_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], recipe: dict[str, Any], advice: str
) -> None:
    path = tmp_path / "fire.yaml"
    path.write_text(yaml.safe_dump({**PLAIN, **recipe}))
    assert main(["build", str(path), "-q"]) in (1, 2)
    assert advice in " ".join(capsys.readouterr().err.split())


def test_embers_off_the_ramp_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    blue = tmp_path / "blue"
    blue.mkdir()
    for source in sorted(Path(SAMPLE).iterdir())[:8]:
        with Image.open(source) as image:
            pixels = np.array(image.convert("RGBA"))
        pixels[..., :3] = pixels[..., 2::-1]
        Image.fromarray(pixels).save(blue / source.name)
    recipe = {
        "source": {"path": str(blue), "fps": 24, "height": 96},
        "timeline": {"loop": "none"},
        "flakes": {"rate": 400, "colors": ["#ff8000"]},
        "atlas": {"pixels": "heat"},
    }
    path = tmp_path / "fire.yaml"
    path.write_text(yaml.safe_dump(recipe))
    assert main(["build", str(path), "-q"]) == 1
    assert "flakes.bake: false" in capsys.readouterr().err
    path.write_text(yaml.safe_dump({**recipe, "flakes": {"rate": 400, "bake": False}}))
    assert main(["build", str(path), "-q"]) == 0


@pytest.mark.parametrize("bake", [True, False])
def test_what_embers_in_the_pixels_cost_is_stated_with_advice(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], bake: bool
) -> None:
    path = tmp_path / "fire.yaml"
    flakes = {"rate": 400, "bake": bake}
    path.write_text(yaml.safe_dump({**PLAIN, "flakes": flakes, "atlas": {"pixels": "heat"}}))
    assert main(["build", str(path)]) == 0
    built = " ".join("".join(capsys.readouterr()).split())
    assert main(["inspect", str(tmp_path / "build" / "fire.json")]) == 0
    inspected = " ".join("".join(capsys.readouterr()).split())
    for output in (built, inspected):
        assert "one axis of heat holds the colours at" in output
        assert ("flakes.bake: false leaves them" in output) == bake

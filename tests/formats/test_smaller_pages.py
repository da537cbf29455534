"""Lossy pages and pages with palettes: what they may change, what they may not, what is stated."""

import io
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from fire_atlas.cli import main
from fire_atlas.core.pixels import Bytes
from fire_atlas.core.shipped import shipped
from fire_atlas.core.workers import Workers
from fire_atlas.formats.pages.colour_error import measured_error
from fire_atlas.formats.pages.page_file import write_page
from fire_atlas.recipe.output import Atlas

RECIPE: dict[str, Any] = {
    "source": {"path": str(shipped("samples") / "campfire"), "fps": 24, "count": 4, "height": 120},
    "timeline": {"loop": "none"},
    "maps": {"motion": "godot", "flame": True},
}


def pixels(image: Path | bytes) -> Bytes:
    with Image.open(image if isinstance(image, Path) else io.BytesIO(image)) as opened:
        return np.array(opened.convert("RGBA"))


def written(page: Bytes, settings: Atlas, jobs: int = 1, **options: bool) -> bytes:
    file = io.BytesIO()
    with Workers(jobs) as workers:
        write_page(file, page, settings, workers, **options)
    return file.getvalue()


def error_of(lossy: Bytes, lossless: Bytes, straight: bool) -> tuple[float, float]:
    """Return the root mean square over visible pixels, and the largest difference."""
    factor = lossless[..., 3:] / 255 if straight else 1.0
    ours, exact = lossy[..., :3] * factor, lossless[..., :3] * factor
    visible = (lossless[..., 3] > 2) | (ours > 2).any(axis=2) | (exact > 2).any(axis=2)
    squares = (ours - exact)[visible] ** 2
    return float(np.sqrt(squares.mean())), float(np.abs(ours - exact).max())


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the same fire, lossless and lossy, the latter built twice."""
    folder = tmp_path_factory.mktemp("lossy")
    for name, quality, jobs in ("exact", "lossless", 2), ("lossy", 80, 2), ("again", 80, 1):
        recipe = {**RECIPE, "name": "fire", "atlas": {"format": "webp", "quality": quality}}
        (folder / f"{name}.yaml").write_text(json.dumps(recipe), encoding="utf-8")
        out = ["-o", str(folder / name), "--jobs", str(jobs)]
        assert main(["build", str(folder / f"{name}.yaml"), *out, "-q"]) == 0
    return folder


def test_a_lossy_build_changes_colours_alone(built: Path) -> None:
    for name in ("fire", "fire.flame"):
        exact, lossy = (pixels(built / each / f"{name}.webp") for each in ("exact", "lossy"))
        np.testing.assert_array_equal(lossy[..., 3], exact[..., 3])
        assert (lossy != exact).any()
        sizes = [(built / each / f"{name}.webp").stat().st_size for each in ("lossy", "exact")]
        assert sizes[0] < sizes[1] / 2
    vectors = [(built / each / "fire.motion.webp").read_bytes() for each in ("exact", "lossy")]
    assert vectors[0] == vectors[1]


def test_a_lossy_build_gives_the_same_bytes_at_any_number_of_workers(built: Path) -> None:
    for path in sorted((built / "lossy").glob("*.webp")):
        assert path.read_bytes() == (built / "again" / path.name).read_bytes()


def test_manifest_and_inspect_state_the_error(
    built: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    manifest = json.loads((built / "lossy" / "fire.manifest.json").read_text())
    figures = manifest["statistics"]["colour_error"]
    assert sorted(figures) == ["fire.flame.webp", "fire.webp"]
    for name, stated in figures.items():
        recount = error_of(pixels(built / "lossy" / name), pixels(built / "exact" / name), True)
        assert (stated["rms"], stated["largest"]) == pytest.approx(recount, abs=0.06)
    exact = json.loads((built / "exact" / "fire.manifest.json").read_text())
    assert "colour_error" not in exact["statistics"]
    assert main(["inspect", str(built / "lossy" / "fire.json"), "--pages"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    decibels = 20 * np.log10(255 / figures["fire.webp"]["rms"])
    assert f"fire.webp: premultiplied colours differ by {figures['fire.webp']['rms']:.2g}" in said
    assert f"{decibels:.1f} dB" in said


def test_a_build_notes_the_error_and_advises_against_a_large_one(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    noise = np.random.default_rng(5).integers(0, 256, (32, 32, 4), np.uint8)
    Image.fromarray(noise).save(tmp_path / "0.png")
    recipe = {
        "source": {"path": "0.png"}, "flakes": "none", "motion_blur": "none", "tracks": [],
        "timeline": {"loop": "none"}, "atlas": {"format": "webp", "quality": 5},
    }  # fmt: skip
    (tmp_path / "fire.yaml").write_text(json.dumps(recipe), encoding="utf-8")
    assert main(["build", str(tmp_path / "fire.yaml"), "-v"]) == 0
    captured = capsys.readouterr()
    said = " ".join((captured.out + captured.err).split())
    assert "atlas.quality 5: fire.webp: premultiplied colours differ" in said
    assert "raise atlas.quality, or set it to lossless" in said


@pytest.mark.parametrize("alpha", ["straight", "premultiplied", "additive"])
def test_light_and_alpha_survive_however_they_are_stored(alpha: Any) -> None:
    """A soft disc in an empty page: nothing appears where it is not, and alpha is untouched."""
    y, x = np.mgrid[-1:1:96j, -1:1:96j]
    cover = np.clip(1.5 * (0.8 - np.hypot(x, y)), 0, 1)[..., None]
    colour = np.array([255, 160, 40]) * (1 if alpha == "straight" else cover)
    stored = 0 * cover if alpha == "additive" else 255 * cover
    page: Bytes = np.where(cover > 0, np.dstack([colour + 0 * cover, stored]), 0).astype(np.uint8)
    settings = Atlas(format="webp", quality=80, alpha=alpha)
    lossy = pixels(written(page, settings))
    np.testing.assert_array_equal(lossy[..., 3], page[..., 3])
    straight = alpha == "straight"
    with Workers(2) as workers:
        error = measured_error(lossy, page, straight, workers)
    assert (error.rms, error.largest) == pytest.approx(error_of(lossy, page, straight), abs=0.06)
    assert error.psnr > 35
    if not straight:
        assert lossy[np.hypot(x, y) > 0.95][:, :3].max() <= 2
    np.testing.assert_array_equal(pixels(written(page, settings, is_data=True)), page)


def test_pages_without_a_difference_have_no_error() -> None:
    page: Bytes = np.zeros((300, 8, 4), np.uint8)
    with Workers(1) as workers:
        error = measured_error(page, page, True, workers)
    assert (error.rms, error.largest) == (0, 0)
    assert error.sentence() == "premultiplied colours are those of a lossless page"


@pytest.mark.parametrize(("colours", "mode"), [(200, "P"), (256, "P"), (257, "RGBA")])
def test_a_small_png_has_a_palette_of_at_most_256_colours(colours: int, mode: str) -> None:
    pytest.importorskip("oxipng", reason="needs the extra `small`")
    random = np.random.default_rng(colours)
    palette = random.integers(0, 256, (colours, 4), np.uint8)
    palette[:9, 3] = 0  # light without alpha is a colour too
    indices = np.concatenate([np.arange(colours), random.integers(0, colours, 96 * 96 - colours)])
    page: Bytes = palette[indices.reshape(96, 96)]
    small, fast = (written(page, Atlas(compression=each)) for each in ("small", "fast"))
    with Image.open(io.BytesIO(small)) as image:
        assert image.mode == mode
    np.testing.assert_array_equal(pixels(small), page)
    with Image.open(io.BytesIO(fast)) as image:
        assert image.mode == "RGBA"
    assert mode == "RGBA" or len(small) < len(fast) / 3

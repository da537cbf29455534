"""Real footage, sprites and flipbooks."""

import json
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from fire_atlas.core.pixels import linear_to_srgb, unpremultiply
from tests.support import synthetic_fire as fire

MATTES = {
    "cartoon_fluent_fire": "alpha",
    "cartoon_freedoom_fire": "alpha",
    "cartoon_tauran_flame_sheet": "alpha",
    "cartoon_wesnoth_campfire": "alpha",
    "cartoon_wesnoth_fireball_impact": "alpha",
    "real_candle_red": "luminance",
    "real_fireplace_gif": "none",
    "real_firewall_stock": "luminance",
    "sim_unity_flame02": "alpha",
    "sim_unity_flame03": "alpha",
}


@pytest.mark.parametrize(("name", "matte"), MATTES.items())
def test_a_folder_of_frames(name: str, matte: str, clips: Path) -> None:
    about = json.loads((clips / name / "meta.json").read_text())
    clip = fire.open_clip(clips / name / "frames", fps=about["fps"], black=0)
    assert (clip.width, clip.height) == tuple(about["size"])
    assert (clip.count, clip.matte) == (about["frames"], matte), clip.matte_reason
    for i in (0, clip.count // 2, clip.count - 1):
        stored = np.asarray(Image.open(clip.inputs[i]))
        got = clip.read(i)
        shown = linear_to_srgb(unpremultiply(got)) * 255
        if matte == "alpha":
            seen = stored[..., 3] > 0
            assert np.abs(shown - stored[..., :3])[seen].max() < 0.1
            np.testing.assert_allclose(got[..., 3], stored[..., 3] / 255, atol=1e-6)
        else:
            assert np.abs(shown * got[..., 3:] - stored[..., :3]).max() <= 2.01


def test_a_single_frame_of_each_opaque_clip_is_judged_alike(clips: Path) -> None:
    for name in ("real_candle_red", "real_fireplace_gif", "real_firewall_stock"):
        clip = fire.open_clip(clips / name / "frames", start=7, count=1)
        assert clip.matte == MATTES[name], (name, clip.matte_reason)


def test_the_animated_webp_shows_its_frames(clips: Path) -> None:
    clip = fire.open_clip(clips / "cartoon_fluent_fire/original/1f525.webp")
    frames = fire.open_clip(clips / "cartoon_fluent_fire/frames")
    assert (clip.count, clip.matte) == (48, "alpha")
    assert clip.fps == pytest.approx(23.81, abs=0.01)
    for i in (0, 20, 47):
        assert np.abs(clip.read(i) - frames.read(i)).max() < 0.02


def test_the_gif_shows_its_frames(clips: Path) -> None:
    path = clips / "real_fireplace_gif/original/fireplace.gif"
    clip = fire.open_clip(path)
    assert (clip.width, clip.height, clip.count, clip.matte) == (480, 270, 64, "none")
    # At 25.2 frames a second each of its 63 drawings is shown, and one of them twice.
    assert len({clip.read(i).tobytes() for i in range(clip.count)}) == 63
    with Image.open(path) as image:
        for output, stored in ((0, 0), (1, 1), (2, 2), (3, 3)):
            image.seek(stored)
            wanted = fire.light(np.asarray(image.convert("RGBA")))
            np.testing.assert_allclose(clip.read(output), wanted, atol=1e-6)


@pytest.mark.parametrize(
    ("name", "count"),
    [
        ("real_firewall_stock/original/fire.mp4", 250),
        ("real_firewall_stock/clip.mp4", 40),
        ("real_candle_red/clip.mp4", 40),
    ],
)
def test_the_videos_are_read_whole(name: str, count: int, clips: Path) -> None:
    clip = fire.open_clip(clips / name)
    assert (clip.count, clip.fps, clip.matte) == (count, 25, "luminance"), clip.matte_reason
    if count == 40:
        still = fire.open_clip(clips / name.split("/")[0] / "frames")
        for i in (0, 20, 39):
            assert np.abs(clip.read(i)[..., 3] - still.read(i)[..., 3]).mean() < 0.02


@pytest.mark.parametrize(
    ("name", "columns", "rows"),
    [
        ("cartoon_tauran_flame_sheet/original/flame.png", 12, 6),
        ("sim_unity_flame03/original/Flame03_16x4.png", 16, 4),
    ],
)
def test_the_sheets_are_cut_where_their_cells_lie(
    name: str, columns: int, rows: int, clips: Path
) -> None:
    clip = fire.open_clip(clips / name, grid={"columns": columns, "rows": rows})
    frames = fire.open_clip(clips / name.split("/")[0] / "frames")
    assert (clip.width, clip.height) == (frames.width, frames.height)
    assert clip.count == frames.count
    for i in range(clip.count):
        assert np.abs(clip.read(i) - frames.read(i)).mean() < 0.004


@pytest.mark.parametrize(
    ("name", "spared"),
    [
        ("real_candle_red", 0.5), ("cartoon_tauran_flame_sheet", 0.3),
        ("cartoon_fluent_fire", 0.15), ("cartoon_wesnoth_fireball_impact", 0.1),
        ("real_fireplace_gif", 0.0), ("real_firewall_stock", 0.0),
    ],
)  # fmt: skip
def test_crop_auto_cuts_off_no_flame(name: str, spared: float, clips: Path) -> None:
    folder = clips / name / "frames"
    whole, part = fire.open_clip(folder), fire.open_clip(folder, crop="auto")
    left, top, width, height = json.loads(part.notes[0].partition(": ")[2].partition(" holds")[0])
    assert (part.width, part.height, part.matte) == (width, height, whole.matte)
    for file in whole.inputs:
        rows, columns = np.nonzero(flame_colours(np.asarray(Image.open(file).convert("RGBA"))))
        assert not rows.size or (top <= rows.min() and rows.max() < top + height), file
        assert not columns.size or (left <= columns.min() and columns.max() < left + width), file
    assert 1 - width * height / (whole.width * whole.height) >= spared


@pytest.mark.parametrize("name", ["real_candle_red", "real_firewall_stock"])
@pytest.mark.parametrize("form", ["frames", "clip.mp4"])
def test_crop_auto_of_fire_on_black_shows_no_edge(name: str, form: str, clips: Path) -> None:
    clip = fire.open_clip(clips / name / form, crop="auto")
    for i in range(clip.count):
        alpha = clip.read(i)[..., 3]
        for side in (alpha[0], alpha[-1], alpha[:, 0], alpha[:, -1]):
            assert side.max() <= 2 / 255


def flame_colours(picture: fire.Rgba) -> NDArray[np.bool_]:
    """Pixels of the colours of flame, by the rule of Chen et al. (2004), or white-hot, (H, W)."""
    red, green, blue, alpha = (picture[..., channel].astype(int) for channel in range(4))
    coloured = (red > 125) & (red >= green) & (green > blue)
    return np.asarray((alpha > 0) & (coloured | (np.minimum(green, red) > 220)), np.bool_)

"""``preview`` and ``inspect``: what was built, looked at from its files."""

import io
import json
import os
import re
from collections.abc import Callable
from pathlib import Path
from subprocess import CompletedProcess
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image, ImageSequence

from fire_atlas.cli import main
from fire_atlas.core.errors import FireAtlasError, SourceError
from fire_atlas.core.pixels import linear_to_srgb, srgb_to_linear
from fire_atlas.formats.atlas.texture_packer import read_atlas
from fire_atlas.formats.movies.movie import schedule
from fire_atlas.preview.blend import blend
from fire_atlas.preview.cut_frames import cut_frames
from fire_atlas.preview.kinds import PreviewKind, is_preview
from fire_atlas.preview.pictures import AnimationKind, animated_image, contact_sheet

Run = Callable[..., CompletedProcess[str]]


@pytest.fixture
def atlas(tmp_path: Path) -> Path:
    """Two pages: frames 0 and 1 on the first, frame 2 (not trimmed) on the second."""
    page = np.zeros((16, 16, 4), np.uint8)
    page[0:4, 0:6] = (255, 0, 0, 255)
    page[8:12, 2:8] = (0, 255, 0, 128)
    Image.fromarray(page).save(tmp_path / "fire.png")
    Image.fromarray(np.full((8, 10, 4), 200, np.uint8)).save(tmp_path / "fire-1.png")

    def frame(x: int, y: int, w: int, h: int, trim_x: int, trim_y: int) -> dict[str, Any]:
        return {
            "frame": {"x": x, "y": y, "w": w, "h": h},
            "spriteSourceSize": {"x": trim_x, "y": trim_y, "w": w, "h": h},
            "sourceSize": {"w": 10, "h": 8},
            "duration": 41.667,
        }

    def document(page: int, size: tuple[int, int], frames: dict[str, Any]) -> dict[str, Any]:
        return {
            "frames": frames,
            "animations": {"fire": list(frames)},
            "meta": {
                "image": f"fire{'-1' * page}.png",
                "size": {"w": size[0], "h": size[1]},
                "fireAtlas": {"alpha": "straight", "blendSpace": "srgb"},
            },
        }

    places = {"fire/0000": frame(0, 0, 6, 4, 1, 2), "fire/0001": frame(2, 8, 6, 4, 4, 4)}
    first = document(0, (16, 16), places)
    first["meta"]["related_multi_packs"] = ["fire-1.json"]
    second = document(1, (10, 8), {"fire/0002": frame(0, 0, 10, 8, 0, 0)})
    (tmp_path / "fire.json").write_text(json.dumps(first))
    (tmp_path / "fire-1.json").write_text(json.dumps(second))
    return tmp_path / "fire.json"


def edited(atlas: Path, change: Callable[[dict[str, Any]], object]) -> Path:
    document = json.loads(atlas.read_text())
    change(document)
    atlas.write_text(json.dumps(document))
    return atlas


def test_frames_are_cut_out_at_their_full_size_across_pages(atlas: Path) -> None:
    frames = list(cut_frames(read_atlas(atlas)))
    assert [frame.shape for frame in frames] == [(8, 10, 4)] * 3
    expected = np.zeros((8, 10, 4), np.uint8)
    expected[2:6, 1:7] = (255, 0, 0, 255)
    np.testing.assert_array_equal(frames[0], expected)
    assert frames[1][4:8, 4:10, 1].min() == 255
    assert frames[2].min() == 200


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda d: d.pop("animations"), "is not an atlas that fire-atlas wrote"),
        (lambda d: d["meta"].pop("fireAtlas"), "is not an atlas that fire-atlas wrote"),
        (lambda d: d.update(frames=[]), "is not an atlas that fire-atlas wrote"),
        (lambda d: d["meta"].update(image="../secret.png"), "is not a plain file name"),
        (
            lambda d: d["meta"].update(related_multi_packs=["/etc/x.json"]),
            "is not a plain file name",
        ),
        (lambda d: d["meta"].update(image="gone.png"), "gone.png: the page cannot be read"),
        (lambda d: d["meta"]["size"].update(w=99), "is 16x16, but the atlas says 99x16"),
        (lambda d: d["frames"]["fire/0000"]["frame"].update(x=12), "lies outside of its page"),
        (lambda d: d["frames"]["fire/0000"]["frame"].update(x=-2), "-2 is not a number from 0"),
        (lambda d: d["frames"]["fire/0001"]["spriteSourceSize"].update(y=5), "its own frame"),
    ],
)
def test_a_damaged_atlas_is_refused_with_a_reason(
    atlas: Path, change: Callable[[dict[str, Any]], object], message: str
) -> None:
    with pytest.raises(SourceError, match=message):
        list(cut_frames(read_atlas(edited(atlas, change))))


@pytest.mark.parametrize(
    ("name", "text", "code"),
    [("gone.json", None, 2), ("fire.yaml", "a: 1", 2), ("x.json", "{", 1), ("x.json", "[]", 1)],
)
def test_what_is_no_atlas_is_refused(
    tmp_path: Path, name: str, text: str | None, code: int
) -> None:
    if text is not None:
        (tmp_path / name).write_text(text)
    with pytest.raises(FireAtlasError, match=name) as caught:
        read_atlas(tmp_path / name)
    assert caught.value.exit_code == code


@pytest.mark.parametrize("blend_space", ["srgb", "linear"])
@pytest.mark.parametrize("alpha", ["straight", "premultiplied", "additive"])
def test_frames_are_blended_as_their_client_does(alpha: str, blend_space: str) -> None:
    rng = np.random.default_rng(1)
    frame = rng.integers(0, 256, (5, 7, 4), np.uint8)
    colour = np.asarray(frame[..., :3] / 255, np.float32)
    behind = np.asarray([16 / 255, 32 / 255, 200 / 255], np.float32)
    cover = frame[..., 3:] / 255
    if blend_space == "linear":
        colour, behind = srgb_to_linear(colour), srgb_to_linear(behind)
    expected = {
        "straight": colour * cover + behind * (1 - cover),
        "premultiplied": colour + behind * (1 - cover),
        "additive": colour + behind,
    }[alpha].clip(0, 1)
    if blend_space == "linear":
        expected = linear_to_srgb(expected)
    shown = blend(frame, (16, 32, 200), alpha, blend_space)
    assert shown.dtype == np.uint8
    assert np.abs(shown - expected * 255).max() <= 1


@given(
    st.lists(st.floats(0.1, 200), min_size=1, max_size=60),
    st.sampled_from([(10, 20), (1, 1)]),
)
def test_rounded_durations_keep_time(durations: list[float], format_: tuple[int, int]) -> None:
    tick, least = format_
    shown = schedule(durations, tick, least)
    assert all(length >= least and length % tick == 0 for _, length in shown)
    ends = np.cumsum(durations)
    if ends[-1] >= least + tick:
        end = 0
        for i, length in shown:
            end += length
            assert abs(end - ends[i]) <= tick / 2 + 1e-6
        assert abs(end - ends[-1]) < least + tick


@pytest.mark.parametrize(("kind", "name"), [("gif", "GIF"), ("webp", "WEBP"), ("apng", "PNG")])
def test_an_animation_has_every_frame_at_its_time(atlas: Path, kind: Any, name: str) -> None:
    with Image.open(io.BytesIO(animated_image(read_atlas(atlas), kind, (0, 0, 64)))) as picture:
        assert picture.format == name
        durations, colours = [], []
        for frame in ImageSequence.Iterator(picture):
            rgb = frame.convert("RGB")
            durations.append(frame.info["duration"])
            colours.append([rgb.getpixel((3, 3)), rgb.getpixel((9, 7)), rgb.getpixel((0, 0))])
    assert sum(durations) == pytest.approx(125, abs=5)
    assert len(durations) == 3
    night, half = (0, 0, 64), (0, 128, 32)
    mixed = (157, 157, 171)  # 200 · 200/255 + background · 55/255
    expected = [[(255, 0, 0), night, night], [night, half, night], [mixed] * 3]
    assert np.abs(np.array(colours) - np.array(expected)).max() <= 1


@pytest.mark.parametrize("kind", ["gif", "webp", "apng"])
@pytest.mark.parametrize(
    ("options", "nothing", "half"),
    [
        ([], (16, 16, 20, 255), (8, 136, 10, 255)),
        (["--background", "#000040"], (0, 0, 64, 255), (0, 128, 32, 255)),
        (["--background", "transparent"], (0, 0, 0, 0), (0, 255, 0, 128)),
    ],
)
def test_a_picture_has_a_dark_background_unless_another_or_none_is_asked_for(
    kind: str,
    options: list[str],
    nothing: tuple[int, ...],
    half: tuple[int, ...],
    run: Run,
    atlas: Path,
) -> None:
    """The second frame has 24 px of green that covers half."""
    assert run("preview", atlas.name, f"--{kind}", "-o", "fire", *options).returncode == 0
    with Image.open(atlas.with_name("fire")) as picture:
        picture.seek(1)
        pixels = np.asarray(picture.convert("RGBA")).astype(int)
    outside, inside = pixels[0, 0], pixels[4:8, 4:10]
    if nothing[3]:
        assert np.abs(outside - nothing).max() <= 1
    else:
        assert outside[3] == 0
    if kind == "gif" and "transparent" in options:  # which has dots instead
        dots = inside[..., 3] == 255
        assert 8 <= dots.sum() <= 16
        assert (inside[dots] == (0, 255, 0, 255)).all()
    else:
        assert np.abs(inside - half).max() <= 1


def test_a_contact_sheet_shows_a_dozen_frames_and_their_flakes(run: Run, campfire: Path) -> None:
    run("build", campfire.name, "-q")
    result = run("preview", "build/campfire.json", "--sheet", "-o", "sheet.png")
    assert result.stdout == "sheet.png: 6 frames\n"
    with Image.open(campfire.with_name("sheet.png")) as sheet:
        pixels = np.asarray(sheet.convert("RGB"), np.int64)
    assert pixels.shape == (2 * 36 + 20, 6 * 28 + 4, 3)
    assert tuple(pixels[0, 0]) == (16, 16, 20)
    flakes_of_last_frame = pixels[20:52, -28:-4]
    assert flakes_of_last_frame.max() > 100
    assert flakes_of_last_frame[0, 0].max() == 0


def test_the_sheet_of_a_recipe_begins_with_the_frames_as_they_came_in(
    run: Run, campfire: Path
) -> None:
    run("preview", campfire.name, "--sheet", "-q", "-o", "sheet.png", "--set", "flakes.rate=900")
    with Image.open(campfire.with_name("sheet.png")) as sheet:
        pixels = np.asarray(sheet.convert("RGB"), np.int64)
    assert pixels.shape == (3 * 36 + 20, 6 * 28 + 4, 3)
    frames, flakes, result = (pixels[20 + 36 * i : 52 + 36 * i] for i in range(3))
    changed = np.abs(result - frames).max(axis=2) > 8
    assert changed.any()
    assert (flakes.max(axis=2) > 0)[changed].all()


def test_a_sheet_without_tracks_has_one_row(atlas: Path) -> None:
    with Image.open(io.BytesIO(contact_sheet(read_atlas(atlas), None, None, (0, 0, 0)))) as sheet:
        assert sheet.size == (3 * 14 + 4, 12 + 20)


def test_a_recipe_is_built_for_its_preview_and_nothing_else_stays(run: Run, campfire: Path) -> None:
    before = set(campfire.parent.rglob("*"))
    result = run("preview", campfire.name, "--gif", "-q", "--set", "exports=[]")
    assert (result.returncode, result.stdout, result.stderr) == (0, "", "")
    made = set(campfire.parent.rglob("*")) - before
    build = campfire.parent / "build"
    assert made == {build, build / "campfire.preview.gif"}


@pytest.mark.slow
def test_a_file_that_is_there_is_replaced_only_when_that_is_asked_for(
    run: Run, campfire: Path
) -> None:
    folder = campfire.parent
    (folder / "build").mkdir()
    mine = {
        "build/campfire.preview.html": "--",
        "build/campfire.preview.gif": "--gif",
        "x.png": "--apng",
    }
    for name, kind in mine.items():
        (folder / name).write_text("<html>mine</html>")
        end = ["-o", name] if name == "x.png" else []
        line = ["preview", campfire.name, "-q", *end, *([kind] if kind != "--" else [])]
        result = run(*line)
        assert result.returncode == 1 and f"{name}: exists already" in result.stderr
        assert "--overwrite" in result.stderr and "Traceback" not in result.stderr
        assert (folder / name).read_text() == "<html>mine</html>"
        assert run(*line, "--overwrite").returncode == 0
        assert (folder / name).read_bytes() != b"<html>mine</html>"


@pytest.mark.parametrize("comes", ["before", "meanwhile"])
def test_a_pipe_or_a_file_that_comes_meanwhile_is_not_replaced(
    comes: str, atlas: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    target, make = atlas.with_name("x.png"), animated_image

    def make_while_another_writes(*arguments: Any) -> bytes:
        target.write_text("mine")
        return make(*arguments)

    if comes == "before":
        os.mkfifo(target)
    else:
        monkeypatch.setattr("fire_atlas.preview.kinds.animated_image", make_while_another_writes)
    assert main(["preview", str(atlas), "--apng", "-o", str(target)]) == 1
    assert "x.png: exists already" in capsys.readouterr().err
    assert target.is_fifo() if comes == "before" else target.read_text() == "mine"


def test_a_page_that_an_earlier_preview_made_is_replaced(run: Run, campfire: Path) -> None:
    for seed in (1, 2):
        result = run("preview", campfire.name, "-q", "--set", f"seed={seed}")
        assert (result.returncode, result.stderr) == (0, "")


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["fire.json", "--gif", "--background", "fog"], 2, "error: --background fog: must be a"),
        (["fire.json", "--background", "transparent"], 2, "transparent: is for animated pictures"),
        (["fire.json", "--sheet", "--background", "transparent"], 2, "name a colour"),
        (["fire.json", "--gif", "--set", "seed=1"], 2, "error: --set needs a recipe"),
        (["none.json", "--gif"], 2, "error: none.json: cannot be read"),
        (["fire.json", "--gif", "-o", "no/fire.gif"], 1, "fire.gif: cannot be written"),
        (["fire.json", "--gif", "-o", "."], 1, "error: .: is a folder; name the file in it"),
    ],
)
def test_bad_previews_are_explained(
    run: Run, atlas: Path, arguments: list[str], code: int, message: str
) -> None:
    result = run("preview", *arguments)
    assert result.returncode == code
    assert message in result.stderr
    assert "Traceback" not in result.stderr


@pytest.mark.parametrize("kind", ["page", "gif", "webp", "apng", "sheet"])
def test_an_earlier_preview_is_replaced_and_nothing_else(
    run: Run, atlas: Path, kind: PreviewKind
) -> None:
    options = [] if kind == "page" else [f"--{kind}"]
    assert run("preview", atlas.name, *options).returncode == 0
    (target,) = atlas.parent.glob("fire.preview*")
    first = target.read_bytes()
    assert is_preview(target, kind)
    assert run("preview", atlas.name, *options, "--background", "white").returncode == 0
    assert target.read_bytes() != first
    target.write_bytes(first.replace(b"fire-atlas", b"FIRE-ATLAS"))
    refused = run("preview", atlas.name, *options)
    assert refused.returncode == 1 and "--overwrite" in refused.stderr


@pytest.mark.parametrize("kind", ["gif", "webp", "apng"])
def test_a_signed_picture_plays_as_before(atlas: Path, kind: AnimationKind) -> None:
    with Image.open(io.BytesIO(animated_image(read_atlas(atlas), kind, (0, 0, 0)))) as picture:
        assert getattr(picture, "n_frames", 1) == 3
        for frame in ImageSequence.Iterator(picture):
            frame.load()


def test_inspect_prints_pages_frames_and_flakes(run: Run, campfire: Path) -> None:
    run("build", campfire.name, "-q")
    stated = run("inspect", "build/campfire.json", "--pages", "--frames", "--flakes").stdout
    for word in ("campfire.png", "occupancy", "24 x 32", "0.50 s", "12", "born", "heights/s"):
        assert word in stated


def test_inspect_tells_of_the_flakes_of_every_animation(run: Run, campfire: Path) -> None:
    text = campfire.read_text().replace("rate: 200", "rate: 90")
    campfire.with_name("torch.yaml").write_text(f"{text}atlas: {{members: [campfire.yaml]}}\n")
    run("build", "torch.yaml", "-q")
    stated = run("inspect", "build/torch.json", "--flakes").stdout
    for name in ("torch", "campfire"):
        assert re.search(f"^{name} +born ", stated, re.M)


def test_inspect_counts_frames_page_by_page(run: Run, atlas: Path) -> None:
    stated = run("inspect", atlas.name, "--pages", "--frames").stdout
    assert "18.8 %" in stated
    assert "100.0 %" in stated
    assert "2, to 6 x 4" in stated
    assert "flakes" not in run("inspect", atlas.name).stdout.replace("--flakes", "")


def test_broken_tracks_are_refused(run: Run, atlas: Path) -> None:
    atlas.with_name("fire.flakes.json").write_text('{"columns": []}')
    result = run("inspect", atlas.name)
    assert result.returncode == 1
    assert "fire.flakes.json: is not a file of flake tracks that fire-atlas wrote" in result.stderr

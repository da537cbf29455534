"""Broken clips: a message that helps, the previous outputs whole, nothing left lying about."""

import struct
import time
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from .desk import Desk, contents


def assert_refused(desk: Desk, recipe: Path, *words: str, code: int = 1) -> None:
    """Check that the build fails for a person to understand, and leaves things as they were."""
    before = contents(desk.build) if desk.build.exists() else None
    ran = desk.run("build", recipe)
    assert ran.code == code, ran.err
    assert ran.err.count("error: ") == 1, ran.err
    for word in words:
        assert word in ran.err, ran.err
    assert "Traceback" not in ran.err and "bug in fire-atlas" not in ran.err
    assert (contents(desk.build) if desk.build.exists() else None) == before


def truncate(clip: Path) -> None:
    frame = clip / "0003.png"
    frame.write_bytes(frame.read_bytes()[:-400])


def write_text(clip: Path) -> None:
    (clip / "0003.png").write_text("I am no picture", encoding="utf-8")


def write_nothing(clip: Path) -> None:
    (clip / "0003.png").write_bytes(b"")


def resize(clip: Path) -> None:
    Image.new("RGBA", (60, 80)).save(clip / "0003.png")


def hide_a_folder(clip: Path) -> None:
    (clip / "0003.png").unlink()
    (clip / "0003.png").mkdir()


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (truncate, ["truncated", "export it again"]),
        (write_text, ["not an image"]),
        (write_nothing, ["empty"]),
        (resize, ["60x80", "64x80", "one size"]),
        (hide_a_folder, ["folder"]),
    ],
)
@pytest.mark.parametrize("built_before", [True, False])
def test_a_broken_frame_is_named_and_nothing_is_touched(
    desk: Desk, spoil: Callable[[Path], None], words: list[str], built_before: bool
) -> None:
    clip = desk.clip()
    recipe = desk.recipe()
    if built_before:
        desk.built(recipe)
    spoil(clip)
    assert_refused(desk, recipe, "0003.png", *words)


def test_a_missing_clip_is_told_with_what_is_there(desk: Desk) -> None:
    desk.clip(name="campfire")
    assert_refused(desk, desk.recipe(path="campfir"), "campfir: does not exist", "'campfire'")


def test_a_clip_that_vanished_after_a_build_is_told(desk: Desk) -> None:
    clip = desk.clip()
    recipe = desk.recipe()
    desk.built(recipe)
    clip.rename(desk.folder / "clips")
    assert_refused(desk, recipe, "clip: does not exist", "'clips'")


def test_an_empty_folder_is_told(desk: Desk) -> None:
    (desk.folder / "clip").mkdir()
    assert_refused(desk, desk.recipe(), "clip: the folder is empty")


def huge_png(side: int) -> bytes:
    """Return a PNG of side² grey pixels, none of which has to be written down."""

    def chunk(name: bytes, body: bytes) -> bytes:
        checksum = zlib.crc32(name + body)
        return struct.pack(">I", len(body)) + name + body + struct.pack(">I", checksum)

    header = struct.pack(">IIBBBBB", side, side, 8, 0, 0, 0, 0)
    pixels = zlib.compress(bytes(1 << 20), 9)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", pixels)


def test_a_picture_too_large_is_refused_at_once(desk: Desk) -> None:
    (desk.folder / "clip").mkdir()
    (desk.folder / "clip" / "0000.png").write_bytes(huge_png(30_000))
    start = time.perf_counter()
    assert_refused(desk, desk.recipe(), "0000.png", "30000x30000", "limits")
    assert time.perf_counter() - start < 2


def test_a_frame_that_fits_no_page_is_told(desk: Desk) -> None:
    desk.clip()
    recipe = desk.recipe(atlas={"max_size": 16})
    assert_refused(desk, recipe, "max_size", code=1)


def test_an_invalid_recipe_is_told_before_anything_is_made(desk: Desk) -> None:
    desk.clip()
    assert_refused(desk, desk.recipe(flakes={"rte": 3}), "fire.yaml", "flakes.rte", code=2)
    assert not desk.build.exists()


def test_one_broken_recipe_of_two_does_not_stop_the_other(desk: Desk) -> None:
    desk.clip()
    recipes = [desk.recipe("bad.yaml", path="nowhere"), desk.recipe("good.yaml")]
    ran = desk.run("build", *recipes)
    assert ran.code == 1 and "nowhere" in ran.err
    assert (desk.build / "good.png").exists()
    assert not any(path.name.startswith("bad") for path in desk.build.iterdir())


def test_outputs_never_replace_what_they_are_made_from(desk: Desk) -> None:
    """``-o .`` beside a sheet of the recipe's own name."""
    sheet = np.zeros((20, 40, 4), np.uint8)
    sheet[4:16, 4:36] = (255, 160, 40, 255)
    Image.fromarray(sheet).save(desk.folder / "fire.png")
    before = (desk.folder / "fire.png").read_bytes()
    source = {"path": "fire.png", "grid": {"columns": 2, "rows": 1}}
    ran = desk.run("build", desk.recipe(source=source), "-o", desk.folder)
    assert ran.code == 1
    assert "fire.png: would be written over" in ran.err and "`name`" in ran.err
    assert (desk.folder / "fire.png").read_bytes() == before
    assert sorted(contents(desk.folder)) == ["fire.png", "fire.yaml"]

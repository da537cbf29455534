"""Broken clips: a message that helps, the previous outputs whole, nothing left lying about."""

import struct
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.support.repo import Repo, contents


def assert_refused(repo: Repo, recipe: Path, *words: str, code: int = 1) -> None:
    """Check that the build fails for a person to understand, and leaves things as they were."""
    before = contents(repo.build) if repo.build.exists() else None
    ran = repo.run("build", recipe)
    assert ran.code == code, ran.err
    assert ran.err.count("error: ") == 1, ran.err
    for word in words:
        assert word in ran.err, ran.err
    assert "Traceback" not in ran.err and "bug in fire-atlas" not in ran.err
    assert (contents(repo.build) if repo.build.exists() else None) == before


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
    repo: Repo, spoil: Callable[[Path], None], words: list[str], built_before: bool
) -> None:
    clip = repo.clip()
    recipe = repo.recipe()
    if built_before:
        repo.built(recipe)
    spoil(clip)
    assert_refused(repo, recipe, "0003.png", *words)


def test_a_missing_clip_is_reported_with_what_is_there(repo: Repo) -> None:
    repo.clip(name="campfire")
    assert_refused(repo, repo.recipe(path="campfir"), "campfir: does not exist", "'campfire'")


def test_a_clip_that_vanished_after_a_build_is_reported(repo: Repo) -> None:
    clip = repo.clip()
    recipe = repo.recipe()
    repo.built(recipe)
    clip.rename(repo.folder / "clips")
    assert_refused(repo, recipe, "clip: does not exist", "'clips'")


def test_an_empty_folder_is_reported(repo: Repo) -> None:
    (repo.folder / "clip").mkdir()
    assert_refused(repo, repo.recipe(), "clip: the folder is empty")


def huge_png(side: int) -> bytes:
    """Return a PNG of side² grey pixels by its header, which breaks off after a mebibyte."""

    def chunk(name: bytes, body: bytes) -> bytes:
        checksum = zlib.crc32(name + body)
        return struct.pack(">I", len(body)) + name + body + struct.pack(">I", checksum)

    header = struct.pack(">IIBBBBB", side, side, 8, 0, 0, 0, 0)
    pixels = zlib.compress(bytes(1 << 20), 9)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", pixels)


def test_a_picture_too_large_is_refused_by_its_header_alone(repo: Repo) -> None:
    (repo.folder / "clip").mkdir()
    (repo.folder / "clip" / "0000.png").write_bytes(huge_png(30_000))
    assert_refused(repo, repo.recipe(), "0000.png", "30000x30000", "limits")


def test_a_frame_that_fits_no_page_is_reported(repo: Repo) -> None:
    repo.clip()
    recipe = repo.recipe(atlas={"max_size": 16})
    assert_refused(repo, recipe, "max_size", code=1)


def test_an_invalid_recipe_is_reported_before_anything_is_made(repo: Repo) -> None:
    repo.clip()
    assert_refused(repo, repo.recipe(flakes={"rte": 3}), "fire.yaml", "flakes.rte", code=2)
    assert not repo.build.exists()


def test_one_broken_recipe_of_two_does_not_stop_the_other(repo: Repo) -> None:
    repo.clip()
    recipes = [repo.recipe("bad.yaml", path="nowhere"), repo.recipe("good.yaml")]
    ran = repo.run("build", *recipes)
    assert ran.code == 1 and "nowhere" in ran.err
    assert (repo.build / "good.png").exists()
    assert not any(path.name.startswith("bad") for path in repo.build.iterdir())


def test_outputs_never_replace_what_they_are_made_from(repo: Repo) -> None:
    """``-o .`` beside a sheet of the recipe's own name."""
    sheet = np.zeros((20, 40, 4), np.uint8)
    sheet[4:16, 4:36] = (255, 160, 40, 255)
    Image.fromarray(sheet).save(repo.folder / "fire.png")
    before = (repo.folder / "fire.png").read_bytes()
    source = {"path": "fire.png", "grid": {"columns": 2, "rows": 1}}
    ran = repo.run("build", repo.recipe(source=source), "-o", repo.folder)
    assert ran.code == 1
    assert "fire.png: is an input and would be overwritten" in ran.err and "`name`" in ran.err
    assert (repo.folder / "fire.png").read_bytes() == before
    assert sorted(contents(repo.folder)) == ["fire.png", "fire.yaml"]

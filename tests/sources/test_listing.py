"""Which files a clip is made of, their order, and what is said when they are not there."""

import glob
import random
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from fire_atlas.core.errors import SourceError
from fire_atlas.core.files import natural_key
from fire_atlas.recipe.source import FramesSource
from fire_atlas.sources import listing
from tests.support import synthetic_fire as fire


def inputs(path: Path, **settings: object) -> list[Path]:
    return listing.list_inputs(FramesSource.model_validate({"path": str(path), **settings}), path)


def touch(folder: Path, *names: str) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    for name in names:
        (folder / name).touch()
    return folder


def test_numbers_in_names_count_as_numbers(tmp_path: Path) -> None:
    names = ["fire1.png", "fire2.png", "fire10.png", "Fire11.png", "fire100.png", "flame1.png"]
    shuffled = random.Random(1).sample(names, len(names))
    touch(tmp_path / "f", *shuffled)
    assert [p.name for p in inputs(tmp_path / "f")] == names
    assert [p.name for p in inputs(tmp_path / "f" / "*")] == names


def test_names_without_padding_and_with_mix_in_one_order() -> None:
    paths = [Path(n) for n in ("a10", "a9b", "a9", "a09", "9", "b", "a", "A9")]
    ordered = sorted(paths, key=natural_key)
    assert [str(p) for p in ordered] == ["9", "a", "A9", "a09", "a9", "a9b", "a10", "b"]


def test_hidden_files_and_other_files_are_left_out(tmp_path: Path) -> None:
    touch(tmp_path / "f", ".fire0.png", "fire1.png", "fire1.png.import", "notes.txt", "Thumbs.db")
    assert [p.name for p in inputs(tmp_path / "f")] == ["fire1.png"]
    assert [p.name for p in inputs(tmp_path / "f" / "fire*")] == ["fire1.png"]


def test_brackets_in_a_folder_that_exists_are_no_pattern(tmp_path: Path) -> None:
    folder = touch(tmp_path / "my [fx]", "fire[1].png", "fire2.png")
    assert [p.name for p in inputs(folder / "fire*.png")] == ["fire2.png", "fire[1].png"]
    assert inputs(folder / "fire[1].png") == [folder / "fire[1].png"]


def test_a_glob_may_reach_into_folders(tmp_path: Path) -> None:
    touch(tmp_path / "take2", "1.png")
    touch(tmp_path / "take10", "1.png")
    found = inputs(tmp_path / "take*" / "*.png")
    assert [p.parent.name for p in found] == ["take2", "take10"]


@pytest.mark.parametrize(
    "pattern",
    ["**/*.png", "**", "*/*.png", "**/c/*.png", "a*/**/x[12].png", "**/**/*1.png", "*/.h/*.png",
     ".*/*.png", "**/b/../*.png", "a/?/x*.png", "*/c/x1.png", "**/x[!2]*"],
)  # fmt: skip
def test_a_pattern_matches_what_the_standard_library_matches(pattern: str, tmp_path: Path) -> None:
    for folder in ("", "a", "a/b", "a/b/c", "a2/c", "a/.h", ".h", "z/c/c"):
        touch(tmp_path / folder, "x1.png", "x2.png", ".x1.png", "y.txt")
    (tmp_path / "link").symlink_to(tmp_path / "a" / "b", target_is_directory=True)
    (tmp_path / "itself").symlink_to(tmp_path / "itself")
    names = glob.glob(pattern, root_dir=tmp_path, recursive=True)  # noqa: PTH207
    images = {tmp_path / name for name in names if name.endswith(".png")}
    assert set(inputs(tmp_path / pattern)) == images


def test_a_pattern_that_would_search_a_whole_disk_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(listing, "MAX_ENTRIES", 50)
    for number in range(6):
        touch(tmp_path / "many" / str(number), *(f"{i}.png" for i in range(10)))
    for pattern in ("**/*.png", "*/*", "**"):
        with pytest.raises(SourceError, match=r"too many files to search.*name a folder") as caught:
            inputs(tmp_path / "many" / pattern)
        assert str(caught.value).startswith(str(tmp_path / "many" / pattern))
        assert f": {tmp_path / 'many'} and" in str(caught.value)
    touch(tmp_path / "full", *(f"{i}.txt" for i in range(51)))
    with pytest.raises(SourceError, match="too many files"):
        inputs(tmp_path / "full")


def test_links_that_lead_in_a_circle_end(tmp_path: Path) -> None:
    touch(tmp_path / "a", "1.png")
    touch(tmp_path / "b", "2.png")
    (tmp_path / "a" / "up").symlink_to(tmp_path, target_is_directory=True)
    (tmp_path / "a" / "other").symlink_to(tmp_path / "b", target_is_directory=True)
    (tmp_path / "b" / "other").symlink_to(tmp_path / "a", target_is_directory=True)
    found = {path.relative_to(tmp_path).as_posix() for path in inputs(tmp_path / "**" / "*.png")}
    assert found == {"a/1.png", "b/2.png", "a/other/2.png", "b/other/1.png"}


@pytest.mark.parametrize("settings", [{}, {"start": 2}, {"start": 1, "count": 3}])
def test_a_listing_names_what_the_clip_names(settings: dict[str, Any], tmp_path: Path) -> None:
    folder = fire.write_folder(tmp_path / "f", fire.fires())
    clip = fire.open_clip(folder, **settings)
    assert tuple(inputs(folder, **settings)) == clip.inputs
    sheet = fire.write_sheet(tmp_path / "s.png", fire.fires(), 3)
    assert inputs(sheet, start=2) == [sheet]


def test_a_listing_needs_no_picture_library(tmp_path: Path) -> None:
    touch(tmp_path / "f", "1.png")
    program = (
        "import sys; from pathlib import Path; from fire_atlas.sources.listing import list_inputs;"
        "from fire_atlas.sources.registry import open_source;"
        "from fire_atlas.recipe.source import FramesSource;"
        "list_inputs(FramesSource(path='f'), Path(sys.argv[1]));"
        "sys.exit(','.join({'PIL', 'av', 'cv2', 'numpy'} & set(sys.modules)))"
    )
    run = subprocess.run(
        [sys.executable, "-c", program, str(tmp_path / "f")], capture_output=True, text=True
    )
    assert run.stderr.strip() == ""


MISSING = {
    "campfre": "did you mean 'campfire'?",
    "campfire/fire_*.png": "no file matches; .*campfire holds 'notes.txt'",
    "campfire": r"no images in this folder \(it holds 'notes.txt'\)",
    "campfire/notes.tx": "did you mean 'notes.txt'?",
    "camp/fire1.png": "there is no folder 'camp'; did you mean 'campfire'?",
    "campfire/notes.txt/1.png": "notes.txt is a file, not a folder",
    "campfire/*.txt": "matches no images|not an image",
    "nothing": "the folder is empty",
}


@pytest.mark.parametrize(("name", "message"), MISSING.items())
def test_what_is_missing_is_named(name: str, message: str, tmp_path: Path) -> None:
    touch(tmp_path / "campfire", "notes.txt").joinpath("notes.txt").write_text("logs and tinder")
    touch(tmp_path / "nothing")
    with pytest.raises(SourceError, match=message) as caught:
        fire.open_clip(tmp_path / name)
    assert str(tmp_path) in str(caught.value)


def test_frames_of_differing_sizes_are_named_with_their_sizes(tmp_path: Path) -> None:
    folder = fire.write_folder(tmp_path / "f", fire.fires(2))
    fire.write_folder(tmp_path / "g", fire.fires(1, width=44))
    (tmp_path / "g" / "fire0.png").rename(folder / "fire7.png")
    with pytest.raises(SourceError, match=r"fire7\.png: is 44x40, but fire0\.png is 48x40"):
        fire.open_clip(folder)
    assert fire.open_clip(folder, count=2).count == 2


@pytest.mark.parametrize("kind", ["folder", "gif", "sheet"])
def test_a_start_beyond_the_end_says_how_many_frames_there_are(kind: str, tmp_path: Path) -> None:
    frames = fire.fires(6, hard=True)
    grid = {"columns": 3, "rows": 2} if kind == "sheet" else None
    path = {
        "folder": lambda: fire.write_folder(tmp_path / "f", frames),
        "gif": lambda: fire.write_animation(tmp_path / "a.gif", frames, duration=80, disposal=2),
        "sheet": lambda: fire.write_sheet(tmp_path / "s.png", frames, 3),
    }[kind]()
    with pytest.raises(SourceError, match=r"is 6, but .* has only 6 frames"):
        fire.open_clip(path, start=6, grid=grid)
    with pytest.raises(SourceError, match="count can be at most 2"):
        fire.open_clip(path, start=4, count=3, grid=grid)


def test_too_many_images_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(listing, "MAX_FRAMES", 3)
    touch(tmp_path / "f", *(f"{i}.png" for i in range(4)))
    with pytest.raises(SourceError, match="4 images; at most 3 frames"):
        inputs(tmp_path / "f")

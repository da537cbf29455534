"""What lies under the name of a picture, a video or a recipe without being one."""

from pathlib import Path

import pytest

from fire_atlas.core.errors import FireAtlasError, SourceError
from fire_atlas.recipe.tree import read_tree
from tests.support import synthetic_fire as fire

POINTER = (
    b"version https://git-lfs.github.com/spec/v1\n"
    b"oid sha256:4d7a214614ab2935c943f9e0ff69d22eadbb8f32b1258daaa5e2ca24d17e2393\nsize 12345\n"
)
IMPOSTORS = {
    "run `git lfs pull`": POINTER,
    "a web page": b"\n<!DOCTYPE html><html><head><title>404</title>",
    "XML": b'<?xml version="1.0"?><Error><Code>AccessDenied</Code></Error>',
    "JSON": b'{"error": "not found", "status": 404, "more": true}',
    "Photoshop": b"8BPS\0\x01\0\0\0\0\0\0\0\x03\0\0\x01\0\0\0\x01\0\0\x08\0\x03",
    "ZIP": b"PK\x03\x04\x14\0\0\0\x08\0\0\0!\0\x9a\xa4\xcd\x8c\0\0\0\0",
    "Blender": b"BLENDER-v305REND\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0",
    "Aseprite": b"\xb4\x1d\0\0\xe0\xa5\x06\0\x40\0\x40\0\x20\0\x01\0\0\0\0\0",
    "HEIC": b"\0\0\0\x18ftypheic\0\0\0\0mif1heic",
    "only zeros": bytes(4096),
    "macOS keeps notes": b"\0\x05\x16\x07\0\x02\0\0Mac OS X        ",
}


@pytest.mark.parametrize("name", ["a.png", "a.mp4", "a.exr", "a.tga", "a.gif", "a.ts"])
@pytest.mark.parametrize("kind", IMPOSTORS)
def test_what_is_no_picture_is_called_what_it_is(kind: str, name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    path.write_bytes(IMPOSTORS[kind])
    with pytest.raises(SourceError, match=rf"{name[:1]}\.{name[2:]}: is .*{kind}"):
        fire.open_clip(path)


def test_one_pointer_among_the_frames_of_a_sequence_is_named(tmp_path: Path) -> None:
    folder = fire.write_folder(tmp_path / "f", fire.fires(3))
    (folder / "fire1.png").write_bytes(POINTER)
    with pytest.raises(SourceError, match=r"fire1\.png: is a Git LFS pointer"):
        fire.open_clip(folder)


@pytest.mark.parametrize("name", ["a.png", "a.mp4", "a.ts"])
def test_an_empty_file_is_called_empty(name: str, tmp_path: Path) -> None:
    (tmp_path / name).touch()
    with pytest.raises(SourceError, match=r"the file is empty \(0 bytes\)"):
        fire.open_clip(tmp_path / name)


def test_the_json_of_an_atlas_that_is_a_pointer_says_so(tmp_path: Path) -> None:
    (tmp_path / "a.json").write_bytes(POINTER)
    with pytest.raises(SourceError, match=r"a\.json: is a Git LFS pointer"):
        fire.open_clip(tmp_path / "a.json")


@pytest.mark.parametrize("name", ["a.yaml", "a.fire"])
def test_a_recipe_that_is_a_pointer_says_so(name: str, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(POINTER)
    with pytest.raises(FireAtlasError, match=r"is a Git LFS pointer, not the file: run"):
        read_tree(tmp_path / name)

"""The manifest's file: what is written is read back, and nothing else is taken for one."""

import hashlib
import json
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fire_atlas.core.output_file import Role
from fire_atlas.outputs.digest import HashedFile
from fire_atlas.outputs.manifest import (
    InputEntry,
    Manifest,
    OutputEntry,
    decode_manifest,
    encode_manifest,
    manifest_name,
    read_manifest,
)
from fire_atlas.outputs.staging import Staging

DIGESTS = st.text("0123456789abcdef", min_size=64, max_size=64)
FILE_NAMES = st.text("abzäß炎09 ._-@'\"", min_size=1).filter(lambda name: name.strip("."))
PLAIN = st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text()
FIGURES = st.recursive(
    PLAIN, lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner), max_leaves=10
)
MANIFESTS = st.builds(
    Manifest,
    name=FILE_NAMES,
    request_digest=DIGESTS,
    recipe_digest=DIGESTS,
    tool_digest=DIGESTS,
    inputs=st.lists(st.builds(InputEntry, st.text(), DIGESTS)).map(tuple),
    outputs=st.lists(
        st.builds(
            OutputEntry,
            FILE_NAMES,
            st.sampled_from(get_args(Role)) | st.text(),
            st.integers(0),
            DIGESTS,
        )
    ).map(tuple),
    statistics=st.dictionaries(st.text(), FIGURES),
    tool=st.text(),
)

SMALL = Manifest(
    "fire",
    "a" * 64,
    "b" * 64,
    "c" * 64,
    (InputEntry("clip/0000.png", "d" * 64),),
    (OutputEntry("fire.png", "page", 7, "e" * 64),),
    {"frames": 1},
)


@given(MANIFESTS)
def test_a_manifest_is_read_as_it_was_written(manifest: Manifest) -> None:
    assert decode_manifest(encode_manifest(manifest)) == manifest


def test_the_file_keeps_the_keys_that_other_tools_read() -> None:
    document = json.loads(encode_manifest(SMALL))
    assert document == {
        "format": "fire-atlas/manifest",
        "version": 1,
        "name": "fire",
        "tool": SMALL.tool,
        "made_by": "c" * 64,
        "asked": "a" * 64,
        "recipe": "b" * 64,
        "inputs": [{"path": "clip/0000.png", "sha256": "d" * 64}],
        "outputs": [{"path": "fire.png", "role": "page", "bytes": 7, "sha256": "e" * 64}],
        "statistics": {"frames": 1},
    }


@pytest.mark.parametrize("key", json.loads(encode_manifest(SMALL)))
@pytest.mark.parametrize("value", [None, 7.5, [3], [{}], {"path": "x"}])
def test_a_key_that_is_missing_or_of_another_kind_makes_it_unsound(key: str, value: Any) -> None:
    document = json.loads(encode_manifest(SMALL))
    if (key, value) != ("statistics", {"path": "x"}):
        with pytest.raises(ValueError, match=r"key is missing|is not an (input|output)"):
            decode_manifest(json.dumps({**document, key: value}).encode())
    del document[key]
    with pytest.raises(ValueError, match="a key is missing"):
        decode_manifest(json.dumps(document).encode())


def test_an_output_may_lie_in_a_folder_but_in_no_hidden_one() -> None:
    def decoded(name: str) -> str:
        outputs = (replace(SMALL.outputs[0], name=name),)
        return decode_manifest(encode_manifest(replace(SMALL, outputs=outputs))).outputs[0].name

    assert decoded("art/deep/page.png") == "art/deep/page.png"
    for hidden in (".git/hooks", "art/.page.png"):
        with pytest.raises(ValueError, match="leads to hidden files"):
            decoded(hidden)


@pytest.mark.parametrize(
    "name", ["../fire.png", "a/../b", "a//b", "a\\b", "/fire.png", "C:b", "..", ""]
)
def test_an_output_elsewhere_makes_it_unsound(name: str) -> None:
    outputs = (replace(SMALL.outputs[0], name=name),)
    with pytest.raises(ValueError, match="is not a plain file name"):
        decode_manifest(encode_manifest(replace(SMALL, outputs=outputs)))


def test_only_a_sound_manifest_is_read_from_a_folder(tmp_path: Path) -> None:
    path = tmp_path / manifest_name("fire")
    assert read_manifest(tmp_path, "fire") is None
    path.write_bytes(b"{")
    assert read_manifest(tmp_path, "fire") is None
    path.write_bytes(encode_manifest(SMALL))
    assert read_manifest(tmp_path, "fire") == SMALL


def test_an_input_is_named_from_the_recipes_folder(tmp_path: Path) -> None:
    (tmp_path / "recipes").mkdir()
    (tmp_path / "clip.gif").write_bytes(b"")
    entry = InputEntry.of(HashedFile.of(tmp_path / "clip.gif"), tmp_path / "recipes")
    empty = "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855"
    assert entry == InputEntry("../clip.gif", empty)


def test_an_output_is_intact_until_a_byte_of_it_changes(tmp_path: Path) -> None:
    out = tmp_path / "fire.png"
    with Staging(tmp_path, "fire", print) as staging:
        with staging.open("fire.png") as file:
            file.write(b"page")
        entry = staging.entry("fire.png", "page")
        assert entry == OutputEntry("fire.png", "page", 4, hashlib.sha256(b"page").hexdigest())
        assert not entry.is_intact(tmp_path), "it is not in place yet"
        staging.commit([])
    assert entry.is_intact(tmp_path)
    out.write_bytes(b"pagf")
    assert not entry.is_intact(tmp_path)

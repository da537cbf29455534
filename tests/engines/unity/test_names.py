"""Names that people give, as Unity, C# and file systems take them."""

import re

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from fire_atlas.core.errors import OutputError
from fire_atlas.engines.unity.assets import scalar, single
from fire_atlas.engines.unity.names import file_stems, player_name, sprite_names, state_names
from fire_atlas.recipe.tree import NAME_PATTERN
from tests.engines.unity.products import Fire, exported
from tests.engines.unity.type_trees import Loader, faults, importer

ODD = ["a b", " lead", "tail.", "火の粉", "é", "x;y", "a'b", "#1", "- x", "null", "012", "1e3", "~",
       "a: b", "{a}", "[a]", "&a", "*a", "?", "|", ">", "%", "@", "`", "a\\b", 'a"b', "true",
       "𝔣𝔦𝔯𝔢", "x" * 200, "火" * 80]  # fmt: skip


@pytest.mark.parametrize("odd", ODD)
def test_an_odd_animation_becomes_sound_files(odd: str) -> None:
    files = exported(Fire({odd: 2, "walk": 2}, name="hero").product(alpha="premultiplied"))
    for name, data in files.items():
        assert len(f"{name}".encode()) < 240
        assert not re.search(r'[<>:"/\\|?*\x00-\x1f]', name)
        if name.endswith((".meta", ".anim", ".controller", ".prefab", ".mat")):
            data.decode("ascii")
            assert faults(name, data.decode()) == []
    _, meta = importer(files["hero.png.meta"].decode())
    names = [str(sprite["name"]) for sprite in meta["spriteSheet"]["sprites"]]
    assert len(set(names)) == 4 and all(name.startswith("hero_") for name in names)
    clips = [n for n in files if n.endswith(".anim")]
    for clip in clips:
        stated = re.findall("m_Name: (.*)", files[clip].decode())[0]
        assert yaml.load(stated, yaml.BaseLoader) == clip.removesuffix(".anim")


@pytest.mark.parametrize(
    "pair",
    [("Walk", "walk"), ("a.b", "a_b"), ("\u00e9", "e\u0301"), ("a?", "a*"), ("Straße", "STRASSE")],
)
def test_names_that_a_system_cannot_tell_apart_are_refused(pair: tuple[str, str]) -> None:
    with pytest.raises(OutputError, match=r"unity cannot tell the (animations|frames) .* apart"):
        exported(Fire(dict.fromkeys(pair, 1), name="hero").product())


def test_an_undecodable_file_name_becomes_a_sound_one() -> None:
    assert sprite_names(["a\udcff/0000"]) == {"a\udcff/0000": "a__0000"}


def test_long_names_stay_apart() -> None:
    names = ["x" * 150 + "1", "x" * 150 + "2"]
    stems = file_stems("hero", names)
    assert len(set(stems.values())) == 2
    assert all(len(stem) < 130 for stem in stems.values())
    assert state_names(names) == dict(zip(names, names, strict=True))


@given(st.text(max_size=30))
def test_text_survives_yaml(text: str) -> None:
    written = scalar(text)
    assert "\n" not in written and written.isascii()
    if not re.search("[\ud800-\udfff]", text):
        loaded = yaml.load(f"a: {written}", yaml.BaseLoader)["a"]
        assert loaded == text


@pytest.mark.parametrize("word", ["null", "true", "012", "1e3", "-5", "0x1F", "1_000", "~"])
def test_words_are_never_read_as_something_else(word: str) -> None:
    """Unity reads a field as what it is; parsers that guess must not guess wrong."""
    assert str(yaml.load(f"a: {scalar(word)}", Loader)["a"]) in (word, "None")


@given(st.floats(width=32, allow_nan=False, allow_infinity=False, allow_subnormal=False))
def test_numbers_are_written_exactly_and_plainly(value: float) -> None:
    assert re.fullmatch(r"-?\d+(\.\d+)?", single(value))
    assert float(single(value)) == pytest.approx(value, rel=6e-8, abs=0)


def test_numbers_are_written_as_the_editor_does() -> None:
    assert [single(x) for x in (1 / 12, 100, 0.5, 2 / 3, 1e-5)] == [
        "0.083333336", "100", "0.5", "0.6666667", "0.00001",
    ]  # fmt: skip


names = st.from_regex(NAME_PATTERN, fullmatch=True).filter(str.isascii)


@given(names, names)
def test_every_recipe_has_a_class_of_its_own(one: str, other: str) -> None:
    assert re.fullmatch("[A-Za-z_][A-Za-z0-9_]*", player_name(one))
    assert (player_name(one) == player_name(other)) == (one == other)

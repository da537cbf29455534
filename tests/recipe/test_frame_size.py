"""``source.size`` of generated fire: its frame, and what is refused beside it."""

from collections.abc import Callable
from pathlib import Path

import pytest

from fire_atlas.core.errors import RecipeError
from fire_atlas.recipe.load import load_tree, resolved_yaml
from fire_atlas.recipe.models import Recipe
from fire_atlas.recipe.silk import SilkSource
from fire_atlas.recipe.source import ProfileSource
from fire_atlas.recipe.tree import read_tree

Write = Callable[..., Path]

SILK = "source:\n  kind: silk\n"
PROFILE = "source:\n  kind: profile\n  path: candle.gif\n"


def loaded(path: Path, *overrides: str) -> Recipe:
    return load_tree(read_tree(path, overrides)).recipe


def silk_frame(path: Path, *overrides: str) -> tuple[int, int]:
    source = loaded(path, *overrides).source
    assert isinstance(source, SilkSource)
    return source.width, source.height


def advice(path: Path, *overrides: str) -> str:
    with pytest.raises(RecipeError) as caught:
        loaded(path, *overrides)
    return str(caught.value).removeprefix(f"{path.parent}/")


@pytest.mark.parametrize(
    ("keys", "frame"),
    [
        ("", (256, 256)),
        ("size: draft", (192, 192)),
        ("size: game", (384, 384)),
        ("size: hero", (512, 512)),
        ("size: hero\n  aspect: 0.625", (320, 512)),
        ("size: game\n  aspect: 2", (384, 192)),
        ("size: draft\n  aspect: 4", (192, 48)),
        ("size: draft\n  aspect: 0.25", (48, 192)),
        ("size: ~", (256, 256)),
        ("size: ~\n  width: 160", (160, 256)),
    ],
)
def test_a_size_states_the_longer_side_of_a_frame(
    write: Write, keys: str, frame: tuple[int, int]
) -> None:
    assert silk_frame(write(f"{SILK}  {keys}")) == frame


def test_another_size_is_set_on_the_command_line_and_by_a_recipe_that_extends(
    write: Write,
) -> None:
    path = write(f"{SILK}  size: game\n  aspect: 0.5")
    assert silk_frame(path, "source.size=hero") == (256, 512)
    assert silk_frame(path, "source.aspect=2") == (384, 192)
    assert silk_frame(write("extends: campfire.yaml\nsource: {size: draft}", "b.yaml")) == (96, 192)


@pytest.mark.parametrize(
    ("keys", "place", "message"),
    [
        (
            "size: hero\n  width: 512\n  height: 512",
            "3: source.size",
            "says how large a frame is, as width and height would; remove width and height, or "
            "remove size and write width: 512 and height: 512",
        ),
        (
            "width: 160\n  height: 256\n  size: hero",
            "5: source.size",
            "says how large a frame is, as width and height would; remove width and height and "
            "write aspect: 0.625, or remove size and write width: 320 and height: 512",
        ),
        (
            "size: game\n  width: 512",
            "3: source.size",
            "says how large a frame is, as width would; remove width and write aspect: 2, or "
            "remove size and write width: 384 and height: 192",
        ),
        (
            "size: game\n  aspect: 0.5\n  height: 100",
            "3: source.size",
            "says how large a frame is, as height would; remove height, or remove size and aspect "
            "and write width: 192 and height: 384",
        ),
        (
            "aspect: 2",
            "3: source.aspect",
            "is the shape of a frame whose longer side is a size, and there is none; remove it and "
            "state width and height, or those and write size: game",
        ),
        ("size: huge", "3: source.size", 'must be one of draft, game, hero; got "huge"'),
        ("size: 300", "3: source.size", "must be one of draft, game, hero; got 300"),
        ("size: game\n  aspect: 9", "4: source.aspect", "must be at most 4; got 9"),
        ("size: game\n  aspect: wide", "4: source.aspect", 'must be a number; got "wide"'),
    ],
)
def test_a_frame_that_is_stated_twice_or_in_part_is_refused(
    write: Write, keys: str, place: str, message: str
) -> None:
    assert advice(write(f"{SILK}  {keys}")) == f"campfire.yaml:{place}: {message}"


def test_the_advice_on_a_frame_that_is_stated_twice_keeps_its_shape(write: Write) -> None:
    """Both ways that ``size: hero`` beside 160 x 256 px is told to go end in one frame."""
    assert silk_frame(write(f"{SILK}  size: hero\n  aspect: 0.625")) == (320, 512)
    assert silk_frame(write(f"{SILK}  width: 320\n  height: 512")) == (320, 512)
    for shape, aspect in (("4096\n  height: 16", "aspect: 4,"), ("16\n  height: 4096", "0.25,")):
        assert aspect in advice(write(f"{SILK}  size: hero\n  width: {shape}"))


def test_other_mistakes_of_a_source_are_listed_beside_a_wrong_size(write: Write) -> None:
    lines = advice(write(f"{SILK}  size: huge\n  soot: 99")).splitlines()
    assert [line.split(": ")[1] for line in lines] == ["source.size", "source.soot"]


def test_a_profile_takes_a_size_or_a_height(write: Write) -> None:
    path = write(f"{PROFILE}  size: game")
    source = loaded(path).source
    assert isinstance(source, ProfileSource) and (source.size, source.height) == ("game", None)
    both = "says how large frames are, as height does; remove one of them"
    assert advice(path, "source.height=80") == f"campfire.yaml:4: source.size: {both}"
    tall = write(f"{PROFILE}  height: 80")
    assert advice(tall, "source.size=hero") == f"--set source.size: {both}"
    source = loaded(tall, "source.size=hero", "source.height=~").source
    assert isinstance(source, ProfileSource) and source.size == "hero"
    assert "source.aspect: unknown key here; it is one of `kind: fluid` or `kind: silk`" in advice(
        write(f"{PROFILE}  size: game\n  aspect: 2")
    )


def test_frames_that_exist_have_no_size_by_name(write: Write) -> None:
    assert "source.size: unknown key here; it is one of `kind: fluid` or `kind: profile`" in advice(
        write("source: {path: clip, size: game}")
    )


def test_a_resolved_recipe_keeps_the_size_and_takes_another(write: Write) -> None:
    text = resolved_yaml(load_tree(read_tree(write(f"{SILK}  size: game\n  aspect: 2"))))
    path = write(text, "resolved.yaml")
    assert silk_frame(path) == (384, 192)
    assert silk_frame(path, "source.size=draft") == (192, 96)
    assert resolved_yaml(load_tree(read_tree(path))).splitlines()[1:] == text.splitlines()[1:]
    stated = resolved_yaml(load_tree(read_tree(write(f"{SILK}  width: 80"))))
    assert silk_frame(write(stated)) == (80, 256)

"""What a recipe asks of its writers beyond their limits is refused at its own line and key."""

from collections.abc import Callable
from pathlib import Path
from subprocess import CompletedProcess

import pytest

from fire_atlas.core.errors import RecipeError
from fire_atlas.pipeline.input.check import load_checked
from fire_atlas.recipe.tree import read_tree

Run = Callable[..., CompletedProcess[str]]
Write = Callable[..., Path]

LIES_AS_ON_THE_PAGE = (
    "cannot be combined with atlas.rotate: its clients show frames as they lie on the page; "
    "set atlas.rotate to false"
)
STRAIGHT_IN_SRGB = "browsers blend images with straight alpha in sRGB"
NO_FLAKES = "this effect has no flakes, so this map would be"


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Write a recipe whose source is in line 1, and return its path."""

    def write(text: str, name: str = "fire.yaml") -> Path:
        path = tmp_path / name
        path.write_text(f"source: {{path: clip}}\n{text}\n", encoding="utf-8")
        return path

    return write


def refused(path: Path, *overrides: str) -> list[str]:
    """Return the lines of advice, without the folder in front."""
    with pytest.raises(RecipeError) as caught:
        load_checked(read_tree(path, overrides))
    return [line.removeprefix(f"{path.parent}/") for line in str(caught.value).splitlines()]


@pytest.mark.parametrize("export", ["phaser", "aseprite", "css", "tpsheet", "godot", "unity"])
def test_clients_that_show_frames_as_they_lie_need_them_upright(export: str, write: Write) -> None:
    path = write(f"atlas:\n  rotate: true\nexports:\n  - json\n  - {export}")
    assert refused(path) == [f"fire.yaml:6: exports.1: {export} {LIES_AS_ON_THE_PAGE}"]


def test_an_engine_with_options_has_the_same_limits(write: Write) -> None:
    path = write("exports:\n  - json\n  - unity: {}\natlas: {rotate: true}")
    assert refused(path) == [f"fire.yaml:4: exports.1: unity {LIES_AS_ON_THE_PAGE}"]


@pytest.mark.parametrize(
    ("text", "advice"),
    [
        (
            "atlas:\n  alpha: premultiplied\nexports:\n  - css",
            f"5: exports.0: css cannot be combined with atlas.alpha premultiplied and blend_space "
            f"srgb: {STRAIGHT_IN_SRGB}",
        ),
        (
            "exports:\n  - css\natlas:\n  blend_space: linear",
            f"3: exports.0: css cannot be combined with atlas.alpha straight and blend_space "
            f"linear: {STRAIGHT_IN_SRGB}",
        ),
        (
            "exports:\n  - json\n  - unity\natlas:\n  format: webp",
            "4: exports.1: unity does not import atlas.format webp; set it to png",
        ),
        (
            "atlas:\n  format: webp\n  max_size: 16384",
            "4: atlas.max_size: a WebP has at most 16383 px a side; got 16384",
        ),
        *(
            (
                f"maps:\n  flame: true\n  motion: {engine}",
                f"4: maps.motion: {engine} motion vectors need a flipbook with cells of equal "
                f"size; set atlas.layout to grid",
            )
            for engine in ("unity", "unreal")
        ),
        (
            "maps:\n  motion: godot\natlas:\n  rotate: true",
            "3: maps.motion: vectors cannot be read from frames that lie rotated; leave out "
            "atlas.rotate",
        ),
        (
            "flakes: none\nmaps:\n  flame: true",
            f"4: maps.flame: {NO_FLAKES} a copy of the page; leave it out",
        ),
        ("maps:\n  flakes: true\nflakes: none", f"3: maps.flakes: {NO_FLAKES} empty; leave it out"),
        (
            "atlas:\n  dedupe: true\nmaps:\n  motion: godot",
            "4: maps: frames that look alike may differ in their maps, so each has a place of its "
            "own; leave out atlas.dedupe, or set it to false",
        ),
    ],
)
def test_a_limit_is_reported_with_its_file_line_and_key(
    text: str, advice: str, write: Write
) -> None:
    assert refused(write(text)) == [f"fire.yaml:{advice}"]


@pytest.mark.parametrize(
    "text",
    [
        "exports: [json, json-array, {template: a, to: b}]\natlas: {rotate: true}",
        "exports: [godot]\natlas: {blend_space: linear}\ntracks: [csv]",
        "exports: [godot]\natlas: {layout: grid, format: webp, alpha: additive, scales: [1, 0.5]}",
        "exports: [godot]\natlas: {alpha: additive, max_size: 64}",
        "exports: [unity, css]\nmaps: {motion: unity, flame: true}\natlas: {layout: grid}",
        "maps: {motion: godot}\natlas: {dedupe: false}",
        "maps: {motion: godot}\nflakes: none",
        "atlas: {format: webp, max_size: 16383}",
    ],
)
def test_all_else_can_be_had(text: str, write: Write) -> None:
    assert load_checked(read_tree(write(text))).recipe.exports


def test_all_problems_are_reported_at_once_in_the_order_of_their_lines(write: Write) -> None:
    path = write(
        "exports:\n  - unity\n  - css\nflakes: none\nmaps:\n  flakes: true\n  flame: true\n"
        "  motion: unity\natlas: {rotate: true, format: webp, max_size: 16384, alpha: additive}"
    )
    places = [line.split(": ")[0] + " " + line.split(": ")[1] for line in refused(path)]
    assert places == [
        "fire.yaml:3 exports.0",
        "fire.yaml:3 exports.0",
        "fire.yaml:4 exports.1",
        "fire.yaml:4 exports.1",
        "fire.yaml:7 maps.flakes",
        "fire.yaml:8 maps.flame",
        "fire.yaml:9 maps.motion",
        "fire.yaml:9 maps.motion",
        "fire.yaml:10 atlas.max_size",
    ]


def test_what_set_asks_for_is_reported_of_set(write: Write) -> None:
    path = write("atlas: {rotate: true}")
    assert refused(path, "exports=[json, css]") == [f"--set exports.1: css {LIES_AS_ON_THE_PAGE}"]
    path = write("exports: [css]")
    assert refused(path, "atlas.rotate=true") == [
        f"fire.yaml:2: exports.0: css {LIES_AS_ON_THE_PAGE}"
    ]


def test_what_is_inherited_is_reported_where_it_was_written(write: Write, tmp_path: Path) -> None:
    write("\n\nexports: [css]", "base.yaml")
    child = tmp_path / "child.yaml"
    child.write_text("extends: ./base.yaml\natlas: {rotate: true}\n", encoding="utf-8")
    assert refused(child) == [f"base.yaml:4: exports.0: css {LIES_AS_ON_THE_PAGE}"]


def test_pages_that_are_shared_are_held_to_the_limits_of_the_recipe_that_is_built(
    write: Write, tmp_path: Path
) -> None:
    """Of a member's own atlas, maps, exports and tracks nothing is written."""
    write("exports: [css]\natlas: {rotate: true}\nmaps: {motion: unity}", "torch.yaml")
    host = tmp_path / "level.yaml"
    host.write_text("atlas:\n  members: [torch.yaml]\n", encoding="utf-8")
    assert load_checked(read_tree(host)).members
    host.write_text("atlas: {members: [torch.yaml], rotate: true}\nexports:\n  - tpsheet\n")
    assert refused(host) == [f"level.yaml:3: exports.0: tpsheet {LIES_AS_ON_THE_PAGE}"]


def test_layers_of_shared_pages_may_hold_the_flakes_of_members(
    write: Write, tmp_path: Path
) -> None:
    write("", "torch.yaml")
    host = tmp_path / "level.yaml"
    host.write_text("atlas: {members: [torch.yaml]}\nflakes: none\nmaps: {flakes: true}\n")
    assert load_checked(read_tree(host)).members

"""Source ``sprites``: names are the user's, animations by their numbers, pivots and borders."""

import json
import random
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from fire_atlas.cli import main
from fire_atlas.core.pixels import Bytes
from fire_atlas.formats.atlas.texture_packer import read_atlas
from fire_atlas.preview.cut_frames import cut_frames
from fire_atlas.preview.singles import with_singles_played
from tests.support.icons import NAMES, PICTURES, draw_theme


def icon(path: Path, width: int = 9, height: int = 7) -> Bytes:
    """Write a full picture that no other path has."""
    chance = np.random.default_rng(sum(map(ord, str(path.name))) + 1000 * width + height)
    image: Bytes = chance.integers(1, 256, (height, width, 4), np.uint8)
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(image).save(path)
    return image


class Icons:
    """A folder ``art`` with icons, and a recipe that packs it."""

    def __init__(self, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
        self.folder, self.recipe = folder, folder / "ui.yaml"
        self.capsys = capsys
        self.said = ""

    def add(self, *names: str) -> None:
        for name in names:
            icon(self.folder / "art" / name)

    def run(self, command: str, source: dict[str, Any], keys: dict[str, Any]) -> int:
        source = {"kind": "sprites", "path": "art", **source}
        self.recipe.write_text(json.dumps({"source": source, **keys}), encoding="utf-8")
        code = main([command, str(self.recipe)])
        self.said = self.capsys.readouterr().err
        return code

    def built(self, source: dict[str, Any] | None = None, **keys: Any) -> dict[str, Any]:
        assert self.run("build", source or {}, keys) == 0, self.said
        sheet: dict[str, Any] = json.loads((self.folder / "build/ui.json").read_text())
        return sheet

    def names(self, **source: Any) -> set[str]:
        return set(self.built(source)["frames"])

    def animations(self, **source: Any) -> dict[str, list[str]]:
        found: dict[str, list[str]] = self.built(source)["animations"]
        return found

    def refused(self, *words: str, source: dict[str, Any] | None = None, **keys: Any) -> None:
        """Require that ``check`` and ``build`` refuse a recipe with the same words."""
        codes = set()
        for command in ("check", "build"):
            codes.add(self.run(command, source or {}, keys))
            said = " ".join(self.said.split())
            assert all(word in said for word in words), said
        assert len(codes) == 1 and codes <= {1, 2}


@pytest.fixture
def icons(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Icons:
    return Icons(tmp_path, capsys)


def test_names_are_the_ways_to_the_files(icons: Icons) -> None:
    icons.add("hud/close.png", "hud/deep/open.png", "menu/close.png", "1.png", "icon2.png")
    names = {"hud/close", "hud/deep/open", "menu/close", "1", "icon2"}
    assert icons.names() == names
    assert icons.names(names="file") == {f"{name}.png" for name in names}
    assert icons.animations() == {}


@pytest.mark.parametrize(
    ("path", "names"),
    [
        ("art/hud", {"close", "deep/open"}),
        ("art/hud/close.png", {"close"}),
        ("art/**/*.png", {"hud/close", "hud/deep/open", "menu/gear"}),
        ("art/*", {"hud/close", "hud/deep/open", "menu/gear"}),
        ("art/*/*.png", {"hud/close", "menu/gear"}),
        ("art/h*", {"hud/close", "hud/deep/open"}),
        (["art/hud", "art/menu"], {"close", "deep/open", "gear"}),
        (["art/menu/gear.png", "art/hud/*.png"], {"gear", "close"}),
        (["art", "art/*.png"], {"hud/close", "hud/deep/open", "menu/gear"}),
    ],
)
def test_names_begin_at_the_folder_of_their_path(
    icons: Icons, path: str | list[str], names: set[str]
) -> None:
    icons.add("hud/close.png", "hud/deep/open.png", "menu/gear.png", ".hidden/x.png", "hud/.y.png")
    if isinstance(path, list) and "art/*.png" in path:
        icons.add("top.png")
        names = names | {"top"}
    assert icons.names(path=path) == names


def test_two_of_one_name_are_refused_and_both_named(icons: Icons) -> None:
    icons.add("hud/close.png", "menu/close.png")
    icons.refused(
        "art/hud/close.png and", "art/menu/close.png would both be called close", "names: path",
        source={"names": "stem"},
    )  # fmt: skip
    icons.refused("would both be called close", source={"path": ["art/hud", "art/menu"]})
    icons.add("hud/close.bmp")
    icons.refused("hud/close.bmp and", "names: file")
    assert icons.names(names="file") == {"hud/close.png", "hud/close.bmp", "menu/close.png"}


def test_names_that_are_one_elsewhere_are_refused(icons: Icons) -> None:
    icons.add("é1.png")
    icons.add("e\u0301" + "1.png")
    icons.refused("would both be called", "on Windows and macOS")


@pytest.mark.parametrize("name", ["a;b.png", 'a"b.png', "a\nb.png", "a*/b.png", "a:b.png"])
def test_names_that_not_every_system_has_are_refused(icons: Icons, name: str) -> None:
    icons.add(name)
    icons.refused("rename it")


@pytest.mark.parametrize(
    ("files", "animations"),
    [
        (["coin_01", "coin_02"], {"coin": ["coin_01", "coin_02"]}),
        (["coin0", "coin1", "coin2"], {"coin": ["coin0", "coin1", "coin2"]}),
        (["b (1)", "b (2)"], {"b": ["b (1)", "b (2)"]}),
        ([f"run-{i}" for i in range(1, 12)], {"run": [f"run-{i}" for i in range(1, 12)]}),
        (["walk/0", "walk/1"], {"walk": ["walk/0", "walk/1"]}),
        (["a/x1", "a/x2", "b/x1", "b/x2"], {"a/x": ["a/x1", "a/x2"], "b/x": ["b/x1", "b/x2"]}),
        (["1", "2"], {"ui": ["1", "2"]}),
        (["icon-16", "icon-24"], {}),
        (["icon1", "icon2", "icon4"], {}),
        (["icon2", "icon3"], {}),
        (["icon1"], {}),
        (["coin_1", "coin_01", "coin_2"], {}),
        (["a1_x", "a2_x"], {}),
        (["coin", "coin_1", "coin_2"], {"coin": ["coin_1", "coin_2"]}),
    ],
)
def test_consecutive_numbers_from_0_or_1_are_animations(
    icons: Icons, files: list[str], animations: dict[str, list[str]]
) -> None:
    icons.add(*(f"{name}.png" for name in random.Random(1).sample(files, len(files))))
    assert icons.animations() == animations
    assert icons.animations(animations="none") == {}
    assert icons.names() == set(files)


def test_what_is_found_is_noted_and_that_there_is_nothing_to_play(icons: Icons) -> None:
    icons.add("coin_1.png", "coin_2.png", "gem.png")
    icons.built(movies=["gif"])
    assert "animations among the sprites: coin (2 frames)" in " ".join(icons.said.split())
    assert {path.name for path in (icons.folder / "build").glob("*.gif")} == {"ui.coin.gif"}
    icons.built({"animations": "none"}, movies=["gif"])
    assert "movies: single sprites have none" in " ".join(icons.said.split())
    assert not list((icons.folder / "build").glob("*.gif"))


def test_a_number_that_lacks_is_noted(icons: Icons) -> None:
    icons.add(*(f"walk_{i}.png" for i in (1, 2, 3, 5)))
    assert icons.animations() == {}
    assert "walk_1 to walk_5 are no animation, as number 4 is missing" in " ".join(
        icons.said.split()
    )


def test_animations_of_one_name_are_refused(icons: Icons) -> None:
    icons.add("coin_1.png", "coin_2.png", "coin-1.png", "coin-2.png")
    icons.refused("would both be the animation coin")
    assert icons.animations(animations="none") == {}


def test_a_file_that_is_added_changes_no_other_name(icons: Icons) -> None:
    icons.add("hud/close.png", "icon2.png", "coin_1.png", "coin_2.png", "7.png")
    before = icons.names()
    added = ["icon1", "coin_3", "hud", "close", "coin", "6", "zz/7", "coin_0"]
    for i, name in enumerate(added):
        icons.add(f"{name}.png")
        assert icons.names() == before | set(added[: i + 1])


def test_rates_and_loops_are_those_of_the_recipe(icons: Icons) -> None:
    icons.add("coin_1.png", "coin_2.png", "gem_1.png", "gem_2.png")
    sheet = icons.built({"rates": {"coin": 12}}, timeline={"loop": "none"})
    durations = {name: frame["duration"] for name, frame in sheet["frames"].items()}
    assert durations["coin_1"] == pytest.approx(1000 / 12, abs=1e-3)
    assert durations["gem_1"] == pytest.approx(1000 / 24, abs=1e-3)
    assert sheet["meta"]["fireAtlas"]["loops"] == {"coin": False, "gem": False}
    icons.refused("source.rates.coi", "did you mean coin?", source={"rates": {"coi": 12}})
    icons.refused(
        "source.rates", "animations is none", source={"rates": {"coin": 1}, "animations": "none"}
    )


def test_pivots_are_the_middle_unless_the_recipe_states_others(icons: Icons) -> None:
    icons.add("hud/close.png", "open.png", "coin_1.png", "coin_2.png")

    def anchors(source: dict[str, Any], **atlas: Any) -> dict[str, tuple[float, ...]]:
        frames = icons.built(source, atlas=atlas)["frames"]
        return {name: tuple(frame["anchor"].values()) for name, frame in frames.items()}

    middle = dict.fromkeys(("hud/close", "open", "coin_1", "coin_2"), (0.5, 0.5))
    assert anchors({}) == anchors({}, pivot="base") == middle
    assert set(anchors({}, pivot="bottom").values()) == {(0.5, 1)}
    pivots = {"hud/close": [0.25, 1], "coin": [0, 0], "coin_2": [1, 0]}
    assert anchors({"pivots": pivots}) == {
        "hud/close": (0.25, 1), "open": (0.5, 0.5), "coin_1": (0, 0), "coin_2": (1, 0),
    }  # fmt: skip
    icons.refused(
        "ui.yaml:1: source.pivots.hud/clos", "did you mean hud/close?",
        source={"pivots": {"hud/clos": [0, 0]}},
    )  # fmt: skip
    icons.refused("not px", source={"pivots": {"open": [12, 40]}})


def nine_patch(path: Path, across: slice, down: slice) -> Bytes:
    """Write a picture of 12 x 8 px in a frame that marks what is stretched; return the picture."""
    image = icon(path, 12, 8)
    framed = np.zeros((10, 14, 4), np.uint8)
    framed[1:-1, 1:-1] = image
    framed[0, 1:-1][across] = framed[1:-1, 0][down] = (0, 0, 0, 255)
    framed[-1, 3:7] = (0, 0, 0, 255)  # where content goes
    Image.fromarray(framed).save(path)
    return image


def test_a_nine_patch_has_the_border_that_its_frame_marks(icons: Icons) -> None:
    image = nine_patch(icons.folder / "art/panel.9.png", slice(3, 10), slice(1, 6))
    (name, frame), = icons.built()["frames"].items()  # fmt: skip
    assert name == "panel"
    assert frame["borders"] == {"left": 3, "top": 1, "right": 2, "bottom": 2}
    assert frame["scale9Borders"] == {"x": 3, "y": 1, "w": 7, "h": 5}
    assert frame["sourceSize"] == {"w": 12, "h": 8}
    (shown,) = cut_frames(with_singles_played(read_atlas(icons.folder / "build/ui.json")))
    np.testing.assert_array_equal(shown, image)
    assert icons.names(names="file") == {"panel.9.png"}
    icons.refused("has its border in its picture", source={"borders": {"panel": [1, 1, 1, 1]}})


@pytest.mark.parametrize(
    ("across", "why"), [(slice(0, 0), "no black line"), (slice(0, 9, 4), "several black lines")]
)
def test_a_nine_patch_whose_frame_is_unclear_is_refused(
    icons: Icons, across: slice, why: str
) -> None:
    nine_patch(icons.folder / "art/panel.9.png", across, slice(1, 6))
    assert icons.run("build", {}, {}) == 1
    assert why in " ".join(icons.said.split())


def test_a_picture_without_a_frame_is_no_nine_patch(icons: Icons) -> None:
    icons.add("panel.9.png")
    assert icons.run("build", {}, {}) == 1
    assert "neither black nor clear" in " ".join(icons.said.split())


def test_borders_scale_outwards_and_keep_their_sprites_whole(icons: Icons) -> None:
    image = icon(icons.folder / "art/panel.png", 21, 11)
    image[:, :4] = image[:, 18:] = 0
    Image.fromarray(image).save(icons.folder / "art/panel.png")
    source = {"borders": {"panel": [5, 3, 4, 2]}}
    sheet = icons.built(source, atlas={"scales": [1, 0.5]})
    frame = sheet["frames"]["panel"]
    assert frame["frame"]["w"] == frame["sourceSize"]["w"] == 22  # whole, and even
    assert frame["borders"] == {"left": 5, "top": 3, "right": 5, "bottom": 3}
    small = json.loads((icons.folder / "build/ui@0.5x.json").read_text())["frames"]["panel"]
    assert small["borders"] == {"left": 3, "top": 2, "right": 3, "bottom": 2}
    assert small["sourceSize"] == {"w": 11, "h": 6}
    assert icons.built()["frames"]["panel"]["frame"]["w"] == 14 + 2  # trimmed, one kept around


def test_borders_that_cannot_be_are_refused(icons: Icons) -> None:
    icons.add("panel.png")
    icons.refused("source.borders.pane", "panel?", source={"borders": {"pane": [1, 1, 1, 1]}})
    icons.refused(
        "atlas.rotate", "lies rotated", source={"borders": {"panel": [1, 1, 1, 1]}},
        atlas={"rotate": True},
    )  # fmt: skip
    icons.refused(
        "source.borders.panel: is larger than", source={"borders": {"panel": [5, 1, 5, 1]}}
    )


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"flakes": {"rate": 4}}, "flakes: is of fire"),
        ({"motion_blur": {}}, "motion_blur: is of fire"),
        ({"wind": {"level": 2}}, "wind: is of fire"),
        ({"composite": {"intensity": 2}}, "composite: is of fire"),
        ({"timeline": {"frames": 8}}, "timeline: edits a clip"),
        ({"tracks": ["light"]}, "tracks.0: is the light that a fire gives"),
        ({"maps": {"motion": "godot"}}, "maps.motion: is of fire"),
        ({"atlas": {"pixels": "heat"}}, "atlas.pixels: the sprites of ui"),
        ({"exports": ["json", "aseprite"]}, "exports.1: aseprite numbers its frames"),
    ],
)
def test_what_sprites_cannot_have_is_refused(
    icons: Icons, keys: dict[str, Any], words: str
) -> None:
    icons.add("a.png")
    icons.refused(words, **keys)


def test_a_folder_without_images_and_a_path_of_nothing_are_refused(icons: Icons) -> None:
    (icons.folder / "art/hud").mkdir(parents=True)
    (icons.folder / "art/hud/readme.txt").touch()
    icons.refused("holds 'readme.txt', but no image")
    icons.refused("holds nothing; sprites end in", source={"path": "art/*.png"})
    icons.refused("did you mean 'art'?", source={"path": "arts"})


def test_a_sprite_that_comes_or_goes_makes_the_build_stale(icons: Icons) -> None:
    icons.add("hud/deep/close.png")
    icons.built()
    assert main(["build", str(icons.recipe)]) == 0
    assert "up to date" in icons.capsys.readouterr().out
    icons.add("hud/deep/open.png")
    assert main(["build", str(icons.recipe)]) == 0
    assert "up to date" not in icons.capsys.readouterr().out
    assert read_names(icons) == {"hud/deep/close", "hud/deep/open"}
    (icons.folder / "art/hud/deep/close.png").unlink()
    assert main(["build", str(icons.recipe)]) == 0
    assert read_names(icons) == {"hud/deep/open"}


def read_names(icons: Icons) -> set[str]:
    return set(json.loads((icons.folder / "build/ui.json").read_text())["frames"])


def test_a_list_of_paths_resolved_builds_the_same(icons: Icons) -> None:
    icons.add("hud/close.png", "menu/open.png")
    source = {"path": ["art/hud", "art/menu/*.png"], "borders": {"close": [1, 1, 1, 1]}}
    before = icons.built(source)
    assert main(["check", str(icons.recipe), "--resolved"]) == 0
    icons.recipe.write_text(icons.capsys.readouterr().out)
    assert main(["build", str(icons.recipe)]) == 0
    assert json.loads((icons.folder / "build/ui.json").read_text()) == before


def test_sprites_of_16_bits_and_without_alpha_keep_their_pixels(icons: Icons) -> None:
    grey = np.random.default_rng(2).integers(0, 256, (6, 9, 3), np.uint8)
    (icons.folder / "art").mkdir()
    Image.fromarray(grey).save(icons.folder / "art/opaque.png")
    icons.built()
    (shown,) = cut_frames(with_singles_played(read_atlas(icons.folder / "build/ui.json")))
    np.testing.assert_array_equal(shown[..., :3], grey)
    assert (shown[..., 3] == 255).all()


def test_two_recipes_with_a_sprite_of_one_name_cannot_share_pages(icons: Icons) -> None:
    for name in ("hud", "menu"):
        icons.add(f"{name}/close.png")
        source = {"kind": "sprites", "path": f"art/{name}"}
        (icons.folder / f"{name}.yaml").write_text(json.dumps({"source": source}))
    host = icons.folder / "all.yaml"
    host.write_text(json.dumps({"atlas": {"members": ["hud.yaml", "menu.yaml"]}}))
    assert main(["build", str(host)]) == 1
    assert "2 frames on these pages are called close" in icons.capsys.readouterr().err


@pytest.mark.slow
def test_a_theme_of_a_thousand_icons_loses_no_name_and_merges_none(icons: Icons) -> None:
    drawn = draw_theme(icons.folder / "art")
    assert len(drawn) == NAMES
    sheet = icons.built()
    assert sheet["frames"].keys() == drawn.keys() and sheet["animations"] == {}
    places = {tuple(frame["frame"].values()) for frame in sheet["frames"].values()}
    assert len(places) == PICTURES
    atlas = with_singles_played(read_atlas(icons.folder / "build/ui.json"))
    for region, shown in zip(atlas.frames, cut_frames(atlas), strict=True):
        np.testing.assert_array_equal(shown, drawn[region.name])

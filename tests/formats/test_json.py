"""The JSON formats say where every frame is, in the words of TexturePacker and its readers."""

import json
from dataclasses import replace
from itertools import accumulate
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import BaseModel, ConfigDict, Field

from fire_atlas.atlas.pages import build_sheets
from fire_atlas.atlas.sheet import AtlasSheet
from fire_atlas.core.errors import OutputError
from fire_atlas.pipeline.files.exports import exporter
from fire_atlas.recipe.output import Atlas, ExportName
from tests.support.sheets import animation_of, product_of, sheet_of, sheet_of_fire, sheets_of

JSON: tuple[ExportName, ...] = ("json", "json-array", "phaser", "aseprite")


def exported(sheet: AtlasSheet, name: ExportName = "json") -> dict[str, Any]:
    """What each file holds, by its name."""
    return {file.name: json.loads(file.data) for file in exporter(name)(product_of(sheet))}


def test_a_trimmed_frame_tells_where_it_was() -> None:
    frame = exported(sheet_of([(20, 30)]))["campfire.json"]["frames"]["campfire/0000"]
    assert frame == {
        "frame": {"x": 0, "y": 0, "w": 20, "h": 30},
        "rotated": False,
        "trimmed": True,
        "spriteSourceSize": {"x": 5, "y": 3, "w": 20, "h": 30},
        "sourceSize": {"w": 60, "h": 60},
        "duration": 41.667,
        "anchor": {"x": 0.5, "y": 0.9},
        "pivot": {"x": 0.5, "y": 0.9},
    }


def test_an_untrimmed_frame_says_so() -> None:
    frame = exported(sheet_of([(20, 30)], trim="none"))["campfire.json"]["frames"]["campfire/0000"]
    assert frame["trimmed"] is False
    assert frame["frame"] == {"x": 0, "y": 0, "w": 60, "h": 60}


def test_a_turned_frame_keeps_its_upright_size() -> None:
    sheet = sheet_of([(64 - 10, 8), (8, 54)], rotate=True, padding=0, max_size=64)
    frames = exported(sheet)["campfire.json"]["frames"].values()
    assert sorted(frame["rotated"] for frame in frames) == [False, True]
    assert [(f["frame"]["w"], f["frame"]["h"]) for f in frames] == [(54, 8), (8, 54)]


def test_meta_tells_how_to_draw_the_page() -> None:
    sheet = sheet_of([(20, 30)], alpha="additive", blend_space="linear")
    meta = exported(sheet)["campfire.json"]["meta"]
    assert meta["image"] == "campfire.png"
    assert meta["size"] == {"w": 20, "h": 30}
    assert meta["scale"] == "1"
    assert meta["fireAtlas"] == {
        "alpha": "additive",
        "blendSpace": "linear",
        "fps": 24,
        "loops": {"campfire": True},
        "safeMipLevel": 4,
    }
    assert "related_multi_packs" not in meta


def test_a_grid_tells_how_it_divides() -> None:
    meta = exported(sheet_of([(20, 30)] * 4, layout="grid"))["campfire.json"]["meta"]
    assert meta["fireAtlas"]["grid"] == {
        "columns": 2, "rows": 2, "cellWidth": 22, "cellHeight": 32,
    }  # fmt: skip


def test_several_pages_link_from_the_first_and_share_the_animation_out() -> None:
    sheet = build_sheets(
        "campfire", [animation_of([(20, 30)] * 9)], Atlas(max_size=64, dedupe=False)
    )[0]  # fmt: skip
    files = exported(sheet)
    assert list(files) == ["campfire.json", "campfire-1.json"]
    links = [file["meta"].get("related_multi_packs") for file in files.values()]
    assert links == [["campfire-1.json"], []]
    for file in files.values():
        assert file["animations"]["campfire"] == list(file["frames"])
    joined = [frame for file in files.values() for frame in file["animations"]["campfire"]]
    assert joined == [f"campfire/{i:04}" for i in range(9)]


def test_scales_have_files_of_their_own_that_link_among_themselves() -> None:
    sheets = sheets_of([(20, 30)] * 9, max_size=80, dedupe=False, scales=[1, 0.5])
    files = {name: data for sheet in sheets for name, data in exported(sheet).items()}
    assert list(files) == [
        "campfire.json", "campfire-1.json", "campfire@0.5x.json", "campfire@0.5x-1.json",
    ]  # fmt: skip
    half = files["campfire@0.5x.json"]
    assert half["meta"]["scale"] == "0.5"
    assert half["meta"]["image"] == "campfire@0.5x.png"
    assert half["meta"]["related_multi_packs"] == ["campfire@0.5x-1.json"]
    assert half["frames"].keys() == files["campfire.json"]["frames"].keys()


@pytest.mark.parametrize("name", JSON)
def test_all_arrangements_say_the_same_of_each_frame(name: ExportName) -> None:
    sheet = sheet_of_fire()
    wanted = list(exported(sheet)["campfire.json"]["frames"].values())
    (data,) = exported(sheet, name).values()
    (data,) = data["textures"] if name == "phaser" else [data]
    frames = data["frames"].values() if name == "json" else data["frames"]
    if name == "aseprite":
        wanted = [frame | {"duration": 42} for frame in wanted]
        for frame in wanted[1::3]:
            frame["duration"] = 41
    assert [{k: v for k, v in frame.items() if k != "filename"} for frame in frames] == wanted


def test_frames_of_an_array_have_their_names_or_aseprites_numbers() -> None:
    sheet = sheet_of_fire()
    array = exported(sheet, "json-array")["campfire.array.json"]
    assert [frame["filename"] for frame in array["frames"]] == [
        f"campfire/{i:04}" for i in range(9)
    ]
    numbered = exported(sheet, "aseprite")["campfire.aseprite.json"]
    assert [frame["filename"] for frame in numbered["frames"]] == [str(i) for i in range(9)]
    assert numbered["animations"] == {"campfire": [str(i) for i in range(9)]}


def test_tags_say_which_frames_an_animation_plays_and_how_often() -> None:
    animations = [
        animation_of([(20, 30)] * 3, "burn", seed=1),
        animation_of([(9, 9)] * 2, "die", loop=False),
    ]
    sheet = build_sheets("campfire", animations, Atlas())[0]
    assert exported(sheet)["campfire.json"]["meta"]["frameTags"] == [
        {"name": "burn", "from": 0, "to": 2, "direction": "forward"},
        {"name": "die", "from": 3, "to": 4, "direction": "forward", "repeat": "1"},
    ]


def test_phaser_gets_all_pages_and_the_animations_in_one_file() -> None:
    animations = [
        animation_of([(20, 30)] * 9),
        animation_of([(9, 9)] * 2, "die", loop=False, seed=5),
    ]
    sheet = build_sheets("campfire", animations, Atlas(max_size=64))[0]
    (data,) = exported(sheet, "phaser").values()
    assert [texture["image"] for texture in data["textures"]] == [p.file for p in sheet.pages]
    assert len(sheet.pages) > 1
    assert [(a["key"], a["repeat"], len(a["frames"])) for a in data["anims"]] == [
        ("campfire", -1, 9),
        ("die", 0, 2),
    ]
    assert data["anims"][0]["frames"][0] == {"key": "campfire", "frame": "campfire/campfire/0000"}
    assert data["anims"][0]["frameRate"] == pytest.approx(24)


class AsepriteFrame(BaseModel):
    """A frame as a typed reader of Aseprite's files has it: whole numbers, no text for numbers."""

    model_config = ConfigDict(strict=True)
    filename: str
    frame: dict[str, int]
    duration: int = Field(ge=1)


@given(fps=st.floats(0.5, 240), count=st.integers(1, 40))
def test_a_typed_reader_of_aseprites_files_finds_the_length_of_the_animation(
    fps: float, count: int
) -> None:
    sprites = animation_of([(4, 4)] * count)
    sheet = build_sheets("campfire", [replace(sprites, duration=1000 / fps)], Atlas())[0]
    frames = exported(sheet, "aseprite")["campfire.aseprite.json"]["frames"]
    durations = [AsepriteFrame.model_validate(frame).duration for frame in frames]
    for played, end in enumerate(accumulate(durations), 1):
        assert end == pytest.approx(played * 1000 / fps, abs=0.501)


def test_aseprite_on_several_pages_is_refused_with_advice() -> None:
    sheet = sheet_of([(20, 30)] * 9, max_size=64, dedupe=False)
    with pytest.raises(OutputError, match=r"aseprite describes one page.*atlas\.max_size"):
        exported(sheet, "aseprite")


def test_the_file_has_a_frame_a_line_and_ends_with_a_newline() -> None:
    (file,) = exporter("json")(product_of(sheet_of([(20, 30)] * 3)))
    lines = file.data.decode().split("\n")
    assert [line[:15] for line in lines[1:4]] == [f'"campfire/000{i}"' for i in range(3)]
    assert lines[-1] == ""

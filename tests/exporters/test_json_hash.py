"""The JSON hash says where every frame is, in the words of TexturePacker."""

import json
from typing import Any

import numpy as np

from fire_atlas.atlas.layout import AtlasSheet, Sprite
from fire_atlas.atlas.pages import lay_out
from fire_atlas.exporters.json_hash import export_json_hash
from fire_atlas.recipe.output import Atlas


def sheet_of(sizes: list[tuple[int, int]], **settings: Any) -> AtlasSheet:
    """A sheet of full sprites of these (width, height), at (5, 3) of a 60 × 60 frame."""
    sprites = [Sprite(np.ones((height, width, 4), np.uint8), 5, 3) for width, height in sizes]
    return lay_out(
        "campfire", sprites, frame_size=(60, 60), fps=24, settings=Atlas.model_validate(settings)
    )


def exported(sheet: AtlasSheet) -> dict[str, Any]:
    """What each file holds, by its name."""
    return {file.name: json.loads(file.data) for file in export_json_hash(sheet)}


def test_a_trimmed_frame_tells_where_it_was() -> None:
    frame = exported(sheet_of([(20, 30)]))["campfire.json"]["frames"]["campfire/0000"]
    assert frame == {
        "frame": {"x": 0, "y": 0, "w": 20, "h": 30},
        "rotated": False,
        "trimmed": True,
        "spriteSourceSize": {"x": 5, "y": 3, "w": 20, "h": 30},
        "sourceSize": {"w": 60, "h": 60},
        "duration": 41.667,
        "anchor": {"x": 0.5, "y": 1},
    }


def test_an_untrimmed_frame_says_so() -> None:
    frame = exported(sheet_of([(20, 30)], trim="none"))["campfire.json"]["frames"]["campfire/0000"]
    assert frame["trimmed"] is False
    assert frame["frame"] == {"x": 0, "y": 0, "w": 60, "h": 60}


def test_meta_tells_how_to_draw_the_page() -> None:
    meta = exported(sheet_of([(20, 30)], alpha="additive", blend_space="linear"))["campfire.json"][
        "meta"
    ]
    assert meta["image"] == "campfire.png"
    assert meta["size"] == {"w": 20, "h": 30}
    assert meta["scale"] == "1"
    assert meta["fireAtlas"] == {"alpha": "additive", "blendSpace": "linear", "fps": 24}
    assert "related_multi_packs" not in meta


def test_several_pages_link_from_the_first_and_share_the_animation_out() -> None:
    files = exported(sheet_of([(20, 30)] * 9, max_size=64))
    assert list(files) == ["campfire.json", "campfire-1.json"]
    links = [file["meta"].get("related_multi_packs") for file in files.values()]
    assert links == [["campfire-1.json"], None]
    for file in files.values():
        assert file["animations"]["campfire"] == list(file["frames"])
    joined = [frame for file in files.values() for frame in file["animations"]["campfire"]]
    assert joined == [f"campfire/{i:04}" for i in range(9)]


def test_the_file_has_a_frame_a_line_and_ends_with_a_newline() -> None:
    (file,) = export_json_hash(sheet_of([(20, 30)] * 3))
    lines = file.data.decode().split("\n")
    assert [line[:15] for line in lines[1:4]] == [f'"campfire/000{i}"' for i in range(3)]
    assert lines[-1] == ""

"""What PixiJS and Phaser understand, by their own parsers, is what the sheet says."""

import json
import subprocess
from pathlib import Path
from typing import Any

import pytest

from fire_atlas.atlas.sheet import AtlasSheet, Region
from fire_atlas.pipeline.files.exports import exporter
from tests.support.sheets import product_of, sheet_of_fire

WEB = Path(__file__).parent / "web"


def understood(node: str, sheet: AtlasSheet, folder: Path) -> Any:
    for file in exporter("json")(product_of(sheet)):
        (folder / file.name).write_bytes(file.data)
    ran = subprocess.run(
        [node, WEB / "parse.mjs", folder / "campfire.json"],
        capture_output=True,
        text=True,
        encoding="utf-8",
        check=False,
    )
    assert ran.returncode == 0, ran.stderr
    assert not ran.stderr
    return json.loads(ran.stdout)


def expected(region: Region, trim: list[int] | None) -> dict[str, Any]:
    return {
        "frame": [region.x, region.y, region.width, region.height],
        "trim": trim,
        "size": [60, 60],
        "anchor": [0.5, 0.9],
    }


def expected_trim(region: Region) -> list[int]:
    return [region.trim_x, region.trim_y, region.width, region.height]


@pytest.mark.parametrize("max_size", [64, 4096])
@pytest.mark.parametrize("trim", ["frame", "animation", "none"])
def test_both_see_every_frame_where_it_is(
    node: str, trim: str, max_size: int, tmp_path: Path
) -> None:
    sheet = sheet_of_fire(trim=trim, max_size=max_size)
    seen = understood(node, sheet, tmp_path)
    assert len(seen["pixi"]) == len(seen["phaser"]) == len(sheet.pages)
    for page in range(len(sheet.pages)):
        regions = [region for region in sheet.regions if region.page == page]
        trims = {r.name: None if trim == "none" else expected_trim(r) for r in regions}
        wanted = {region.name: expected(region, trims[region.name]) for region in regions}
        assert seen["pixi"][page]["frames"] == wanted
        assert seen["phaser"][page]["frames"] == wanted


@pytest.mark.parametrize("max_size", [64, 4096])
def test_pixi_finds_every_frame_of_the_animation(node: str, max_size: int, tmp_path: Path) -> None:
    sheet = sheet_of_fire(trim="none" if max_size == 64 else "frame", max_size=max_size)
    pages = understood(node, sheet, tmp_path)["pixi"]
    assert (len(pages) > 1) == (max_size == 64)
    played = [frame for page in pages for frame in page["animations"]["campfire"]]
    assert sorted(played) == list(sheet.animations[0].frames)


def test_phaser_hands_the_meta_data_on(node: str, tmp_path: Path) -> None:
    (page,) = understood(node, sheet_of_fire(), tmp_path)["phaser"]
    assert page["meta"]["fireAtlas"]["alpha"] == "straight"
    assert page["meta"]["fireAtlas"]["fps"] == 24


def test_the_lock_file_names_no_host() -> None:
    packages = json.loads((WEB / "package-lock.json").read_text())["packages"]
    assert not [name for name, package in packages.items() if "resolved" in package]

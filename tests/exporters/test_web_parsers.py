"""What PixiJS and Phaser understand, by their own parsers, is what the sheet says."""

import json
import os
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fire_atlas.atlas.layout import AtlasSheet, Region, Sprite
from fire_atlas.atlas.pages import lay_out
from fire_atlas.exporters.registry import exporter
from fire_atlas.recipe.output import Atlas

WEB = Path(__file__).parent / "web"


@pytest.fixture(scope="module")
def node() -> str:
    """The node that runs the parsers; without them these tests are skipped, but not in CI."""
    modules = Path(os.environ.get("FIRE_ATLAS_NODE_MODULES") or WEB / "node_modules")
    found = shutil.which("node")
    if found and (modules / "pixi.js").is_dir() and (modules / "phaser").is_dir():
        return found
    advice = "needs Node.js 20 or later and `npm ci --prefix tests/exporters/web`"
    if os.environ.get("CI"):
        pytest.fail(advice)
    pytest.skip(advice)


def sheet_of_fire(trim: str, max_size: int) -> AtlasSheet:
    """Nine frames of differing sizes; the fifth is empty."""
    rng = np.random.default_rng(2)
    sprites = [
        Sprite(np.full((int(h), int(w), 4), 200, np.uint8), int(x), int(y))
        for w, h, x, y in rng.integers(8, 30, (9, 4))
    ]
    sprites[4] = Sprite(np.zeros((1, 1, 4), np.uint8), 0, 0)
    settings = Atlas.model_validate({"trim": trim, "max_size": max_size})
    return lay_out(
        "campfire", sprites, frame_size=(60, 60), fps=24, settings=settings, anchor=(0.5, 0.9)
    )


def understood(node: str, sheet: AtlasSheet, folder: Path) -> Any:
    for file in exporter("json")(sheet):
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
    sheet = sheet_of_fire(trim, max_size)
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
    sheet = sheet_of_fire("none" if max_size == 64 else "frame", max_size)
    pages = understood(node, sheet, tmp_path)["pixi"]
    assert (len(pages) > 1) == (max_size == 64)
    played = [frame for page in pages for frame in page["animations"]["campfire"]]
    assert played == list(sheet.animations["campfire"])


def test_phaser_hands_the_meta_data_on(node: str, tmp_path: Path) -> None:
    (page,) = understood(node, sheet_of_fire("frame", 4096), tmp_path)["phaser"]
    assert page["meta"]["fireAtlas"] == {"alpha": "straight", "blendSpace": "srgb", "fps": 24}


def test_the_lock_file_names_no_host() -> None:
    packages = json.loads((WEB / "package-lock.json").read_text())["packages"]
    assert not [name for name, package in packages.items() if "resolved" in package]

"""Clips that others filmed, drew and simulated."""

import json
from pathlib import Path

import numpy as np
import pytest

from tests.support.repo import Repo, pages, tracks_of

pytestmark = pytest.mark.slow

FOLDERS = [
    "cartoon_fluent_fire", "cartoon_freedoom_fire", "cartoon_tauran_flame_sheet",
    "cartoon_wesnoth_campfire", "cartoon_wesnoth_fireball_impact", "real_candle_red",
    "real_fireplace_gif", "real_firewall_stock", "sim_unity_flame02", "sim_unity_flame03",
]  # fmt: skip

ORIGINALS = {
    "cartoon_fluent_fire/original/1f525.webp": None,
    "real_fireplace_gif/original/fireplace.gif": None,
    "real_candle_red/clip.mp4": None,
    "real_firewall_stock/original/fire.mp4": None,
    "cartoon_tauran_flame_sheet/original/flame.png": {"columns": 12, "rows": 6},
    "sim_unity_flame03/original/Flame03_16x4.png": {"columns": 16, "rows": 4},
}


def assert_sound(repo: Repo, name: str) -> None:
    """Check what holds for every effect: finite flakes that are seen, and pages with light."""
    tracks = tracks_of(repo.build, name)
    rows = np.array([row for frame in tracks["frames"] for row in frame["rows"]])
    assert len(rows) > 0, "a fire without flakes"
    assert np.isfinite(rows).all()
    assert len(tracks["frames"]) == tracks["frame_count"]
    column = {name: rows[:, i] for i, name in enumerate(tracks["columns"])}
    assert (column["size"] > 0).all() and (column["stretch"] >= 1).all()
    assert (column["a"] >= 0).all()
    found = [picture for _, picture in pages(repo.build, name)]
    assert found and all(picture.any() for picture in found)
    assert all(path.stat().st_size for path in repo.build.iterdir())


@pytest.mark.parametrize("clip", FOLDERS)
def test_a_real_clip_becomes_an_effect(clips: Path, repo: Repo, clip: str) -> None:
    meta = json.loads((clips / clip / "meta.json").read_text(encoding="utf-8"))
    source = {"path": str(clips / clip / "frames"), "fps": meta["fps"]}
    repo.built(repo.recipe(source=source))
    count = tracks_of(repo.build, "fire")["frame_count"]
    # These two end elsewhere than they begin, and are cut and cross-faded.
    is_cut = clip in {"real_candle_red", "real_firewall_stock"}
    assert 20 <= count < meta["frames"] if is_cut else count == meta["frames"]
    assert tracks_of(repo.build, "fire")["size"] == meta["size"]
    assert_sound(repo, "fire")


@pytest.mark.parametrize("original", ORIGINALS)
def test_a_clip_as_it_was_published_becomes_an_effect(
    clips: Path, repo: Repo, original: str
) -> None:
    source = {"path": str(clips / original), "grid": ORIGINALS[original], "count": 24}
    given = {key: value for key, value in source.items() if value is not None}
    repo.built(repo.recipe(source={**given, "height": 120}))
    assert_sound(repo, "fire")

"""Scripts that gdtoolkit accepts; the geometry and the timing of frames."""

import subprocess
import sysconfig
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fire_atlas.atlas.sheet import Region
from fire_atlas.effect.composition.light import ClipLight, FrameLight
from fire_atlas.engines.godot.addon import addon_files
from fire_atlas.engines.godot.sprite_frames import (
    FrameBounds,
    frame_timing,
    pivot,
)
from fire_atlas.formats.product import Product
from fire_atlas.pipeline.files.exports import exported_files
from fire_atlas.recipe.models import Recipe
from tests.engines.godot.test_flakes import some_tracks
from tests.support.sheets import sheet_of_fire


@pytest.mark.parametrize("program", ["gdparse", "gdlint"])
def test_the_scripts_are_sound(program: str, tmp_path: Path) -> None:
    tracks = {"campfire": some_tracks()}
    light = {"campfire": ClipLight(24, 60, 60, True, (FrameLight(np.ones(3), 30, 30, 1800),))}
    product = Product((sheet_of_fire(),), tracks, frozenset(), lambda name: None, lights=light)
    scripts = [file for file in exported_files(["godot"], product, {}) if file.name.endswith(".gd")]
    assert len(scripts) == 4
    scripts += [file for file in addon_files() if file.name.endswith(".gd")]
    for file in scripts:
        (tmp_path / file.name).write_bytes(file.data)
    tool = Path(sysconfig.get_path("scripts")) / program
    ran = subprocess.run(
        [tool, *(tmp_path / file.name for file in scripts)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert ran.returncode == 0, ran.stdout + ran.stderr


CLIP = {"path": "clip"}


@pytest.mark.parametrize(
    ("source", "exports", "atlas", "alpha"),
    [
        (CLIP, ["godot"], {}, "premultiplied"),
        (CLIP, ["unity"], {}, "premultiplied"),
        (CLIP, ["godot", {"unity": {"pixels_per_unit": 32}}], {"max_size": 512}, "premultiplied"),
        (CLIP, ["godot"], {"alpha": "straight"}, "straight"),
        (CLIP, ["godot"], {"bleed": 3}, "straight"),
        (CLIP, ["godot", "json"], {}, "straight"),
        (CLIP, ["json"], {}, "straight"),
        (CLIP, ["godot"], {"members": ["icons.yaml"]}, "straight"),
        ({"kind": "sprites", "path": "ui"}, ["godot"], {}, "straight"),
    ],
)
def test_fire_for_engines_alone_is_premultiplied_by_default(
    source: dict[str, str], exports: Any, atlas: dict[str, Any], alpha: str
) -> None:
    given = {"source": source, "exports": exports, "atlas": atlas}
    assert Recipe.model_validate(given).atlas.alpha == alpha


@pytest.mark.parametrize(
    ("exports", "atlas", "bleed"),
    [
        (["godot"], {"alpha": "straight"}, 4),
        (["godot"], {"bleed": 3}, 3),
        (["godot"], {}, 0),
        (["json", "godot"], {"alpha": "straight"}, 4),
        (["godot"], {"bleed": 0}, 0),
        (["godot"], {"alpha": "premultiplied"}, 0),
        (["json"], {}, 0),
    ],
)
def test_straight_pages_bleed_by_default(exports: Any, atlas: dict[str, Any], bleed: int) -> None:
    given = {"source": {"path": "clip"}, "exports": exports, "atlas": atlas}
    assert Recipe.model_validate(given).atlas.bleed == bleed


def region(width: int, height: int, anchor: tuple[float, float], trim: tuple[int, ...]) -> Region:
    x, y, w, h = trim
    return Region("a/0000", 0, 0, 0, w, h, False, x, y, width, height, anchor, 40.0)


def test_frames_that_are_alike_stand_on_their_own_untrimmed_frame() -> None:
    frames = [region(64, 96, (0.5, 0.9), (6, 25, 54, 71)), region(64, 96, (0.5, 0.9), (0, 0, 1, 1))]
    stage = FrameBounds.of(frames)
    assert (stage.x, stage.y, stage.width, stage.height) == (-32, -86.4, 64, 96)
    assert stage.margin(frames[0]) == (6, 25, 10, 25)
    assert stage.margin(frames[1]) == (0, 0, 63, 95)


numbers = st.integers(1, 300)
anchors = st.tuples(st.floats(-10, 10), st.floats(-10, 10))


@st.composite
def regions(draw: st.DrawFn) -> Region:
    width, height = draw(numbers), draw(numbers)
    x, y = draw(st.integers(0, width - 1)), draw(st.integers(0, height - 1))
    trim = x, y, draw(st.integers(1, width - x)), draw(st.integers(1, height - y))
    return region(width, height, draw(anchors), trim)


@given(st.lists(regions(), min_size=1, max_size=5))
def test_every_pivot_is_at_the_nodes_own_place_and_every_frame_inside(made: list[Region]) -> None:
    stage = FrameBounds.of(made)
    for each in made:
        margin = stage.margin(each)
        x, y = pivot(each)
        # Where the engine puts the trimmed frame, and where its frame's pivot then is.
        assert stage.x + margin.left - each.trim_x + x == pytest.approx(0, abs=1e-4)
        assert stage.y + margin.top - each.trim_y + y == pytest.approx(0, abs=1e-4)
        assert margin.width + each.width == stage.width
        assert margin.height + each.height == stage.height
        assert -1e-4 <= margin.left <= margin.width + 1e-4
        assert -1e-4 <= margin.top <= margin.height + 1e-4


def test_frames_of_one_length_last_one_tick() -> None:
    assert frame_timing([1000 / 24] * 3) == (24.0, (1.0, 1.0, 1.0))
    assert frame_timing([1000 / 29.97]) == (29.97, (1.0,))


def test_longer_frames_last_more_ticks() -> None:
    assert frame_timing([50.0, 125.0, 50.0]) == (20.0, (1.0, 2.5, 1.0))
    assert frame_timing([300.0, 200.0]) == (5.0, (1.5, 1.0))


@given(st.lists(st.integers(1, 30), min_size=1, max_size=12))
def test_ticks_last_as_long_as_the_frames(hundredths: list[int]) -> None:
    durations = [10.0 * each for each in hundredths]
    speed, ticks = frame_timing(durations)
    assert [1000 * tick / speed for tick in ticks] == pytest.approx(durations, rel=1e-4)
    assert min(ticks) == 1

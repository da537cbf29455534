"""The automatic number of flakes: it suits the size of the fire."""

from pathlib import Path

import numpy as np
import pytest
from fires import Burnt, burn, campfire, clip_of, looped, real_clip

from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import Pixels

_LONG = 5.0
"""Seconds for which births are counted."""


def _births_a_second(burnt: Burnt) -> float:
    return len(burnt.analysis.spawns.tick) / (burnt.clip.count / burnt.clip.fps)


def _shed(clip: Clip) -> float:
    return _births_a_second(burn(looped(clip, _LONG), {"timeline": {"loop": "none"}}))


def test_a_candle_sheds_a_few_and_a_wall_of_fire_many(clips: Path) -> None:
    candle = _shed(real_clip(clips, "real_candle_red"))
    wall = _shed(real_clip(clips, "real_firewall_stock"))
    assert 4 <= candle <= 22
    assert wall > 4 * candle


def test_a_sprite_of_few_pixels_is_not_covered_with_flakes(clips: Path) -> None:
    """There they are drawn larger than they are."""
    burnt = burn(real_clip(clips, "cartoon_tauran_flame_sheet"))
    covered = [np.mean(burnt.finished(i)[..., 3] > 0.02) for i in range(0, 72, 8)]
    plain = [np.mean(burnt.clip.read(i)[..., 3] > 0.02) for i in range(0, 72, 8)]
    assert np.mean(covered) - np.mean(plain) < 0.15


def test_the_number_does_not_depend_on_the_resolution() -> None:
    """Where flakes can be drawn as small as they are."""
    assert _shed(campfire(320)) == pytest.approx(_shed(campfire(240)), rel=0.15)


def test_the_same_fire_in_a_larger_frame_sheds_fewer_as_flakes_are_larger_there() -> None:
    clip = campfire(240)

    def in_a_corner(frame: Pixels) -> Pixels:
        return np.pad(frame, ((240, 0), (0, 0), (0, 0)))

    frames = [in_a_corner(clip.read(i)) for i in range(clip.count)]
    assert _shed(clip_of(frames)) < 0.5 * _shed(clip)


def test_of_a_single_picture_all_of_the_flame_counts() -> None:
    fire = campfire(240)
    still, moving = burn(clip_of([fire.read(0)])), burn(fire)
    assert still.study.extent == pytest.approx(moving.study.extent, rel=0.5)


def test_a_number_is_taken_as_it_is() -> None:
    keys = {"flakes": {"rate": 300, "bursts": 0}, "timeline": {"loop": "none"}}
    assert _births_a_second(burn(looped(campfire(160), _LONG), keys)) == pytest.approx(300, rel=0.1)

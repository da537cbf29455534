"""A flame filmed in a dark room: its veil goes, what stands in it stays, and fire is untouched."""

from dataclasses import replace

import numpy as np
import pytest

from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import Pixels, as_plane, encode_unit, srgb_to_linear, unpremultiply
from fire_atlas.core.workers import Workers
from fire_atlas.effect.flame.room import without_room
from fire_atlas.sources.matte import luminance_of_light
from tests.support.clips import clip_of, open_clip, real

HEIGHT, WIDTH, FRAMES = 120, 160, 16


def candle(veil: float, wall: float = 0.0, space: str = "srgb") -> Clip:
    """A flame that flickers over red wax, which is unlit towards its foot; behind it a wall that is
    ``veil`` of 255 bright at the left, and at the right ``wall``."""
    row, column = np.mgrid[:HEIGHT, :WIDTH] + 0.5
    chance = np.random.default_rng(5)
    room = wall + (veil - wall) * np.clip(1.2 - column / 90, 0, 1)
    wax = (np.abs(column - 60) < 24) & (row > 78)
    lit = 190 * np.clip(1 - (row - 78) / 30, 0, 1)

    def frame(i: int) -> Pixels:
        grain = chance.normal(0, 1, room.shape)
        shown = np.stack([room + grain, 0.8 * room + grain, 0.4 * room + grain], axis=2)
        shown[wax] = np.stack([lit, 0.12 * lit, 0.1 * lit], axis=2)[wax]
        sway = 2.5 * np.sin(2 * np.pi * i / 8) * np.clip(78 - row, 0, 60) / 60
        up = np.clip((76 - row) / (44 + 4 * np.sin(2 * np.pi * i / 5)), 0, 1)
        inside = (np.abs(column - 60 - sway) < 7 * np.sqrt(up * (1 - up)) * 2) & (up > 0)
        shown[inside] = (255, 225, 150)
        light = srgb_to_linear(np.clip(shown, 0, 255) / 255)
        return luminance_of_light(np.dstack([light, np.ones_like(row)]).astype(np.float32), space)

    clip = clip_of([frame(i) for i in range(FRAMES)], matte="luminance")
    return replace(clip, blend_space=space)


def cleared(clip: Clip) -> tuple[Clip, list[str]]:
    notes = list[str]()
    with Workers(2) as workers:
        return without_room(clip, workers, notes.append), notes


def shown(pixels: Pixels, space: str) -> np.ndarray:
    """Over black, of 255."""
    if space == "linear":
        return 255 * encode_unit(np.ascontiguousarray(pixels[..., :3]))
    return 255 * encode_unit(as_plane(unpremultiply(pixels))) * pixels[..., 3:]


@pytest.mark.parametrize("space", ["srgb", "linear"])
def test_the_veil_goes_and_wax_and_flame_stay(space: str) -> None:
    clip = candle(veil=20, space=space)
    clean, notes = cleared(clip)
    assert len(notes) == 1 and "the veil of the room goes, and what stands in it" in notes[0]
    for i in (0, 5, 11):
        before, after = clip.read(i), clean.read(i)
        away = np.ones((HEIGHT, WIDTH), np.bool_)
        away[20:, 25:95] = False
        assert shown(before, space)[away].max() > 15
        assert shown(after, space)[away].max() < 2 and after[..., 3][away].max() < 0.01
        assert (after[82:118, 40:80, 3] > 0.99).all(), "also where no light falls on the wax"
        assert before[110:, 40:80, 3].max() < 0.1
        flame = before[..., 1] > 0.5
        assert flame.sum() > 200
        assert np.abs(shown(after, space) - shown(before, space))[flame].max() < 1


def test_fire_before_black_is_not_touched() -> None:
    for name in ("torch", "campfire"):
        clip = open_clip(name)
        clean, notes = cleared(clip)
        assert clean is clip and notes == []


def test_a_room_that_is_lit_is_noted() -> None:
    clip = candle(veil=90, wall=70)
    clean, notes = cleared(clip)
    assert len(notes) >= 1
    assert "source.black" in notes[0] and "source.crop" in notes[0]
    assert np.abs(clean.read(3)[..., :3] - clip.read(3)[..., :3]).max() < 1e-3


@pytest.mark.parametrize(
    ("name", "changes"), [real("real_candle_red", True), real("real_firewall_stock", False)]
)
def test_real_footage(name: str, changes: bool) -> None:
    clip = open_clip(name)
    clean, _ = cleared(clip)
    assert (clean is not clip) == changes

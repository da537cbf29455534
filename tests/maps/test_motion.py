"""Motion that was invented is found again, and what cannot be known is left alone."""

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from typing import get_args

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from fire_atlas.core.pixels import Bytes, as_plane
from fire_atlas.core.workers import Workers
from fire_atlas.maps.vectors import estimate, steps
from fire_atlas.maps.vectors.cells import change_weight, extended
from fire_atlas.maps.vectors.cross_validation import residuals, two_fold
from fire_atlas.maps.vectors.encoding import MotionEncoding, motion_encoding
from fire_atlas.maps.vectors.estimate import Motion, estimate_motion
from fire_atlas.maps.vectors.flow import (
    Method,
    StepMotion,
    Vectors,
    displayed_thumbnail,
    step_motion,
)
from fire_atlas.maps.vectors.held_out import gaps_to_test, hold_out
from fire_atlas.maps.vectors.steps import Steps
from fire_atlas.recipe.output import Engine

SIZE = 160
Array = NDArray[np.float64]


def paint(x: Array, y: Array) -> Bytes:
    """A cloud with soft edges, as wide as half a picture, of waves that repeat nowhere in it."""
    waves = sum(
        np.sin(x / a + y / b + c)
        for a, b, c in ((4.1, 9.3, 0.3), (-7.7, 5.9, 1.9), (13.1, -6.1, 4.0), (-17.9, -11.3, 2.2))
    )
    edge = np.clip((SIZE / 3 - np.hypot(x, y)) / 6, 0, 1)
    light = np.clip(130 + 30 * waves, 20, 250) * edge
    return np.rint(np.dstack([light, light * 0.6, light * 0.2, edge * 255])).astype(np.uint8)


def clip(place: Callable[[Array, Array, int], tuple[Array, Array]], count: int = 7) -> list[Bytes]:
    """Frames that show at (x, y), from the middle, what was at ``place`` in the beginning."""
    y, x = np.mgrid[:SIZE, :SIZE] - (SIZE - 1) / 2
    return [paint(*place(x, y, i)) for i in range(count)]


def learned(
    pictures: list[Bytes],
    skipped: Mapping[int, tuple[float, Bytes]] | None = None,
    *,
    loop: bool = False,
    jobs: int = 2,
) -> Motion:
    with Workers(jobs) as workers:
        reads, size = motion_encoding("unity"), (SIZE, SIZE)
        return estimate_motion(pictures, skipped or {}, size, loop, reads, workers, lambda: None)


def error_inside(found: NDArray[np.float16], true: Array, shown: Bytes) -> Array:
    inside = cv2.erode((shown[..., 3] > 250).astype(np.uint8), np.ones((5, 5))) > 0
    off: Array = np.linalg.norm(found.astype(np.float64) - true, axis=2)[inside]
    return off


@pytest.mark.parametrize("step", [(2.0, -3.0), (-4.5, 1.25), (0.4, -6.0)])
def test_a_translation_is_found_to_half_a_pixel(step: tuple[float, float]) -> None:
    shift = 3  # so that the cloud stays in the picture
    frames = clip(lambda x, y, i: (x - step[0] * (i - shift), y - step[1] * (i - shift)))
    motion = learned(frames)
    for i in range(1, 6):
        off = error_inside(motion.cells[i], np.array(step), frames[i])
        assert np.percentile(off, 99) < 0.5


def turning(count: int, turn: float) -> list[Bytes]:
    """A cloud that turns, so many radians a frame."""

    def place(x: Array, y: Array, i: int) -> tuple[Array, Array]:
        cos, sin = math.cos(turn * i), math.sin(turn * i)
        return x * cos + y * sin, -x * sin + y * cos

    return clip(place, count)


def test_a_rotation_is_found_to_half_a_pixel() -> None:
    turn = math.radians(3)
    frames = turning(7, turn)
    motion = learned(frames)
    y, x = np.mgrid[:SIZE, :SIZE] - (SIZE - 1) / 2
    # What is at p now was at R⁻½ p half a step ago: the vector is R½ p − R⁻½ p.
    true = 2 * math.sin(turn / 2) * np.dstack([-y, x])
    for i in range(1, 6):
        assert np.percentile(error_inside(motion.cells[i], true, frames[i]), 99) < 0.5


def test_what_stands_still_has_no_vectors() -> None:
    motion = learned(clip(lambda x, y, i: (x, y)))
    assert not np.any(motion.cells)


def test_noise_that_cannot_be_predicted_has_no_vectors() -> None:
    rng = np.random.default_rng(5)
    frames = []
    for _ in range(10):
        noise = cv2.GaussianBlur(rng.normal(128, 300, (SIZE, SIZE)), (0, 0), 4)
        frames.append(np.dstack([np.clip(noise, 0, 255)] * 3 + [np.full_like(noise, 255)]))
    motion = learned([frame.astype(np.uint8) for frame in frames])
    assert motion.validation is not None
    assert np.mean([np.abs(cell).mean() for cell in motion.cells]) < 0.2


@pytest.mark.parametrize("count", [1, 2])
def test_without_a_frame_to_hold_out_nothing_is_claimed(count: int) -> None:
    for loop in (False, True):
        motion = learned(clip(lambda x, y, i: (x - 2 * i, y), count), loop=loop)
        assert motion.validation is None
        assert len(motion.cells) == count and not np.any(motion.cells)


def test_the_last_frame_of_what_plays_once_stays_where_it_is() -> None:
    frames = clip(lambda x, y, i: (x - 2 * (i - 3), y))
    assert not np.any(learned(frames).cells[-1])
    assert np.any(learned(frames).cells[0])


def test_a_loop_moves_from_its_last_frame_into_its_first() -> None:
    turn = math.radians(5)

    def place(x: Array, y: Array, i: int) -> tuple[Array, Array]:
        return x - 20 * math.cos(turn * i), y - 20 * math.sin(turn * i)

    motion = learned(clip(place, 72), loop=True)
    middle = np.s_[60:100, 60:100]
    for i in (0, 1, 36, 71):
        true = 20 * turn * np.array([-math.sin(turn * i), math.cos(turn * i)])
        assert motion.cells[i][middle].mean(axis=(0, 1)) == pytest.approx(true, abs=0.15)


@dataclass(frozen=True, slots=True)
class Misread(MotionEncoding):
    """An encoding that a shader reads with the wrong signs of R and G."""

    signs: tuple[int, int] = (1, 1)

    def decoded(self, red_green: NDArray[np.uint8]) -> Vectors:
        right = motion_encoding(self.engine).decoded(red_green)
        return as_plane(right * np.array(self.signs, np.float32))


@pytest.mark.parametrize("engine", get_args(Engine))
def test_cross_validation_says_how_much_closer_the_right_signs_are(engine: Engine) -> None:
    frames = clip(lambda x, y, i: (x - 3 * (i - 4), y + 3 * (i - 4)), 9)
    with Workers(2) as workers:
        steps = Steps(frames, False, "dis", workers)
        held_out = hold_out(gaps_to_test(frames, {}, loop=False), steps, 8, workers)

    def gain(signs: tuple[int, int]) -> float:
        read = Misread(**asdict(motion_encoding(engine)), signs=signs)
        return residuals(two_fold(held_out), read, steps_are_double=True).gain

    assert gain((1, 1)) > 0.5
    assert max(map(gain, ((1, -1), (-1, 1), (-1, -1)))) < 0.1


def test_motion_that_the_frames_left_out_do_not_make_is_not_written() -> None:
    """A cloud that drifts, and jumps aside between any two frames of its drift."""
    all_frames = clip(lambda x, y, i: (x - 2 * (i - 8) - 30 * (i % 2), y), 17)
    shown = all_frames[::2]
    between = {i: (0.5, frame) for i, frame in enumerate(all_frames[1::2])}
    alone, informed = learned(shown), learned(shown, between)
    assert alone.validation is not None and alone.validation.helps
    assert any(cell.any() for cell in alone.cells)
    assert informed.validation is not None and not informed.validation.helps
    assert informed.validation.held_out == 8
    assert not any(cell.any() for cell in informed.cells)


def test_motion_that_the_frames_left_out_make_too_is_written_in_full() -> None:
    """Whatever time they are of."""
    all_frames = clip(lambda x, y, i: (x - (i - 16), y + 0.75 * (i - 16)), 33)
    between = {i: (part / 4, all_frames[4 * i + part]) for i, part in ((0, 2), (3, 1), (6, 3))}
    motion = learned(all_frames[::4], between)
    assert motion.validation is not None
    assert motion.validation.held_out == 3 and motion.validation.gain > 0.7
    for i in range(1, 8):
        off = error_inside(motion.cells[i], np.array((4.0, -3.0)), all_frames[4 * i])
        assert np.percentile(off, 99) < 0.5


def test_a_vector_at_the_edge_goes_on_beyond_it_and_fades() -> None:
    flame = np.zeros((100, 100), np.bool_)
    flame[:, :40] = True
    vectors = np.zeros((100, 100, 2), np.float32)
    vectors[:, :40] = (3, -5)
    spread = extended(vectors, flame, 10)
    assert np.allclose(spread[:, 40:50], (3, -5), atol=0.01), "whole for the reach"
    assert np.abs(spread[:, 62:]).max() < 0.01, "none at twice the reach"
    length = np.hypot(*spread[50, 49:62].T)
    assert (np.diff(length) <= 1e-5).all(), "and less and less between"
    assert np.array_equal(spread[:, :40], vectors[:, :40])


@pytest.mark.parametrize(("side", "pad"), [(60, 8), (160, 16)])
def test_padding_is_a_tenth_of_the_frame_or_eight_pixels(side: int, pad: int) -> None:
    """A disc that moves: its vectors are whole so far beyond the edge of its alpha."""
    y, x = np.mgrid[:side, :side] - (side - 1) / 2
    frames = []
    for i in range(-3, 4):
        u, v = x - 2 * i, y
        light = np.clip(140 + 60 * np.sin(u / 2) * np.cos(v / 3), 0, 255)
        disc = np.clip(side / 5 - np.hypot(u, v), 0, 1)
        frames.append(np.dstack([light * disc] * 3 + [255 * disc]) / 255)
    with Workers(1) as workers:
        motion = estimate_motion(
            [displayed_thumbnail(as_plane(frame), "srgb") for frame in frames], {}, (side, side),
            False,
            motion_encoding("unity"), workers, lambda: None,
        )  # fmt: skip
    cell = cv2.resize(motion.cells[3].astype(np.float32), (side, side))
    edge = side // 2 - round(side / 5)  # the disc's top, above which nothing is
    assert cell[edge + 2, side // 2, 0] == pytest.approx(2, abs=0.5)
    assert cell[edge - pad + 1, side // 2, 0] == pytest.approx(2, abs=0.7)


def test_pictures_that_hardly_differ_keep_few_of_their_vectors() -> None:
    rng = np.random.default_rng(1)
    still = rng.integers(60, 200, (80, 80, 4), np.uint8)
    noisy = np.clip(still + rng.normal(0, 0.6, still.shape), 0, 255).astype(np.uint8)
    assert change_weight(still, noisy).max() < 0.2
    assert change_weight(still, 255 - still).min() > 0.9


@pytest.mark.parametrize("method", get_args(Method))
def test_the_ways_there_and_back_are_one_way(method: Method) -> None:
    one, other = clip(lambda x, y, i: (x - 4 * i, y + 2 * i), 2)
    there, back = step_motion(one, other, method), step_motion(other, one, method)
    inside = paint(*(np.mgrid[:SIZE, :SIZE][::-1] - SIZE / 2))[..., 3] > 250
    assert np.abs((there.vectors + back.vectors)[inside]).max() < 0.1


def test_the_number_of_workers_changes_nothing() -> None:
    frames = clip(lambda x, y, i: (x - 2 * (i - 3), y - i))
    one, three = learned(frames, jobs=1), learned(frames, jobs=3)
    assert np.array_equal(one.cells, three.cells)
    assert one.validation == three.validation


def drifting(count: int, step: tuple[float, float]) -> list[Bytes]:
    """A cloud that moves as one: patches are found again exactly, which suits DIS."""
    return clip(
        lambda x, y, i: (x - step[0] * (i - count // 2), y - step[1] * (i - count // 2)), count
    )


def rippling(count: int = 9) -> list[Bytes]:
    """A rising cloud whose rows sway against each other, so that no patch keeps its form: its
    motion is smooth, which suits Farnebäck's flow."""
    return clip(lambda x, y, i: (x - 8 * np.sin(y / 12 + 0.35 * i), y + 2 * (i - 4)), count)


@pytest.mark.parametrize(
    ("frames", "better", "other"),
    [(drifting(9, (3, -4)), "dis", "farneback"), (rippling(), "farneback", "dis")],
)
def test_each_clip_gets_the_method_that_is_closer_to_its_own_frames(
    frames: list[Bytes], better: Method, other: Method, monkeypatch: pytest.MonkeyPatch
) -> None:
    motion = learned(frames)
    assert motion.validation is not None
    assert motion.validation.method == better
    assert motion.validation.residual[better] < 0.95 * motion.validation.residual[other]
    for method, is_same in ((better, True), (other, False)):
        monkeypatch.setattr(estimate, "better_method", lambda *_, m=method, **__: m)
        assert np.array_equal(learned(frames).cells, motion.cells) == is_same


def test_a_tie_keeps_dis() -> None:
    """Both methods find a slow turn."""
    found = learned(turning(9, math.radians(3))).validation
    assert found is not None
    assert 0.99 * found.residual["dis"] < found.residual["farneback"] < found.residual["dis"]
    assert found.method == "dis"


def test_the_residual_is_what_another_player_leaves() -> None:
    """Of a cloud that moves by whole px, played plainly: by hand, over all held-out frames."""
    frames = drifting(12, (2, -3))
    found = learned(frames).validation
    assert found is not None

    def left(gaps: list[tuple[int, int, int]]) -> float:
        squares = []
        for before, at, after in gaps:
            one, two, three = (frames[i].astype(np.float64) for i in (before, at, after))
            share = (at - before) / (after - before)
            squares.append(np.mean((one * (1 - share) + three * share - two) ** 2))
        return math.sqrt(np.mean(squares))

    held_out = [(i - 1, i, i + 1) for i in (1, 2, 4, 5, 6, 7, 9, 10)]
    assert found.residual["blend"] == pytest.approx(left(held_out), rel=1e-4)
    assert found.fewer[2].blend == pytest.approx(found.residual["blend"], rel=1e-6)
    fifths = [(5 * step, 5 * step + i, 5 * step + 5) for step in (0, 1) for i in range(1, 5)]
    assert found.fewer[5].blend == pytest.approx(left(fifths), rel=1e-4)
    assert found.residual["dis"] < found.fewer[2].vectors * 1.01 < found.fewer[5].vectors


def test_frames_that_a_source_has_too_are_not_taken_for_those_of_fewer() -> None:
    """Every other frame of a source is shown: half of those are every fourth of the source."""
    frames = drifting(33, (0.5, -0.75))
    between = {i: (0.5, frames[2 * i + 1]) for i in (0, 5, 10, 15)}
    half, alone = learned(frames[::2], between).validation, learned(frames[::2]).validation
    assert half is not None and alone is not None
    assert half.residual["blend"] < half.fewer[2].blend < half.fewer[5].blend
    assert half.fewer[5] == pytest.approx(alone.fewer[5], rel=1e-6)
    assert half.residual["dis"] < 0.7 * half.residual["blend"]


@pytest.mark.parametrize(("count", "times"), [(4, [2]), (10, [2]), (11, [2, 5])])
def test_only_what_leaves_three_frames_is_tried_with_fewer(count: int, times: list[int]) -> None:
    found = learned(drifting(count, (1, -1))).validation
    assert found is not None and list(found.fewer) == times


def test_a_loop_with_fewer_frames_goes_on_into_its_first() -> None:
    turn = 2 * math.pi / 15

    def place(x: Array, y: Array, i: int) -> tuple[Array, Array]:
        return x - 6 * math.cos(turn * i), y - 6 * math.sin(turn * i)

    frames = clip(place, 15)
    round_later = frames[5:] + frames[:5]
    one, other = (learned(each, loop=True).validation for each in (frames, round_later))
    assert one is not None and other is not None
    assert one.fewer[5].blend == pytest.approx(other.fewer[5].blend, rel=0.05)


def test_each_step_is_estimated_once_by_the_method_that_stays(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Those over frames of the source that are not shown are the steps that are played."""
    asked: list[tuple[int, int, Method]] = []
    all_frames = drifting(17, (1, -1))
    shown = all_frames[::2]
    number = {id(frame): i for i, frame in enumerate(shown)}

    def counted(before: Bytes, after: Bytes, method: Method) -> StepMotion:
        asked.append((number[id(before)], number[id(after)], method))
        return step_motion(before, after, method)

    monkeypatch.setattr(steps, "step_motion", counted)
    learned(shown, {i: (0.5, frame) for i, frame in enumerate(all_frames[1::2])})
    played = {(i, i + 1, method) for i in range(8) for method in get_args(Method)}
    halved = {(i, i + 2, "dis") for i in range(0, 8, 2)}
    assert sorted(asked) == sorted(played | halved)

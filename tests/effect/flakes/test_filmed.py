"""Flakes measured as footage was: known answers for single embers, and for flights made by hand."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from fire_atlas.core.pixels import as_plane, decode_bytes, expose, linear_to_srgb
from fire_atlas.effect.flakes.tracks import COLUMNS, SPAWN_COLUMNS, Tracks
from tests.support.filmed.close_ups import HEIGHT, CloseUps
from tests.support.filmed.flight import Sightings, birth_figures, flight_figures
from tests.support.filmed.footage import ROWS, compare_with_filmed, is_hard
from tests.support.filmed.look import look_figures

Values = NDArray[np.float64]

EMBER = np.array([1.0, 0.13, 0.021])
"""Colour of an ember's light, linear."""


def embers(count: int = 1, **columns: Any) -> Values:
    """Rows of round, sharp embers in the middle of a frame, but for the ``columns`` given."""
    values: dict[str, Any] = dict.fromkeys(COLUMNS, 0.0)
    values |= {"id": np.arange(count), "x": 160.5, "y": 160.5, "size": 9.0, "stretch": 1.0}
    values |= {"r": EMBER[0], "g": EMBER[1], "b": EMBER[2], "a": 1.0, "life": 2.0, "tail": 1.0}
    values |= columns
    return np.stack([np.broadcast_to(values[name], count) for name in COLUMNS], axis=1).astype(
        float
    )


def shown(light: Values) -> Values:
    """What film shows of linear light, sRGB 0..255."""
    return np.asarray(255 * linear_to_srgb(expose(light.astype(np.float32))), np.float64)


def weight(distance: Values, size: float, power: int = 2, longer: float = 0.0) -> Values:
    """The sprite's light ``distance`` px off its middle, with its halo, over that in the middle:
    across it or, with ``power`` 3, along one that is ``longer`` by as many px than wide."""
    own, halo = (
        np.maximum(1 - np.abs(2 * distance / (w + longer)) ** power, 0) ** 3
        for w in (size, 2.5 * size)
    )
    return np.asarray(own + 0.004 * halo)


def half_width(light: float, size: float, power: int = 2) -> float:
    """The distance, px, at which the red of an ember is half of its peak."""
    distance = np.linspace(0, size, 10_001)
    red = shown(light * weight(distance, size, power))
    return float(distance[np.argmax(red < red[0] / 2)])


@pytest.mark.parametrize("light", [0.1, 0.5, 2.0, 12.0])
@pytest.mark.parametrize("size", [7.0, 12.0])
def test_a_round_ember_has_the_measures_of_its_formula(light: float, size: float) -> None:
    upright = np.pi / 2  # along its rotation a round one is not quite as across it
    seen = CloseUps.of(embers(a=light, size=size, rotation=upright), HEIGHT)
    red = shown(light * EMBER * 1.004)[0]
    assert seen.peak[0] == pytest.approx(red, abs=2)
    core = seen.core[0]
    assert 0.85 * red <= core[0] <= red + 2
    # The core is one colour of light at several brightnesses: green follows from its red.
    axis = shown(np.outer(light * np.linspace(0.2, 1, 200), EMBER))
    assert core[1] == pytest.approx(np.interp(core[0], axis[:, 0], axis[:, 1]), abs=5)
    width = 2 * half_width(light, size)
    assert seen.width[0] == pytest.approx(width, abs=0.5)
    assert seen.length[0] == pytest.approx(2 * half_width(light, size, 3), abs=0.75)
    off = weight(seen.width[0] * np.array([1, 1.5, 2.5]), size)
    halo = expose(as_plane(light * np.outer(off, EMBER))).sum(axis=1)
    halo /= expose(as_plane(light * EMBER)).sum()
    known = ~np.isnan(seen.halo[0])  # profiles end 14 px off the axis
    assert known[0]
    np.testing.assert_allclose(seen.halo[0][known], halo[known], atol=0.004)


@pytest.mark.parametrize("rotation", [0.0, 0.4, np.pi / 2, 2.5])
def test_a_streak_has_its_length_and_its_weaker_half(rotation: float) -> None:
    light, size, stretch, tail = 0.4, 6.0, 6.0, 0.4
    rows = embers(a=light, size=size, stretch=stretch, rotation=rotation, tail=tail)
    seen = CloseUps.of(rows, HEIGHT)
    at = np.linspace(-30, 30, 2001)
    along = tail + (1 - tail) * np.clip(at / (size * stretch) + 0.5, 0, 1)
    line = light * along * weight(at, size, 3, size * (stretch - 1))
    red = shown(line)
    level = np.interp(0, at, red) / 2
    assert seen.length[0] == pytest.approx(np.ptp(at[red >= level]), abs=1.0)
    # Across, the middle of the streak is as bright as its axis there.
    inside = at[red >= level]
    middle = (inside[0] + inside[-1]) / 2
    summed = expose(np.outer(line, EMBER)).sum(axis=1)
    first, second = (summed[(red >= level) & side].sum() for side in (at < middle, at >= middle))
    assert seen.halves[0] == pytest.approx(first / second, abs=0.05)


def test_measures_do_not_depend_on_what_else_is_measured() -> None:
    chance = np.random.default_rng(3)
    rows = embers(
        400, a=np.exp(chance.normal(-1, 1.5, 400)), size=chance.uniform(1.5, 20, 400),
        stretch=chance.uniform(1, 9, 400), rotation=chance.uniform(0, 6, 400),
        x=chance.uniform(0, 400, 400), y=chance.uniform(0, 400, 400),
    )  # fmt: skip
    together = CloseUps.of(rows, HEIGHT)
    for i in (0, 17, 399):
        alone = CloseUps.of(rows[i : i + 1], HEIGHT)
        for name in ("peak", "area", "core", "rim", "width", "length", "halo", "light"):
            got, wanted = getattr(together, name)[i], getattr(alone, name)[0]
            np.testing.assert_allclose(got, wanted, rtol=0.02, atol=0.5, err_msg=name)


def test_frames_of_any_height_are_measured_at_one() -> None:
    small = CloseUps.of(embers(size=9.0, a=0.5), HEIGHT)
    large = CloseUps.of(embers(size=27.0, a=0.5, x=481.5, y=481.5), 3 * HEIGHT)
    assert large.width[0] == pytest.approx(small.width[0])
    assert large.light[0] == pytest.approx(small.light[0], rel=0.05)


def test_a_flake_too_large_for_any_cell_is_unknown_and_unseen() -> None:
    seen = CloseUps.of(np.vstack([embers(size=400.0), embers()]), HEIGHT)
    assert np.isnan(seen.width[0]) and seen.width[1] > 0
    assert seen.seen().tolist() == [False, True]


def test_nothing_is_measured_of_no_flakes() -> None:
    assert len(CloseUps.of(np.zeros((0, len(COLUMNS))), HEIGHT).peak) == 0


def test_brightness_and_colour_are_those_of_the_embers() -> None:
    """Of a log-normal light, log-normal figures; of one colour of light, one curve of colours."""
    light = np.exp(np.random.default_rng(1).normal(-2, 0.5, 3000))
    rows = embers(3000, a=light)
    figures = look_figures(rows, CloseUps.of(rows, HEIGHT))
    assert figures["light spread"] == pytest.approx(0.5, abs=0.1)
    assert figures["light p95"] == pytest.approx(np.exp(1.645 * 0.5), rel=0.2)
    assert figures["peak"] == pytest.approx(shown(np.array(np.exp(-2.0))), abs=4)
    bright = embers(3000, a=np.geomspace(0.05, 40, 3000))
    figures = look_figures(bright, CloseUps.of(bright, HEIGHT))
    curve = shown(np.outer(np.geomspace(0.01, 60, 4000), EMBER))
    for red in (80, 120, 160, 200, 228, 245):
        for channel, name in ((1, "green"), (2, "blue")):
            wanted = np.interp(red, curve[:, 0], curve[:, channel])
            # A core is the mean of several reds, and bright ones are on a steep curve.
            near = 6 if red < 220 else 12
            assert figures[f"{name} at {red}"] == pytest.approx(wanted, abs=near), (name, red)


def test_widths_that_many_share_and_blurred_ones_are_counted() -> None:
    size = np.where(np.arange(100) < 30, 6.0, np.linspace(6.5, 20, 100))
    rows = embers(100, size=size, blur=(np.arange(100) < 7) * 3.0)
    figures = look_figures(rows, CloseUps.of(rows, HEIGHT))
    assert figures["one width"] == pytest.approx(0.3)
    assert figures["out of focus"] == pytest.approx(0.07)


def flown(x: Values, y: Values, light: Values | None = None, fps: float = 24.0) -> Tracks:
    """Tracks of flakes at x, y (flakes, frames), all born in the first frame."""
    count, frames = x.shape
    light = np.full_like(x, 0.5) if light is None else light
    tables = [embers(count, x=x[:, i], y=y[:, i], a=light[:, i]) for i in range(frames)]
    spawns = np.zeros((count, len(SPAWN_COLUMNS)))
    return Tracks.one_shot(fps, (640, 640), 1, spawns, tables)


def figures_of(tracks: Tracks) -> dict[str, float]:
    return flight_figures(Sightings.of(tracks))


AGE = np.arange(24.0)


def test_straight_flights_have_their_speeds_and_directions() -> None:
    """Twenty fly up, 15 sideways, 5 down, each at its own speed, in px/frame."""
    angle = np.radians(np.repeat([90, 0, 180, -90], [20, 10, 5, 5]))
    speed = np.exp(np.random.default_rng(2).normal(np.log(8), 0.4, 40))
    x = 320 + (speed * np.cos(angle))[:, None] * (AGE - 12)
    y = 320 - (speed * np.sin(angle))[:, None] * (AGE - 12)
    got = figures_of(flown(x, y))
    assert got["speed"] == pytest.approx(np.median(speed) * 24 / 640, rel=0.01)
    assert got["speed spread"] == pytest.approx(np.log(speed).std(), rel=0.02)
    assert (got["up"], got["sideways"], got["down"]) == pytest.approx((0.5, 0.375, 0.125))
    assert got["turn"] == pytest.approx(0, abs=0.01)
    assert got["path"] == pytest.approx(1)
    assert got["acceleration"] == pytest.approx(0, abs=1e-6)


def test_circles_turn_at_their_rate_and_to_one_side() -> None:
    rate, radius = 3.0, np.linspace(60, 160, 20)[:, None]  # rad/s, px
    angle = rate * AGE / 24
    got = figures_of(flown(320 + radius * np.cos(angle), 320 + radius * np.sin(angle)))
    assert got["turn"] == pytest.approx(rate, rel=0.02)
    assert got["sign changes"] == 0
    speed = rate * np.median(radius) / 640
    assert got["acceleration"] == pytest.approx(rate * speed, rel=0.03)


def test_waves_change_side_twice_a_period() -> None:
    x = 320 + 14 * np.sin(2 * np.pi * AGE / 12 + np.linspace(0, 6, 30)[:, None])
    y = np.broadcast_to(560 - 10 * AGE, x.shape)
    assert figures_of(flown(x, y))["sign changes"] == pytest.approx(2 / 12, abs=0.04)


@pytest.mark.parametrize("deviation", [0.2, 0.4])
def test_flicker_has_its_depth_step_and_correlation(deviation: float) -> None:
    chance, kept, frames = np.random.default_rng(7), 0.4, 30
    score = chance.normal(size=(200, frames))
    for i in range(1, frames):
        score[:, i] = kept * score[:, i - 1] + np.sqrt(1 - kept**2) * score[:, i]
    light = 0.5 * np.exp(deviation * score)
    place = np.full((200, frames), 320.5)
    got = figures_of(flown(place, place, light))
    # The same of the light of whole embers, by their formula.
    series = np.log(np.interp(light, GRID, [total_light(each) for each in GRID]))
    age = np.arange(frames)
    rest = np.array([each - np.polyval(np.polyfit(age, each, 2), age) for each in series])
    assert got["flicker"] == pytest.approx(np.median(rest.std(axis=1)), rel=0.03)
    steps = np.abs(np.diff(series, axis=1)).mean(axis=1)
    assert got["flicker step"] == pytest.approx(np.median(steps), rel=0.03)
    lag = [np.corrcoef(each[1:], each[:-1])[0, 1] for each in rest]
    assert got["flicker lag"] == pytest.approx(np.median(lag), abs=0.03)
    assert got["flicker"] == pytest.approx(0.75 * deviation, rel=0.2)


GRID = np.geomspace(0.02, 5, 200)


def total_light(light: float, size: float = 9.0) -> float:
    """The light of an ember's pixels brighter than 26 of 255, by the formula of its sprite."""
    y, x = np.mgrid[-20:21, -20:21]
    own, halo = (
        np.maximum(1 - np.abs(2 * x / w) ** 3 - (2 * y / w) ** 2, 0) ** 3
        for w in (size, 2.5 * size)
    )
    pixels = shown(light * np.multiply.outer(own + 0.004 * halo, EMBER))
    seen = np.rint(pixels.max(axis=2)) > 26
    return float(decode_bytes(np.rint(pixels).astype(np.uint8))[seen].sum())


def test_the_thirds_of_a_life_have_their_light() -> None:
    place = np.full((20, 24), 320.5)
    light = np.broadcast_to(np.repeat([0.4, 0.8, 0.2], 8), place.shape)
    got = figures_of(flown(place, place, light))
    first, second, last = (total_light(each) for each in (0.4, 0.8, 0.2))
    assert got["first third"] == pytest.approx(first / second, abs=0.02)
    assert got["second third"] == 1
    assert got["last third"] == pytest.approx(last / second, abs=0.02)
    assert got["life"] == pytest.approx(1)


def born_at(frames: NDArray[np.int64], count: int, x: Values, y: Values) -> Tracks:
    """Tracks in which flake k is born in ``frames[k]``; x and y (flakes, ages), px."""
    tables = []
    for i in range(count):
        age = i - frames
        lives = (age >= 0) & (age < x.shape[1])
        here = np.flatnonzero(lives)
        rows = embers(len(here), x=x[here, age[here]], y=y[here, age[here]], a=0.5)
        rows[:, 0] = here
        tables.append(rows)
    return Tracks.one_shot(24.0, (640, 640), 1, np.zeros((1, len(SPAWN_COLUMNS))), tables)


def scattered(count: int) -> tuple[Values, Values]:
    """Places of flakes that stay far apart, (count, 6)."""
    chance = np.random.default_rng(5)
    x, y = chance.uniform(40, 600, (2, count, 1))
    return x + np.zeros(6), y - 3 * np.arange(6.0)


def test_births_are_as_uneven_as_they_are() -> None:
    chance, count = np.random.default_rng(11), 2400
    poisson = chance.integers(3, count - 6, 1200)
    assert birth_figures(born_at(poisson, count, *scattered(1200)))["births"] == pytest.approx(
        1, abs=0.25
    )
    even = np.arange(3, 1203)
    assert birth_figures(born_at(even, 1206, *scattered(1200)))["births"] < 0.05
    bursts = np.repeat(np.arange(6, 2400, 48), 24)  # 24 at once, every eighth window
    assert birth_figures(born_at(bursts, count, *scattered(len(bursts))))["births"] == (
        pytest.approx(24 * (1 - 1 / 8), rel=0.1)
    )


@pytest.mark.parametrize("spread", [0.3, 0.9])
def test_bursts_about_a_point_are_radial_and_have_their_spread(spread: float) -> None:
    """Six bursts of 12: a common velocity, and one away from the middle, ``spread`` of it."""
    angle = np.tile(2 * np.pi * np.arange(12) / 12, 6)
    frames = np.repeat(10 + 20 * np.arange(6), 12)
    age, fast = np.arange(10.0), 12.0  # px/frame
    x = 320 + fast * spread * np.cos(angle)[:, None] * age
    y = 500 - fast * age + fast * spread * np.sin(angle)[:, None] * age
    got = birth_figures(born_at(frames, 140, x, y))
    assert got["radial"] == pytest.approx(1, abs=0.01)
    assert got["burst spread"] == pytest.approx(spread, rel=0.02)
    together = born_at(
        frames, 140, x * 0 + 320 + np.arange(72)[:, None] % 12, 500 - fast * age + 0 * x
    )
    assert birth_figures(together)["burst spread"] == pytest.approx(0, abs=1e-6)


def test_every_figure_has_a_row_and_every_row_a_figure() -> None:
    chance = np.random.default_rng(9)
    count, frames = 900, 90
    angle, speed = chance.normal(np.pi / 2, 1.2, count), np.exp(chance.normal(1.5, 1.0, count))
    x = chance.uniform(200, 440, count)[:, None] + (speed * np.cos(angle))[:, None] * np.arange(20)
    y = chance.uniform(300, 440, count)[:, None] - (speed * np.sin(angle))[:, None] * np.arange(20)
    x += 3 * chance.normal(size=x.shape)
    tracks = born_at(np.repeat(chance.integers(3, 70, count // 6), 6), frames, x, y)
    light = np.exp(chance.normal(0, 2, count))
    brighter = []
    for rows in tracks.frames:
        rows = rows.copy()
        rows[:, COLUMNS.index("a")] = light[rows[:, 0].astype(int)]
        rows[:, COLUMNS.index("stretch")] = 3
        brighter.append(rows)
    compared = compare_with_filmed(replace(tracks, frames=tuple(brighter)))
    assert [len(each) for each in compared.values()] == [len(each) for each in ROWS.values()]
    unknown = [c.row.label for each in compared.values() for c in each if np.isnan(c.value)]
    assert unknown == []


def test_squares_of_whole_pixels_are_hard_and_soft_flakes_are_not() -> None:
    place = np.full((5, 3), 320.25)
    squares = flown(place, place)
    assert is_hard(squares)
    rows = [embers(2, size=[2.0, 2.125]), embers(1, size=1.0)]
    assert not is_hard(replace(squares, frames=tuple(rows)))


def test_tracks_without_flakes_have_no_figures() -> None:
    empty = Tracks.one_shot(24.0, (64, 64), 1, np.zeros((0, 9)), [embers(0), embers(0)])
    assert all(np.isnan(c.value) for each in compare_with_filmed(empty).values() for c in each)

"""The six points shape the fire, the state machine selects its frames, the table colours it."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

from fire_atlas.core.pixels import brightness
from fire_atlas.generators.profile.generate.generated_fire import GeneratedFire
from fire_atlas.generators.profile.generate.rendering import ProfileRendering, renderings
from fire_atlas.generators.profile.generate.skeleton import skeletons
from fire_atlas.generators.profile.model import (
    STATE_EDGES,
    ColourTable,
    FeaturePoints,
    LeaningSet,
    Profile,
)
from fire_atlas.recipe.wind import Wind
from tests.generators.profile.colour_difference import delta_e, lab_of
from tests.support.clips import open_clip, real
from tests.support.likeness import (
    Array,
    generated,
    learnt,
    learnt_from,
    learnt_kite,
    learnt_narrow_and_wide,
    look_at_fire,
    settings,
)


def _rendering(
    profile: Profile, detail: float, wind: Wind | None = None, height: int | None = None
) -> ProfileRendering:
    wanted = settings(24, wind=wind, detail=detail, loop=False)
    return renderings(GeneratedFire.of(profile, wanted), [0.0], 0.0, height)[0]


@pytest.mark.parametrize("level", [0.0, 4.0])
def test_particles_are_born_on_the_spline_through_five_points(level: float) -> None:
    view = _rendering(learnt_kite(), 0.0, Wind(level=level))
    for time in (0.0, 7.0):
        skeleton = skeletons(view.fire.planes, time, 0.0).moved
        across = np.linspace(-1, 1, 50)
        born = skeleton.paths(across, np.zeros(50), view.cloud.taper)
        five = skeleton.points[:5]
        spline = PchipInterpolator(*five.T)
        assert born[:, 1] == pytest.approx(spline(born[:, 0]), abs=1 / view.camera.scale)
        assert born[[0, -1], 0] == pytest.approx(five[[0, 4], 0])
        # All of them end at the top.
        ends = skeleton.paths(across, np.ones(50), view.cloud.taper)
        assert ends == pytest.approx(np.tile(skeleton.top, (50, 1)))


def _lower_outline(view: ProfileRendering, index: int) -> Array:
    """Lowest px of the flame below its base in each column; the frame's foot if there is none."""
    alpha = view.frame(index)[..., 3] > 0.5
    rows = np.arange(1, alpha.shape[0] + 1)[:, None] * alpha
    lowest = np.where(alpha.any(axis=0), rows.max(axis=0), alpha.shape[0])
    return np.asarray(lowest - view.camera.origin[1], np.float64)


def _moved(profile: Profile, pixels: float) -> Profile:
    """Return the profile with all its ``mid_left`` raised."""
    points = tuple(
        FeaturePoints(
            p.left, (p.mid_left[0], p.mid_left[1] - pixels), p.bottom, p.mid_right, p.right, p.top
        )
        for p in profile.front.points
    )
    return replace(profile, front=replace(profile.front, points=points))


@pytest.mark.parametrize("detail", [0.0, 1.0])
def test_a_point_that_is_moved_moves_the_outline_there_and_nowhere_else(detail: float) -> None:
    profile = learnt_kite()
    views = [_rendering(each, detail) for each in (profile, _moved(profile, 10.0))]
    before, after = (_lower_outline(view, 6) for view in views)
    camera = views[0].camera
    points = skeletons(views[0].fire.planes, 6.0, 0.0).learnt.points
    columns = (camera.origin[0] + points[:, 0] * camera.scale).astype(int)
    assert before[columns[1]] - after[columns[1]] >= 5
    right = slice(columns[2] + 1, columns[4] - 2)
    assert np.abs(before[right] - after[right]).max() <= 1.5
    # Both frames hold the fire with its points where they were moved.
    tops = [int(view.camera.origin[1]) for view in views]
    rows = [slice(top - int(1.0 * camera.scale), top - int(0.6 * camera.scale)) for top in tops]
    one, other = (view.frame(6)[part, :, 3] > 0.5 for view, part in zip(views, rows, strict=True))
    for mirrored in (1, -1):
        ends = [np.argmax(mask[:, ::mirrored], axis=1) for mask in (one, other)]
        assert np.quantile(np.abs(ends[0] - ends[1]), 0.95) <= 1


@pytest.mark.parametrize("number", range(12))
def test_frames_of_a_set_are_drawn_where_it_is_selected_and_nowhere_else(number: int) -> None:
    profile = learnt_kite()
    front = profile.front
    sets = list(front.sets)
    frames = tuple(sorted({(frame + 9) % 32 for frame in sets[number].frames}))
    sets[number] = replace(sets[number], frames=frames)
    other = replace(profile, front=replace(front, sets=tuple(sets)))
    low, high = sets[number].low, sets[number].high
    level = abs(low + high) / 2 / 6
    direction = "right" if low >= 0 else "left"
    gusts = {"mean": level, "strength": min(level, 5 - level, 1.5), "period": 0.5}
    for wind in (
        Wind.model_validate({"level": level, "direction": direction}),
        Wind.model_validate({"gusts": gusts, "direction": direction}),
        Wind.model_validate({"level": 2.5, "direction": "left" if low >= 0 else "right"}),
    ):
        views = [_rendering(each, 1.0, wind) for each in (profile, other)]
        selected, across = (plane.states.sets == number for plane in views[0].fire.planes)
        # The fire bends into a set a little before its frames are seen.
        ahead = 13
        for i in range(0, 24, 3):
            same = (views[0].frame(i) == views[1].frame(i)).all()
            if selected[: i + 1].all():
                assert not same
            # A fire that leans away from the camera is less high.
            if not (selected | across)[: i + ahead].any():
                assert same


def _axis(view: ProfileRendering, index: int) -> float:
    """Angle of the straight line fitted to the flame's pixels, columns over rows, degrees."""
    bright = brightness(view.frame(index), "srgb")
    rows, columns = np.nonzero(bright > view.fire.profile.front.threshold)
    return -math.degrees(math.atan(float(np.polyfit(rows, columns, 1)[0])))


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [
        "candle",
        "torch",
        "campfire",
        real("real_candle_red"),
        real("real_fireplace_gif"),
        real("sim_unity_flame03"),
        real("cartoon_tauran_flame_sheet"),
    ],
)
def test_drawn_fire_leans_as_the_selected_set(name: str) -> None:
    profile = learnt_from(name)
    middles = np.array([(each.low + each.high) / 2 for each in profile.front.sets])
    near, by_chance = [], []
    for level, direction in enumerate(["right", "left"] * 3):
        wind = Wind.model_validate({"level": level, "direction": direction})
        view = _rendering(profile, 1.0, wind, height=120)
        sets = view.fire.planes[0].states.sets
        for i in range(0, 24, 3):
            apart = np.abs(_axis(view, i) - middles)
            near.append(apart[sets[i]] <= 7)
            by_chance.append((apart <= 7).mean())
    assert np.mean(near) >= 0.8
    assert np.mean(by_chance) < 0.35


@pytest.mark.parametrize("detail", [0.0, 1.0])
def test_a_flame_keeps_the_shape_of_an_a_against_the_wind(detail: float) -> None:
    """Wide where it burns, ever narrower to its tip: its foot stays, its tip goes with the wind."""
    shapes = []
    for wind in (Wind(), Wind(level=5.0)):
        view = _rendering(learnt_kite(), detail, wind)
        x, ground = view.camera.origin
        frames = [view.frame(i)[..., 3] > 0.5 for i in range(16, 24, 2)]
        heights = (0.2, 0.3, 0.4, 0.5, 0.6)
        rows = [int(ground - height * view.camera.scale) for height in heights]
        ends = np.array([
            [(np.flatnonzero(flame[row])[[0, -1]] - x) / view.camera.scale for row in rows]
            for flame in frames
        ])  # fmt: skip
        shapes.append(ends.mean(axis=0))
    for shape in shapes:
        width = shape[:, 1] - shape[:, 0]
        assert (np.diff(width) < 0.01).all() and width[-1] < 0.8 * width[0], shape
    middle = [shape.mean(axis=1) for shape in shapes]
    moved = middle[1] - middle[0]
    assert abs(moved[0]) < 0.1 and moved[-1] > 0.18
    assert (np.diff(moved) > 0.02).all(), moved
    # As wide in the wind as without it.
    widths = [shape[:, 1] - shape[:, 0] for shape in shapes]
    assert widths[1] == pytest.approx(widths[0], rel=0.35)


def test_every_set_is_selected_in_some_wind() -> None:
    profile, found = learnt_kite(), set()
    for level in (0.0, 0.9, 2.5, 4.0):
        for direction in ("left", "right"):
            for gusts in (None, {"mean": level, "strength": 1.0, "period": 0.7}):
                keys = {"level": level} if gusts is None else {"gusts": gusts}
                wind = Wind.model_validate({**keys, "direction": direction})
                states = _rendering(profile, 1.0, wind).fire.planes[0].states
                found |= set(states.sets.tolist())
    assert found == set(range(2 * (len(STATE_EDGES) - 1)))


def _recoloured(profile: Profile, cell: tuple[int, int]) -> Profile:
    table = profile.front.colours
    colours = table.colours.copy()
    changed = colours[cell].astype(int) + np.array([-60, 40, 60])
    colours[cell] = np.clip(changed, 0, 255)
    assert float(delta_e(lab_of(colours), lab_of(table.colours))[cell]) >= 20
    changed_table = ColourTable(colours, table.coverage)
    return replace(profile, front=replace(profile.front, colours=changed_table))


@pytest.mark.slow
@pytest.mark.parametrize("detail", [0.0, 1.0])
@pytest.mark.parametrize("name", ["candle", "torch"])
def test_a_cell_of_the_table_colours_its_region_and_not_the_opposite_corner(
    name: str, detail: float
) -> None:
    profile = learnt_from(name)
    tables = []
    for each in (profile, _recoloured(profile, (4, 1))):
        [clip] = generated(each, settings(12, detail=detail, loop=False, wind=Wind(level=0.1)))
        tables.append(look_at_fire(clip, profile.front.threshold).table.colours)
    change = delta_e(*(lab_of(table) for table in tables))
    assert change[4, 1] >= 10
    assert change[0, 3] < 2 and change[0, 4] < 2


@pytest.mark.slow
@pytest.mark.parametrize("detail", [0.0, 1.0])
def test_a_table_of_more_cells_is_another_picture(detail: float) -> None:
    clip = open_clip("torch")
    frames = []
    for cells in (2, 5):
        profile = learnt(clip, cells=cells)
        frames.append(_rendering(profile, detail).frame(3))
    different = np.abs(frames[0] - frames[1]).max(axis=-1)
    assert different.max() > 0.03


def test_two_clips_at_a_right_angle_give_two_views() -> None:
    front, side = generated(learnt_narrow_and_wide(), settings(8, detail=0.0), [0.0, 90.0])
    widths = [look_at_fire(clip, 60.0).width for clip in (front, side)]
    assert widths[1] > 1.6 * widths[0]


def test_sets_say_whose_frames_they_show() -> None:
    sets: tuple[LeaningSet, ...] = learnt_kite().front.sets
    assert all((each.shear != 0) == (each.origin == "sheared") for each in sets)

"""What wind, objects and time do to the sheets, and how loops close."""

from dataclasses import replace
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from fire_atlas.core.errors import RecipeError
from fire_atlas.core.pixels import encode_bytes
from fire_atlas.core.shipped import shipped
from fire_atlas.generators.silk.renderer import SilkRenderer, generate_silk
from fire_atlas.generators.silk.scene import build_scene
from fire_atlas.recipe.load import load_tree
from fire_atlas.recipe.silk import SilkSource
from fire_atlas.recipe.tree import read_tree
from fire_atlas.recipe.wind import Wind
from fire_atlas.sources.matte import luminance_of_light
from tests.generators.silk.small_fires import (
    camera,
    fire,
    lean,
    recorded,
    settings,
    source,
    spearman,
)
from tests.support.silk_fires import silk_fire


def ranks(values: list[float]) -> list[int]:
    return [int(rank) for rank in np.argsort(np.argsort(values))]


@cache
def blown(level: float) -> SilkRenderer:
    return fire(30, loops=False, wind={"level": level}, sheets={"count": 3})


LEVELS = (0.0, 0.6, 1.2, 2.0, 3.0, 4.0, 5.0)


@pytest.mark.slow
def test_the_faster_the_sheets_the_faster_the_rendered_texture_changes() -> None:
    """Eq. 17. The sheets are held still while they are drawn, so that the texture alone moves."""
    energy, change = [], []
    for level in LEVELS:
        made = blown(level)
        still = np.repeat(made.recording.x[:1], len(made.recording.x), axis=0)
        held = replace(made, recording=replace(made.recording, x=still))
        seen = [held.draw(i, camera()).light for i in range(made.frames)]
        steps = [np.abs(b - a).mean() / a.mean() for a, b in pairwise(seen)]
        energy.append(float((made.recording.v_rms**2).mean()))
        change.append(float(np.mean(steps)))
    assert ranks(energy) == sorted(ranks(energy)), "wind stirs the sheets"
    assert np.corrcoef(ranks(energy), ranks(change))[0, 1] >= 0.9


@pytest.mark.parametrize(("fuel", "widest", "lowest"), [("wood", 1.25, 0.06), ("candle", 1.08, 0)])
def test_sheets_of_wood_are_unlike_and_do_not_stand_on_one_line(
    fuel: str, widest: float, lowest: float
) -> None:
    line = {"arrangement": "line", "count": 200, "width": 0.2, "height": 0.5, "spread": 8}
    rest = build_scene(source(fuel=fuel, sheets=line), Wind(), 3, 24).model.rest
    widths = np.linalg.norm(rest[:, 0, -1] - rest[:, 0, 0], axis=-1) / 0.2
    assert widths.max() == pytest.approx(widest, abs=0.02)
    assert np.sort(-rest[:, 0, 0, 2])[-5:] == pytest.approx(0.5 * lowest, abs=0.004)
    assert rest[:, 0, 0, 2].max() <= 0


@pytest.mark.parametrize("direction", [[1, 0, 0], [0, -2, 0], [-1, 0, -1], [0, 0, -1]], ids=str)
def test_a_jet_blows_where_it_is_directed_and_bends_up_where_it_is_slow(
    direction: list[float],
) -> None:
    jet = {"arrangement": "jet", "direction": direction, "count": 4, "width": 0.1, "height": 0.8}
    x = recorded(12, sheets=jet).x.astype(np.float64).mean(axis=(0, 1, 3))  # a row after another
    way = np.array(direction) / np.linalg.norm(direction)
    along = (x - x[0]) @ way
    assert (np.diff(along[: len(along) // 2]) > 0).all() and along.max() > 0.4
    aside = x - x[0] - along[:, None] * way
    lifted = aside[:, 2] if abs(way[2]) < 1 else np.zeros(len(x))
    assert np.abs(aside[: len(x) // 4]).max() < 0.06
    if abs(way[2]) < 1:
        assert lifted[-1] > max(0.01, 2 * lifted[len(x) // 2])


def test_what_burns_carries_its_flames_along_from_the_first_frame_on() -> None:
    body = {
        "shape": "sphere", "radius": 0.06, "strength": 0,
        "keyframes": [{"t": 0, "at": [-0.3, 0, 0.2]}, {"t": 0.5, "at": [0.3, 0, 0.4]}],
    }  # fmt: skip
    made = fire(12, loops=False, sheets={"on": 0, "count": 6, "width": 0.1}, intruders=[body])
    assert (made.ignition.burning == 1).all()
    base = made.recording.x[:, :, 0].astype(np.float64).mean(axis=2)
    moved = base[-1] - base[0]
    held = made.scene.intruders[0]
    last = held.position((len(base) - 1) / 24) - held.position(0)
    assert moved == pytest.approx(np.broadcast_to(last, moved.shape), abs=0.02)
    away = np.linalg.norm(base[0] - held.position(0), axis=-1)
    assert away == pytest.approx(0.06, abs=0.03), "they begin on its surface"


@pytest.mark.slow
@pytest.mark.parametrize("fuel", ["wood", "candle", "gas"])
def test_in_a_loop_too_each_texture_is_as_fast_as_its_sheet(fuel: str) -> None:
    """Eq. 17, with the speed of the nodes taken from the positions that are drawn."""
    gusts = {"gusts": {"mean": 1.0, "strength": 1.0, "period": 2.0}}
    line = {"arrangement": "line", "count": 11, "spread": 1.6}
    made = fire(48, wind=gusts, fuel=fuel, sheets=line)
    x = made.recording.x[:-1].astype(np.float64)
    ahead = ((np.roll(x, -1, axis=0) - x) ** 2).sum(axis=-1).mean(axis=(2, 3))
    energy = (ahead + np.roll(ahead, 1, axis=0)) / 2
    rate = made.textures.rate[:-1]
    assert min(spearman(energy[:, s], rate[:, s]) for s in range(11)) >= 0.9
    assert spearman(energy.ravel(), rate.ravel()) >= 0.9, "from sheet to sheet as well"
    played = np.round(rate.mean(axis=0), 6)  # sheets that play as many images are as fast
    assert spearman(energy.mean(axis=0), played) >= 0.9, "and from mean to mean"
    assert np.ptp(rate.mean(axis=0)) > 0.1 * rate.mean(), "no two sheets need to be as fast"


@pytest.mark.slow
@pytest.mark.parametrize("fuel", ["wood", "candle", "gas"])
def test_a_flame_that_is_blown_at_is_thinner(fuel: str) -> None:
    coverage = []
    for level in (0.0, 2.0, 5.0):
        made = fire(
            24, loops=False, wind={"level": level}, fuel=fuel, sheets={"count": 5}, width=160
        )
        eye = camera(width=160)
        seen = [luminance_of_light(made.draw(i, eye).light, "srgb") for i in range(0, 24, 4)]
        assert max(float(pixels[:, [0, -1], 3].max()) for pixels in seen) < 0.02, "all in the frame"
        coverage.append(float(np.mean([pixels[..., 3] for pixels in seen])))
    assert coverage[0] > coverage[1] > coverage[2]
    assert coverage[2] < 0.75 * coverage[0]


def test_two_fires_of_two_fuels_have_each_its_own_colours_and_pace() -> None:
    left = {"arrangement": "crossed", "count": 2, "width": 0.3, "at": [-0.3, 0, 0], "fuel": "wood"}
    right = {"at": [0.3, 0, 0], "width": 0.3, "fuel": "gas"}
    made = fire(12, sheets=[left, right], width=120)
    light = made.draw(3, camera(width=120)).light
    wood, gas = (half.sum(axis=(0, 1)) for half in (light[:, :60], light[:, 60:]))
    assert wood[0] > 3 * wood[2] and gas[2] > 1.5 * gas[0]
    alone = fire(12, sheets=[{**left, "fuel": None}, {**right, "fuel": None}], width=120)
    pace = [each.recording.rate.mean(axis=0) for each in (made, alone)]
    assert np.allclose(pace[0][:2], pace[1][:2], rtol=0.01), (
        "a fire does not depend on its neighbour's fuel"
    )
    assert pace[0][2] != pytest.approx(pace[1][2], rel=0.05)


@pytest.mark.slow
def test_a_stronger_wind_leans_the_flame_further_where_it_blows() -> None:
    angles = [float(lean(blown(level).recording.x).mean()) for level in LEVELS]
    assert np.diff(angles).min() > 0
    assert 10 < angles[-1] < 60
    left, away = (
        recorded(8, loops=False, wind={"level": 3.0, "direction": direction}).x
        for direction in ("left", 90.0)
    )
    assert lean(left).mean() < -8
    y = (away[:, :, -1] - away[:, :, 0]).mean(axis=(0, 1, 2))[1]
    assert y > 0.1


@pytest.mark.slow
@pytest.mark.parametrize(("key", "less", "more"), [("lift", 0.5, 2.0), ("pressure", 0.5, 2.0)])
def test_what_rises_harder_bends_less(key: str, less: float, more: float) -> None:
    keys: list[dict[str, Any]] = [{key: less}, {key: more}]
    angles = [float(lean(recorded(6, wind={"level": 3.0}, **each).x).mean()) for each in keys]
    assert angles[0] > angles[1] + 4


def test_oxygen_makes_the_gas_on_screen_faster_and_whiter() -> None:
    """Gas is as fast as the root of oxygen, apart from what the sheets' flutter adds."""
    made = [fire(12, oxygen=value, turbulence=0.0, loops=False) for value in (0.4, 2.5)]
    speeds, whiteness = [], []
    for each in made:
        light = np.stack([each.draw(i, camera()).light for i in range(0, 12, 3)])
        lit = light.max(axis=-1) > 0.2
        up = np.stack([-each.motion(i, camera())[..., 1] for i in range(0, 12, 3)])
        speeds.append(float(up[lit].mean()))
        colour = light[lit].mean(axis=0)
        whiteness.append(float(colour[2] / colour[0]))
    assert speeds[1] / speeds[0] == pytest.approx((2.5 / 0.4) ** 0.5, rel=0.2)
    assert whiteness[1] > 0.2 > 0.02 > whiteness[0]


def reach(pressure: float) -> float:
    """Height of the flame, of the frame's, in the mean of frames and seeds."""
    keys = {"pressure": pressure, "sheets": {"count": 5, "width": 0.35, "height": 0.9}}
    found = []
    for seed in (1, 2, 3):
        made = silk_fire(source(**keys), settings(12, True, seed=seed))
        for i in range(0, 12, 2):
            lit = (made.draw(i, camera()).light.max(axis=-1) > 0.2).any(axis=1)
            found.append(1 - np.flatnonzero(lit)[0] / len(lit))
    return float(np.mean(found))


@pytest.mark.slow
def test_pressure_raises_the_flame_up_to_1_6_and_beyond_it_the_flame_stays() -> None:
    heights = [reach(pressure) for pressure in (0.3, 0.7, 1.6, 3.0, 5.0)]
    assert heights[0] < heights[1] - 0.05 < heights[2] - 0.1
    assert heights[3] == pytest.approx(heights[2], rel=0.06)
    assert heights[4] == pytest.approx(heights[2], rel=0.06)


@cache
def leaning(rows: int = 24, columns: int = 12) -> float:
    """Angle, degrees, of a sheet's middle in wind."""
    mesh: dict[str, Any] = {"rows": rows, "columns": columns, "turbulence": 0.0}
    x = recorded(24, wind={"level": 3.0}, **mesh).x
    share = np.linspace(0, 1, x.shape[2])
    away, up = (np.interp(0.5, share, x[..., k].mean(axis=(0, 1, 3))) for k in (0, 2))
    return float(np.degrees(np.arctan2(away, up)))


@pytest.mark.slow
@pytest.mark.parametrize(
    "mesh", [{"rows": 4}, {"rows": 5}, {"rows": 48}, {"columns": 4}, {"columns": 24}]
)
def test_a_finer_mesh_is_the_same_sheet(mesh: dict[str, int]) -> None:
    """Its lean in wind is that of 24 rows and 12 columns."""
    assert leaning(**mesh) == pytest.approx(leaning(), rel=0.05)


def acceleration(mass: float, **keys: Any) -> NDArray[np.float64]:
    """Of every node at rest, in wind."""
    wind = Wind.model_validate({"level": 3.0})
    scene = build_scene(source(mass=mass, **keys), wind, seed=1, fps=24.0)
    return scene.forces.acceleration(0.3, 0.3, scene.model.rest, np.zeros_like(scene.model.rest))


def test_air_and_heat_move_heavy_silk_less_and_gravity_moves_it_as_much() -> None:
    light, heavy = (acceleration(mass, gravity=0.0) for mass in (1.0, 4.0))
    assert np.allclose(heavy, light / 4)
    weight = acceleration(1.0) - light
    assert np.allclose(acceleration(4.0) - heavy, weight)
    assert np.allclose(weight, [0, 0, -1.5])


def test_heavy_silk_is_no_soft_silk() -> None:
    keys: tuple[dict[str, Any], ...] = ({"mass": 2.0}, {"stiffness": 0.5})
    heavy, soft = (recorded(6, **each).x for each in keys)
    assert np.abs(heavy - soft).max() > 0.05


def test_an_object_that_comes_moves_heavy_silk_less() -> None:
    """In the first moment: in time both come to where springs hold them, alike for all masses."""
    way = [{"t": 0, "at": [1, 0, 0.35]}, {"t": 0.05, "at": [0.03, 0, 0.35]}]
    ball = {"shape": "sphere", "keyframes": way, "radius": 0.08, "strength": 4}
    sheet = [{"width": 0.4, "height": 0.8, "angle": 90}]
    moved = []
    for mass in (1.0, 2.5):
        free, pushed = (
            recorded(3, loops=False, sheets=sheet, intruders=i, turbulence=0.0, mass=mass).x
            for i in ([], [ball])
        )
        moved.append(float(np.abs(pushed - free).max()))
    assert moved[0] == pytest.approx(2.5 * moved[1], rel=0.35)
    assert moved[1] > 0.005


def test_two_fires_sway_together_only_where_they_are_close() -> None:
    """In a large and slow sway; each flutters on its own."""

    def likeness(apart: float) -> float:
        entry = {"arrangement": "crossed", "count": 3, "width": 0.3}
        at = [[-apart / 2, 0, 0], [apart / 2, 0, 0]]
        pair = [{**entry, "at": place} for place in at]
        x = recorded(240, loops=False, turbulence=0.0, sheets=pair).x[:, :, -1].mean(axis=2)
        one, other = x[:, :3].mean(axis=1), x[:, 3:].mean(axis=1)
        return float(np.mean([np.corrcoef(one[:, k], other[:, k])[0, 1] for k in (0, 1)]))

    assert likeness(0.05) > 0.95
    assert likeness(3.0) < 0.5


def test_textures_play_as_fast_at_any_frame_rate() -> None:
    """The speed of sheets is that of the simulation, not of the frames that are shown."""
    wind = Wind.model_validate({"level": 2.0})
    made = [
        silk_fire(source(), settings(round(2 * fps), False, wind, fps=fps)).recording
        for fps in (6.0, 12.0, 48.0)
    ]
    rates = [float(each.rate.mean()) for each in made]
    assert rates == pytest.approx([rates[-1]] * 3, rel=0.03)


def test_velocities_are_the_derivatives_of_places_also_where_a_loop_is_closed() -> None:
    made = generate_silk(source(), settings(96, True, fps=96.0)).recording
    x = made.x[:-1].astype(np.float64)
    differences = (np.roll(x, -1, axis=0) - np.roll(x, 1, axis=0)) * 48
    error = np.sqrt(((differences - made.v[:-1]) ** 2).mean())
    assert error < 0.05 * np.sqrt((made.v**2).mean())


@pytest.mark.slow
@pytest.mark.parametrize("fuel", ["wood", "candle", "gas"])
def test_every_side_of_a_loop_closes_to_the_byte(fuel: str) -> None:
    wind = {"gusts": {"mean": 1.0, "strength": 1.0, "period": 0.5}}
    made = fire(20, fuel=fuel, wind=wind)
    for k in range(8):
        eye = camera(45.0 * k, 10.0)
        first, again = (encode_bytes(made.draw(i, eye).light) for i in (0, made.frames))
        assert np.array_equal(first, again)


def test_a_loop_has_no_seam() -> None:
    made = fire(36, sheets={"count": 3})
    seen = [made.draw(i, camera(30.0)).light for i in range(made.frames + 1)]
    steps = np.array([np.sqrt(np.mean((b - a) ** 2)) for a, b in pairwise(seen)])
    assert 0.7 < steps[-1] / np.median(steps) < 1.3
    assert steps.max() < 1.6 * np.median(steps)
    detail = [float((np.diff(light, axis=0) ** 2).mean()) for light in seen[:-1]]
    assert np.mean(detail[:13]) > 0.85 * np.median(detail)


@pytest.mark.slow
def test_nothing_repeats_within_a_loop() -> None:
    """No two frames are alike, near neighbours in time apart, and no two sheets show one image."""
    made = fire(36, sheets={"count": 8})
    seen = np.stack([made.draw(i, camera()).light.mean(axis=-1).ravel() for i in range(36)])
    seen -= seen.mean(axis=0)
    alike = np.corrcoef(seen)
    apart = np.abs(np.subtract.outer(np.arange(36), np.arange(36)))
    apart = np.minimum(apart, 36 - apart)
    assert alike[apart >= 6].max() < 0.75
    textures = made.textures
    for a in range(8):
        images = len(textures.loops[textures.texture_index[a]])
        steps = np.diff(np.unwrap(textures.phase[:, a], period=images))
        assert round(steps.sum() / images) == 1, "each sequence is played once"
        for b in range(a):
            if textures.texture_index[a] == textures.texture_index[b]:
                gap = np.abs(textures.phase[:, a] - textures.phase[:, b])
                assert np.minimum(gap, images - gap).min() > 1


def test_time_runs_on_where_nothing_loops() -> None:
    made = fire(20, loops=False)
    assert len(made.recording.x) == 20
    assert not np.array_equal(made.draw(0, camera()).light, made.draw(19, camera()).light)


@pytest.mark.slow
def test_the_same_seed_is_the_same_fire_and_another_is_another() -> None:
    keys: dict[str, Any] = {"sheets": {"count": 2}}
    made = source(**keys)
    one, same, other = (generate_silk(made, settings(4, True, seed=seed)) for seed in (1, 1, 2))
    light = [each.draw(2, camera()).light for each in (one, same)]
    assert np.array_equal(light[0], light[1])
    assert not np.array_equal(one.recording.x, other.recording.x)


def test_velocities_are_those_of_the_nodes_and_of_the_gas_that_rises() -> None:
    """A flow, followed from frame to frame, leads to what the next frame shows."""
    keys = {"kind": "silk", "width": 96, "height": 128, "sheets": {"count": 1, "width": 0.5}}
    made = generate_silk(SilkSource.model_validate(keys), settings(30, False, seed=1, fps=120.0))
    eye = camera(90.0, width=96, height=128)
    rows, columns = np.mgrid[:128, :96].astype(np.float32)
    import cv2

    plain = followed = 0.0
    for i in range(2, 28, 5):
        now, after = (made.draw(k, eye).light.max(axis=-1) for k in (i, i + 1))
        flow = made.motion(i, eye) / 120.0
        lit = now > 0.1
        assert flow[lit].mean(axis=0)[1] < 0, "fire rises"
        found = cv2.remap(after, columns + flow[..., 0], rows + flow[..., 1], cv2.INTER_LINEAR)
        plain += float(np.abs(after - now)[lit].mean())
        followed += float(np.abs(found - now)[lit].mean())
    assert followed < 0.75 * plain


@cache
def match() -> SilkRenderer:
    recipe = load_tree(read_tree(shipped("recipes") / "match.yaml")).recipe
    assert isinstance(recipe.source, SilkSource)
    small = recipe.source.model_copy(update={"width": 96, "height": 96})
    frames, fps = recipe.timeline.frames, recipe.timeline.fps
    assert frames is not None and fps is not None
    return generate_silk(small, settings(frames, False, recipe.wind, seed=0, fps=fps))


@pytest.mark.slow
def test_a_match_bends_the_flame_by_four_degrees_catches_fire_and_the_flame_recovers() -> None:
    made = match()
    bent = lean(made.recording.x, slice(0, 5))
    before, after = bent[:12], bent[-12:]
    assert np.abs(before).max() < 1.0
    assert bent.min() == pytest.approx(-3.6, abs=1.0)
    assert np.abs(after).max() < 1.5
    lit = made.ignition.burning[:, 5:]
    assert not lit[: round(0.9 * 24)].any()
    assert lit[round(2.6 * 24) :].all() and lit[-1].min() == 1
    assert np.all(made.ignition.burning[:, :5] == 1)


@pytest.mark.slow
def test_the_burning_match_carries_its_flame_away() -> None:
    eye = camera(width=96, height=96, foot=0.16)
    right = [match().draw(i, eye).light[:40, 60:].max() for i in (10, 75)]
    assert right[0] < 0.05 < 0.2 < right[1]


@pytest.mark.slow
def test_the_match_burns_as_brightly_while_it_is_moved_as_at_rest() -> None:
    eye = camera(width=96, height=96, foot=0.16)
    shed = [match().draw(i, eye).light[:62, 60:].sum() for i in range(84, 120, 4)]
    assert min(shed) > 0.8 * max(shed)


def test_a_ball_in_the_flame_parts_it() -> None:
    ball = {"shape": "sphere", "at": [0, 0, 0.35], "radius": 0.08, "draw": False, "strength": 4}
    sheet = [{"width": 0.4, "height": 0.8, "angle": 0}]
    free, parted = (
        recorded(6, loops=False, sheets=sheet, intruders=i, turbulence=0.0).x[-1, 0]
        for i in ([], [ball])
    )
    place = np.array([0, 0, 0.35])
    near = [float(np.sqrt(((x - place) ** 2).sum(axis=-1)).min()) for x in (free, parted)]
    assert near[1] > near[0] + 0.02


KEYFRAMES = [{"t": 0, "at": [1, 0, 0.5]}, {"t": 0.4, "at": [0, 0, 0.3]}]


@pytest.mark.slow
def test_an_intruder_that_never_leaves_a_loop_is_refused_with_the_way_out() -> None:
    stays: dict[str, Any] = {"intruders": [{"shape": "sphere", "keyframes": KEYFRAMES}]}
    with pytest.raises(RecipeError, match=r"intruders\.0: is elsewhere after 1 s.*loop: none"):
        fire(24, **stays)
    assert len(recorded(12, loops=False, **stays).x) == 12
    back = [*KEYFRAMES, {"t": 0.8, "at": [1, 0, 0.5]}]
    made = fire(24, intruders=[{"shape": "sphere", "keyframes": back}])
    first, again = (made.draw(i, camera()).light for i in (0, 24))
    assert np.array_equal(first, again)


@pytest.mark.slow
def test_springs_too_stiff_are_refused_with_the_limit_and_stable_below_it() -> None:
    with pytest.raises(
        RecipeError, match=r"source\.stiffness.*at most about ([0-9.e+]+)"
    ) as refusal:
        fire(2, stiffness=100_000.0)
    limit = float(str(refusal.value).split("at most about ")[1].split()[0])
    for stiffness in (1000.0, 0.95 * limit):
        keys: dict[str, Any] = {"stiffness": stiffness, "rows": 5, "columns": 4}
        x = recorded(2, loops=False, sheets={"count": 1}, **keys).x
        assert np.isfinite(x).all()
        assert np.abs(x).max() < 2


def test_springs_too_damped_are_refused_with_a_limit_that_helps() -> None:
    with pytest.raises(
        RecipeError, match=r"source\.damping: 100 .*damping of at most about ([0-9.e+]+)"
    ) as refusal:
        fire(2, damping=100.0, rows=24, columns=16)
    limit = float(str(refusal.value).split("at most about ")[1].split()[0])
    assert limit > 30
    x = recorded(2, loops=False, damping=limit, rows=24, columns=16, sheets={"count": 1}).x
    assert np.abs(x).max() < 2


def test_where_neither_less_stiffness_nor_less_damping_is_enough_both_are_advised() -> None:
    with pytest.raises(RecipeError, match=r"stiffness of at most about .* and a damping of") as no:
        fire(2, damping=100.0, stiffness=1000.0, rows=24, columns=16)
    stiffness, damping = (
        float(part.split()[0]) for part in str(no.value).split("at most about ")[1:]
    )
    keys: dict[str, Any] = {"stiffness": stiffness, "damping": damping}
    x = recorded(2, loops=False, rows=24, columns=16, sheets={"count": 1}, **keys).x
    assert np.abs(x).max() < 2


def test_what_moves_early_in_a_loop_moves_its_flame_with_it() -> None:
    """Also where the frames after the end are blended into the beginning."""
    way = [
        {"t": 0, "at": [0, 0, 0.3]},
        {"t": 0.25, "at": [0.4, 0, 0.3]},
        {"t": 0.9, "at": [0, 0, 0.3]},
    ]
    made = fire(24, intruders=[{"shape": "match", "keyframes": way, "radius": 0.02}])
    body = made.scene.intruders[0]
    for i in range(24):
        foot = made.recording.x[i, -1, 0].mean(axis=0)
        assert foot[0] == pytest.approx(body.position(i / 24)[0], abs=0.01), i


def test_damping_calms_what_neighbours_move_against_one_another() -> None:
    strains = []
    for damping in (0.0, 40.0):
        v = recorded(24, loops=False, damping=damping).v.astype(np.float64)
        strains.append(float(np.sqrt((np.diff(v, axis=2) ** 2).sum(axis=-1).mean())))
    assert strains[1] < 0.95 * strains[0]


def test_ten_thousand_sheets_are_refused_before_they_take_memory() -> None:
    with pytest.raises(RecipeError, match=r"10000 sheets .* at most 200000"):
        fire(2, sheets={"count": 10_000}, rows=24, columns=16)


def test_more_frames_than_memory_holds_are_refused() -> None:
    with pytest.raises(RecipeError, match=r"timeline\.frames: 10000 frames .* at most \d+"):
        fire(10_000, sheets={"count": 24}, rows=24, columns=16)


@pytest.mark.parametrize("frames", [1, 2, 3])
@pytest.mark.parametrize("loops", [True, False])
def test_the_shortest_clips_are_made(frames: int, loops: bool) -> None:
    made = fire(frames, loops, sheets={"count": 1})
    assert made.draw(frames - 1, camera()).light.max() > 0.3
    assert np.isfinite(made.motion(0, camera())).all()

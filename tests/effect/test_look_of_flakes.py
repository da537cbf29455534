"""How flakes end up in the frames: edges, halo, pixel art, or not at all."""

from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from fire_atlas.atlas.encode import encode_sprite
from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import (
    decode_bytes,
    encode_bytes,
    expose,
    hex_to_srgb,
    unpremultiply,
)
from fire_atlas.core.workers import Workers
from fire_atlas.effect.flakes.drawing import add_glow
from fire_atlas.effect.flakes.layer import FlakeLight
from fire_atlas.effect.flame.study import study_flame
from fire_atlas.pipeline.animation.analyse import analyse
from fire_atlas.pipeline.animation.layers import Layers, compose_layers, draw
from fire_atlas.recipe.effect import Flakes
from tests.support.clips import campfire, clip_of, looped, open_clip, real
from tests.support.effect import (
    AGE,
    ID,
    LIFE,
    A,
    Array,
    B,
    EffectRun,
    G,
    R,
    X,
    Y,
    context_of,
    recipe_of,
    run_effect,
)
from tests.timeline.moving import Notes


def _layer(effect: EffectRun, i: int) -> NDArray[np.float32]:
    assert isinstance(effect.recipe.flakes, Flakes)
    rows, clip = effect.tracks.frames[i], effect.clip
    return draw(effect.recipe.flakes, rows, clip.height, clip.width).rgb()


def _shown(effect: EffectRun, i: int) -> NDArray[np.uint8]:
    return encode_bytes(expose(_layer(effect, i)))


def _border_light(effect: EffectRun) -> int:
    """Brightest byte that flakes leave in the outermost pixels of any frame."""
    most = 0
    for i in range(effect.clip.count):
        shown = _shown(effect, i)
        edges = (shown[0], shown[-1], shown[:, 0], shown[:, -1])
        most = max(most, *(int(edge.max()) for edge in edges))
    return most


@pytest.mark.parametrize("glow", [0.0, 0.5])
def test_flakes_that_leave_fade_at_the_border_or_are_cut_by_it(glow: float) -> None:
    def at_border(edge: str) -> int:
        return _border_light(
            run_effect(campfire(160), {"flakes": {"edge": edge, "rate": 400, "glow": glow}})
        )

    assert at_border("crop") > 100
    assert at_border("fade") <= 2


def test_a_glow_adds_its_share_of_the_light() -> None:
    plane = np.zeros((1, 200, 200), np.float32)
    plane[:, 95:105, 90:112] = 3
    light = FlakeLight(plane, np.array([[1.0, 0.3, 0.1]], np.float32))
    for share in (0.25, 1.0, 3.0):
        glowing = add_glow(light, share, fades=False).rgb()
        total = glowing.sum(axis=(0, 1)) / light.rgb().sum(axis=(0, 1))
        assert total == pytest.approx(1 + share, rel=1e-3)


def test_a_recipes_glow_adds_its_share_of_the_light() -> None:
    clip = campfire(160, 12)
    once = {"timeline": {"loop": "none"}}
    bare, haloed = (run_effect(clip, {"flakes": {"glow": glow}, **once}) for glow in (0.0, 0.4))
    lit = [(_layer(bare, i).sum(), _layer(haloed, i).sum()) for i in range(clip.count)]
    without, with_halo = np.sum(lit, axis=0)
    assert with_halo / without == pytest.approx(1.4, rel=0.02)


def test_a_glow_is_not_part_of_the_tracks() -> None:
    clip = campfire(96, 8)
    bare, haloed = (run_effect(clip, {"flakes": {"glow": glow}}) for glow in (0.0, 2.0))
    assert all(map(np.array_equal, bare.tracks.frames, haloed.tracks.frames))


def _painted() -> Clip:
    """Return a small pixel-art fire of five colours, hard-edged, on nothing."""
    colours = np.array(
        [
            [0, 0, 0, 0],
            [90, 20, 12, 255],
            [200, 60, 20, 255],
            [250, 150, 40, 255],
            [255, 240, 170, 255],
        ],
        np.uint8,
    )
    frames = []
    for i in range(10):
        level = np.zeros((64, 48), np.uint8)
        for step in range(4):
            tip = 12 + 9 * step + round(3 * np.sin(i * 0.9 + step))
            lean = round(4 * np.sin(i * 0.6))
            shape = np.array([[24 + lean, tip], [12 + 2 * step, 62], [36 - 2 * step, 62]], np.int32)
            cv2.fillPoly(level, [shape], (step + 1,))
        shown = colours[level]
        light = decode_bytes(np.ascontiguousarray(shown[..., :3]))
        frames.append(np.dstack([light * (shown[..., 3:] > 0), shown[..., 3] / np.float32(255)]))
    return clip_of([np.asarray(f, np.float32) for f in frames], fps=12)


PIXEL_ART: dict[str, Any] = {
    "flakes": {"sprite": "pixel", "rate": 120},
    "motion_blur": "none",
    "composite": {"palette": "clip"},
    "timeline": {"loop": "none"},
}


def _colours(shown: NDArray[np.uint8]) -> set[tuple[int, ...]]:
    return {tuple(int(c) for c in colour) for colour in shown.reshape(-1, 3)}


def _check_palette(clip: Clip, edge: str) -> None:
    keys = {**PIXEL_ART, "flakes": {**PIXEL_ART["flakes"], "edge": edge}}
    effect = run_effect(clip, keys)
    own: set[tuple[int, ...]] = set()
    for i in range(clip.count):
        pixels = clip.read(i)
        own |= _colours(encode_bytes(unpremultiply(pixels))[pixels[..., 3] > 0.5])
    seen = 0
    for i in range(clip.count):
        # In few colours nothing fades: a flake is there as long as it is bright enough to be seen.
        flaked = _shown(effect, i).max(axis=2) >= 64
        pixels = effect.finished(i)
        assert (pixels[flaked][:, 3] == 1.0).all(), "a flake's pixels cover fully"
        assert _colours(encode_bytes(unpremultiply(pixels))[flaked]) <= own
        assert np.array_equal(pixels[~flaked], clip.read(i)[~flaked])
        seen += int(flaked.sum())
    assert seen > 20


def test_a_glow_in_the_colours_of_the_clip_is_no_patch() -> None:
    """Light too faint to be seen takes no colour of the palette, however far it reaches."""
    clip, keys = campfire(96), {"timeline": {"loop": "none"}, "composite": {"palette": "clip"}}
    plain, soft = (run_effect(clip, {**keys, "flakes": {"glow": glow}}) for glow in (0.0, 0.5))
    for i in (20, 40):
        covered = [np.mean(effect.finished(i)[..., 3] == 1) for effect in (plain, soft)]
        assert covered[1] < covered[0] + 0.05


@pytest.mark.parametrize("name", ["pixel_art", real("cartoon_freedoom_fire")])
def test_pixel_sparks_go_through_the_flames_colours_as_they_die(name: str) -> None:
    flakes = {"style": "pixel", "edge": "crop", "rate": 60}
    effect = run_effect(open_clip(name), {"flakes": flakes, "motion_blur": "none"})
    assert isinstance(effect.recipe.flakes, Flakes) and effect.recipe.flakes.colors != "auto"
    stops = [tuple(colour) for colour in hex_to_srgb(effect.recipe.flakes.colors).tolist()]
    rows = np.concatenate(effect.tracks.frames)
    light = np.asarray(rows[:, [R, G, B]] * rows[:, [A]], np.float32)
    shown = np.array([stops.index(tuple(c)) for c in encode_bytes(expose(light)).tolist()])
    left = 1 - rows[:, AGE] / rows[:, LIFE]  # of its life: the last colour is that of the young
    assert (shown == np.ceil(left * len(stops)) - 1).mean() > 0.99  # but for rounding at the steps
    assert len(rows) > 100


@pytest.mark.parametrize("edge", ["fade", "crop"])
def test_pixel_flakes_of_a_painting_have_only_its_colours(edge: str) -> None:
    _check_palette(_painted(), edge)


@pytest.mark.parametrize("name", ["pixel_art", real("cartoon_freedoom_fire")])
def test_pixel_flakes_of_pixel_art_have_only_its_colours(name: str) -> None:
    _check_palette(open_clip(name), "fade")


@pytest.mark.parametrize("name", ["pixel_art", real("cartoon_freedoom_fire")])
def test_pixel_flakes_on_nothing_are_never_near_black(name: str) -> None:
    """A flake that goes out beside the flame must not end as a dark, opaque dot."""
    clip = open_clip(name)
    effect = run_effect(clip, PIXEL_ART)
    dark, seen = 0, 0
    for i in range(clip.count):
        alone = (_layer(effect, i).sum(axis=2) > 0) & (clip.read(i)[..., 3] == 0)
        finished = effect.finished(i)
        alone &= finished[..., 3] > 0
        shown = encode_bytes(unpremultiply(finished))[alone]
        dark += int((shown.max(axis=1) < 40).sum())
        seen += len(shown)
    assert seen > 20 and dark == 0, f"{dark} of {seen}"


def test_pixel_flakes_are_whole_squares() -> None:
    effect = run_effect(_painted(), PIXEL_ART)
    sizes: Array = effect.rows[:, 5]
    assert np.array_equal(sizes, np.rint(sizes)) and sizes.min() >= 1


@pytest.mark.parametrize("blend", ["add", "screen", "over"])
def test_flakes_that_are_not_baked_leave_the_frames_as_they_came(blend: str) -> None:
    clip = campfire(96, 6)
    effect = run_effect(
        clip, {"flakes": {"bake": False, "rate": 500}, "composite": {"blend": blend}}
    )
    assert len(effect.rows) > 50
    for i in range(clip.count):
        assert np.array_equal(effect.finished(i), clip.read(i))


@pytest.mark.parametrize("blend", ["add", "screen", "over"])
def test_baked_flakes_reach_the_bytes_of_the_sprites(blend: str) -> None:
    clip = campfire(96, 6)
    effect = run_effect(clip, {"flakes": {"rate": 500}, "composite": {"blend": blend}})
    changed = [
        not np.array_equal(
            encode_sprite(effect.finished(i), "straight", "srgb").image,
            encode_sprite(clip.read(i), "straight", "srgb").image,
        )
        for i in range(clip.count)
    ]
    assert all(changed[1:]), "only the first frame is before all births"


@pytest.mark.parametrize("stored", [False, True])
def test_pixels_without_flakes_stay_bit_for_bit_as_they_were(stored: bool) -> None:
    chance = np.random.default_rng(3)
    flame = chance.integers(0, 256, (4, 5, 4)) if stored else chance.random((4, 5, 4)) / 2
    before = flame.astype(np.uint8 if stored else np.float32)
    flakes = FlakeLight(np.zeros((1, 4, 5), np.float32), np.ones((1, 3), np.float32))
    flakes.planes[0, 1, 2] = 1.0
    after = compose_layers(Layers(before.copy(), flakes), recipe_of({}), None)
    assert after.dtype == before.dtype and not np.array_equal(after[1, 2], before[1, 2])
    after[1, 2] = before[1, 2]
    assert np.array_equal(after, before)


def test_a_frame_may_have_flakes_with_nothing_behind_them_alone() -> None:
    flame = np.zeros((8, 9, 4), np.uint8)
    flame[:, :3] = (250, 120, 20, 255)
    light = np.zeros((1, 8, 9), np.float32)
    light[0, 4, 6] = 2
    flakes = FlakeLight(light, np.array([[1, 0.5, 0.1]], np.float32))
    shown = compose_layers(Layers(flame.copy(), flakes), recipe_of({}), None)
    assert shown[4, 6].any()
    shown[4, 6] = 0
    assert (shown == flame).all()


@pytest.mark.parametrize("most", [40, 100])
def test_a_loop_that_may_hold_few_flakes_is_as_full_at_its_end_as_at_its_beginning(
    most: int,
) -> None:
    keys = {"flakes": {"rate": 2000, "max": most, "bursts": 0}}
    alive = np.array([len(rows) for rows in run_effect(campfire(96), keys).tracks.frames])
    assert alive.max() <= most
    assert alive.min() > 0.4 * alive.max()


@pytest.mark.parametrize("lift", [1.2, 5.0])
def test_flakes_are_dim_before_they_leave_however_fast_they_are(lift: float) -> None:
    keys = {"flakes": {"rate": 400}, "buoyancy": {"lift": lift}}
    effect = run_effect(looped(campfire(160), 4.0), {**keys, "timeline": {"loop": "none"}})
    last_frame = effect.tracks.frames[-1][:, ID]
    left = [f for f in effect.flights(4) if f[-1, Y] < 12 and f[-1, ID] not in last_frame]
    last = np.array([f[-1, A] / f[:, A].max() for f in left if f[:, A].max() > 0])
    assert len(last) > 100 and np.quantile(last, 0.99) < 0.25


def test_flakes_as_large_as_the_frame_are_seen() -> None:
    rows = run_effect(campfire(96), {"flakes": {"size": [0.8, 1]}}).rows
    assert np.mean(rows[:, A] > 0) > 0.3


def test_a_fire_that_sheds_nothing_says_why() -> None:
    progress = Notes()
    clip = campfire(96, 8)
    recipe = recipe_of({"features": {"clamp": 10000}})
    with Workers(1) as workers:
        study = study_flame(clip, recipe.features, (0.0, -1.0), workers)
        analyse(clip, study, recipe, context_of(workers, progress))
    assert "features.clamp" in progress.notes[-1]


def test_embers_are_dimmed_by_the_flame_of_their_own_frame_alone() -> None:
    """Others, which hide the flame behind them, have all of their light wherever they fly."""
    clip = open_clip("campfire", 96, 24)
    lost, whole = (
        run_effect(clip, {"composite": {"blend": blend}, "flakes": {"rate": 200}})
        for blend in ("add", "over")
    )
    cell, dimmed = lost.analysis.field.cell, []
    for i, (seen, full) in enumerate(zip(lost.tracks.frames, whole.tracks.frames, strict=True)):
        frame = lost.clip.read(i % lost.clip.count)
        shown = encode_bytes(unpremultiply(frame)).max(axis=-1) * frame[..., 3]
        spare = [(0, -length % cell) for length in shown.shape]
        cells = np.pad(shown, spare, "edge").reshape(24, cell, -1, cell).mean(axis=(1, 3))
        row, column = (
            np.clip(seen[:, axis] // cell, 0, count - 1).astype(int)
            for axis, count in zip((Y, X), cells.shape, strict=True)
        )
        lit = full[:, A] > 1e-3
        value, share = cells[row, column][lit], seen[lit, A] / full[lit, A]
        assert share[value < 60] == pytest.approx(1, abs=0.02)
        assert (share[value > 208] == 0).all()
        middling = (value > 110) & (value < 145)
        assert ((share[middling] > 0.15) & (share[middling] < 0.9)).all()
        dimmed.append(middling | (value > 208))
        assert np.array_equal(np.delete(seen, A, 1), np.delete(full, A, 1))
    assert np.concatenate(dimmed).sum() > 50

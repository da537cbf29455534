"""Any recipe that is legal works: finite flakes, bounded light, no warning, whatever the values."""

import tracemalloc
from typing import Any, get_args

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pydantic import BaseModel

from fire_atlas.atlas.encode import encode_sprite
from fire_atlas.core.clip import Clip
from fire_atlas.core.picture import as_light
from fire_atlas.core.pixels import decode_bytes
from fire_atlas.effect.composition.blur import blur_along
from fire_atlas.effect.flakes.drawing import draw_flakes
from fire_atlas.effect.flakes.tracks import COLUMNS
from fire_atlas.pipeline.animation.layers import layers_of
from fire_atlas.recipe.effect import (
    Buoyancy,
    Composite,
    Features,
    FireClass,
    Flakes,
    FlakeStyle,
    MotionBlur,
)
from fire_atlas.recipe.wind import Wind
from tests.support.clips import clip_of
from tests.support.effect import SIZE, STRETCH, TAIL, A, B, EffectRun, G, R, run_effect

Drawn = st.SearchStrategy[Any]


def _number(low: float, high: float, usual: float) -> Drawn:
    """Any number of a range: half the time near what is usual, else anywhere, or an end of it."""
    near = st.floats(max(low, usual / 4), min(high, max(usual, 1e-3) * 4))
    return st.one_of(near, near, st.floats(low, high), st.sampled_from([low, high]))


def _gate(high: float, usual: float) -> Drawn:
    """Any threshold: mostly one that lets something pass."""
    return st.one_of(
        st.just(0.0), *[st.floats(0, usual / k) for k in (1, 2, 4, 8)], st.floats(0, high)
    )


def _positive(high: float, usual: float) -> Drawn:
    """Any number above 0, mostly near what is usual."""
    near = [st.floats(usual / k, min(high, usual * k)) for k in (1.5, 2, 4)]
    return st.one_of(*near, st.sampled_from([1e-300, 1e-9, high]))


def _ordered(numbers: Drawn) -> Drawn:
    return st.lists(numbers, min_size=2, max_size=2).map(sorted)


def _auto_or(numbers: Drawn) -> Drawn:
    return st.one_of(st.just("auto"), numbers)


def _colour() -> Drawn:
    return st.integers(0, 0xFFFFFF).map(lambda code: f"#{code:06x}")


def _sigma() -> Drawn:
    return st.tuples(_number(0.3, 20, 1.0), _number(0.3, 40, 1.6)).map(sorted).map(list)


FEATURES: dict[str, Drawn] = {
    "preset": st.sampled_from(["auto", "paper"]),
    "kernel": st.sampled_from(["unit", "printed"]),
    "sigma": _sigma().filter(lambda pair: pair[0] <= 20),
    "epsilon": _auto_or(_gate(10000, 40.0)),
    "n": _number(0, 20, 1.5),
    "kappa_over": st.sampled_from(["flame", "image"]),
    "beta": _number(0, 10, 0.02),
    "clamp": _gate(10000, 2.0),
}
_lift = _number(-100, 100, 1.2)
BUOYANCY: dict[str, Drawn] = {
    "motion": st.sampled_from(["flow", "features"]),
    "cell": st.one_of(st.sampled_from([1, 64, 4]), st.integers(1, 64)),
    "coupling": _number(0, 1000, 90.0),
    "feature_force": _auto_or(_number(0, 10000, 64.0)),
    "lift": st.one_of(st.just("auto"), _lift, st.tuples(_lift, _lift).map(list)),
    "gravity": _number(-100, 100, 0.1),
    "drag": _number(0, 1000, 2.0),
    "viscosity": _number(0, 10, 0.0005),
    "turbulence": _number(0, 100, 0.15),
    "projection": st.booleans(),
}
FLAKES: dict[str, Drawn] = {
    "class": st.sampled_from(["auto", *get_args(FireClass)]),
    "style": st.sampled_from(["auto", *get_args(FlakeStyle)]),
    "bake": st.booleans(),
    "alpha": _auto_or(_gate(10000, 0.06)),
    "rate": _number(0, 100000, 600.0),
    "bursts": _number(0, 100, 0.8),
    "sparks": _auto_or(_number(0, 1, 0.3)),
    "life": _ordered(_positive(60, 1.0)),
    "size": _ordered(_positive(1, 0.02)),
    "stretch": _number(0, 10, 0.5),
    "scatter": _number(-1, 1, 0.99),
    "own_motion": _number(0, 10, 1.0),
    "lag": st.one_of(_number(0, 10, 0.012), st.just(1e-300)),
    "colors": _auto_or(st.lists(_colour(), min_size=1, max_size=16)),
    "intensity": _number(0, 1000, 6.0),
    "edge": st.sampled_from(["fade", "crop"]),
    "glow": _number(0, 10, 0.5),
    "sprite": st.sampled_from(["auto", "soft", "pixel"]),
    "rounds": st.sampled_from(["auto", 1]),  # more are refused where pages show flakes
    "max": st.sampled_from([0, 20000, 60000, 1, 200, 2000]),
}
MOTION_BLUR: dict[str, Drawn] = {
    "shutter": _number(0, 4, 0.5),
    "samples": st.sampled_from([1, 2, 9, 65]),
    "flame": st.booleans(),
    "exaggeration": _number(0, 64, 8.0),
}
COMPOSITE: dict[str, Drawn] = {
    "blend": st.sampled_from(["add", "screen", "over"]),
    "intensity": _number(0, 100, 1.0),
    "palette": st.sampled_from(["auto", "none", "clip"]),
}
_level, _heading = _number(0, 5, 1.0), _number(-360, 360, 30.0)
WIND: dict[str, dict[str, Drawn]] = {
    "steady": {"level": _level, "direction": _heading},
    "changing": {
        "keyframes": st.lists(
            st.fixed_dictionaries(
                {"t": _number(0, 3600, 0.2), "level": _level, "direction": _heading}
            ),
            min_size=1,
            max_size=4,
        ).map(lambda keyframes: sorted(keyframes, key=lambda k: float(k["t"])))
    },
    "gusty": {
        "gusts": st.fixed_dictionaries(
            {"mean": _level, "strength": _level, "period": _number(0.1, 600, 2.0)}
        ).map(lambda gusts: {**gusts, "strength": min(gusts["strength"], 5 - gusts["mean"])}),
        "direction": _heading,
    },
}


def _block(keys: dict[str, Drawn], *always: str) -> Drawn:
    """``always`` and some of the other keys of a block; the rest keep their defaults."""
    optional = {key: drawn for key, drawn in keys.items() if key not in always}
    return st.fixed_dictionaries({key: keys[key] for key in always}, optional=optional)


def _drawable(flakes: dict[str, Any]) -> dict[str, Any]:
    """Fewer flakes where they are large: a hundred million pixels a frame would take a minute."""
    return {**flakes, "rate": min(flakes.get("rate", 600.0), 60 / max(flakes["size"][1], 6e-4))}


def _without_idle_keys(keys: dict[str, Any]) -> dict[str, Any]:
    """Remove the keys that are refused because another one leaves them nothing to do."""
    is_paper = keys["features"].get("preset") == "paper"
    buoyancy, blur = dict(keys["buoyancy"]), keys["motion_blur"]
    motion = buoyancy.get("motion", "features" if is_paper else "flow")
    buoyancy.pop("feature_force" if motion == "flow" else "coupling", None)
    is_free = buoyancy.get("drag", 0.0 if is_paper else 2.0) == 0
    if blur != "none" and not blur.get("flame", is_paper):
        blur = {key: blur[key] for key in blur if key not in ("exaggeration", "samples")}
    flakes, idle = dict(keys["flakes"]), set[str]()
    has_none = Flakes(**{k: flakes[k] for k in ("rate", "max", "class") if k in flakes}).why_none
    wind = {} if is_free or has_none else keys["wind"]
    if has_none:
        idle |= {"bursts", "sparks"}
    if is_paper:
        idle |= {"class", "style"}
    if flakes.get("own_motion", 0.0 if is_paper else 1.0) == 0:
        idle.add("lag")
        if is_free:
            buoyancy.pop("turbulence", None)
    if flakes.get("sparks") == 0:
        idle.add("bursts")
    if flakes.get("sprite") == "pixel":
        idle |= {"glow", "stretch"}
    flakes = {key: value for key, value in flakes.items() if key not in idle}
    return {**keys, "buoyancy": buoyancy, "flakes": flakes, "motion_blur": blur, "wind": wind}


RECIPES = st.fixed_dictionaries(
    {
        "seed": st.sampled_from([0, 1, 2**32 - 1]),
        "features": _block(FEATURES),
        "buoyancy": _block(BUOYANCY),
        "wind": st.one_of(*(_block(kind) for kind in WIND.values())),
        "flakes": _block(FLAKES, "size").map(_drawable),
        "motion_blur": st.one_of(st.just("none"), _block(MOTION_BLUR)),
        "composite": _block(COMPOSITE),
    }
).map(_without_idle_keys)


def test_every_key_of_the_effect_is_tried() -> None:
    blocks: list[tuple[type[BaseModel], set[str]]] = [
        (Features, set(FEATURES)), (Buoyancy, set(BUOYANCY)),
        (Flakes, set(FLAKES) | {"texture", "tint", "variants"}),  # have tests of their own
        (MotionBlur, set(MOTION_BLUR)),
        (Composite, set(COMPOSITE) | {"ramp"}),  # its colours have tests of their own
        (Wind, set().union(*WIND.values(), {"levels"})),  # levels need fire that is generated
    ]  # fmt: skip
    for model, tried in blocks:
        keys = {field.alias or name for name, field in model.model_fields.items()}
        assert keys == tried


def _clip(width: int, height: int, count: int, closed: bool, matte: str) -> Clip:
    """Return a blob of fire that rises and flickers."""
    y, x = np.mgrid[:height, :width]
    frames = []
    for i in range(count):
        turn = 2 * np.pi * i / count if closed else i * 0.9
        middle = width * (0.5 + 0.08 * np.sin(turn)), height * (0.6 + 0.07 * np.cos(turn))
        wide, tall = width * 0.2, height * (0.25 + 0.05 * np.sin(turn + 1))
        glow = np.exp(-(((x - middle[0]) / wide) ** 2) - ((y - middle[1]) / tall) ** 2)
        glow = np.clip(2.5 * glow - 0.6, 0, 1)
        shown = np.stack([255 * glow, 170 * glow**1.5, 60 * glow**3], axis=2)
        alpha = np.ones_like(glow) if matte == "none" else np.clip(glow * 1.4, 0, 1)
        light = decode_bytes(np.clip(np.rint(shown), 0, 255).astype(np.uint8))
        frames.append(np.asarray(np.dstack([light * alpha[..., None], alpha]), np.float32))
    return clip_of(frames, fps=12.0, matte=matte)


CLIPS = st.builds(
    _clip,
    width=st.integers(24, 48),
    height=st.integers(24, 48),
    count=st.sampled_from([6, 8, 3, 1, 2]),
    closed=st.booleans(),
    matte=st.sampled_from(["alpha", "none"]),
)


def _assert_sound(effect: EffectRun) -> None:
    field, tracks = effect.analysis.field, effect.tracks
    assert np.isfinite(field.u).all() and np.isfinite(field.v).all()
    assert np.isfinite(tracks.spawns).all()
    rows = effect.rows
    assert np.isfinite(rows).all()
    assert len(tracks.frames) == effect.clip.count * tracks.rounds
    assert (rows[:, [R, G, B, A]] >= 0).all()
    flakes = effect.recipe.flakes
    assert flakes != "none"
    assert all(len(frame) <= flakes.max for frame in tracks.frames)
    assert (rows[:, SIZE] > 0).all() and (rows[:, STRETCH] >= 1).all()
    for i in range(effect.clip.count):
        pixels = effect.finished(i)
        assert np.isfinite(pixels).all()
        assert pixels.min() >= 0
        assert pixels[..., 3].max() <= 1 + 1e-6
        assert pixels[..., :3].max() <= 1 + _brightest(effect, i) + 1e-5, "a flake adds 1 at most"
        encode_sprite(pixels, "premultiplied", "srgb")


def _brightest(effect: EffectRun, i: int) -> float:
    """Brightest light of frame ``i`` without its flakes."""
    bare = layers_of(i, effect.simulated, effect.recipe).flame
    return float(as_light(bare)[..., :3].max())


@pytest.mark.slow
@settings(
    max_examples=100,
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)
@given(keys=RECIPES, clip=CLIPS)
def test_any_legal_recipe_works(keys: dict[str, Any], clip: Clip) -> None:
    _assert_sound(run_effect(clip, keys, jobs=1))


def test_a_recipe_of_only_largest_values_works() -> None:
    """All extremes at once, with as many flakes as are allowed and a small clip."""
    keys: dict[str, Any] = {
        "buoyancy": {
            "lift": 100, "gravity": -100, "drag": 0, "turbulence": 100, "viscosity": 10,
            "motion": "features", "feature_force": 10000, "cell": 1,
        },
        "flakes": {
            "rate": 2000, "life": [60, 60], "size": [1, 1], "stretch": 10, "scatter": -1, "lag": 10,
            "own_motion": 10, "intensity": 1000, "glow": 10,
        },
        "motion_blur": {"shutter": 4, "samples": 65, "flame": True, "exaggeration": 64},
        "composite": {"intensity": 100},
    }  # fmt: skip
    _assert_sound(run_effect(_clip(32, 32, 4, False, "alpha"), keys, jobs=1))


@pytest.mark.parametrize("samples", [1, 2, 9, 64])
@pytest.mark.parametrize("speed", [50.0, 2000.0, 1e5])
def test_blur_never_makes_a_flame_brighter_than_it_was(samples: int, speed: float) -> None:
    """However fast the field is, and even where all light is blown out of the frame."""
    pixels = _clip(40, 40, 1, False, "alpha").read(0)
    still, fast = np.zeros((10, 10), np.float32), np.full((10, 10), speed, np.float32)
    for u, v in ((fast, still), (still, -fast)):
        blurred = blur_along(pixels, u, v, 4, np.ones((40, 40), np.float32), 1 / 12, samples)
        assert np.isfinite(blurred).all()
        assert blurred[..., :3].max() <= 1.05 * pixels[..., :3].max()


def test_many_large_flakes_take_little_memory() -> None:
    """500 flakes as large as a frame of 256 px, drawn at once, are 26 million pixels."""
    rows = np.zeros((500, len(COLUMNS)))
    rows[:, [1, 2, SIZE, STRETCH, R, A, TAIL]] = 128, 128, 256, 1, 1, 1, 1
    tracemalloc.start()
    light = draw_flakes(rows, 256, 256).rgb()
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert light[128, 128, 0] == pytest.approx(500, rel=0.01)
    assert peak < 500e6, f"{peak / 1e6:.0f} MB"

"""The class of a fire, on clips whose kind is known."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from pydantic import ValidationError

from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import Pixels, encode_bytes, hex_to_linear, unpremultiply
from fire_atlas.core.progress import SilentProgress
from fire_atlas.core.workers import Workers
from fire_atlas.effect.flakes.defaults import CLASSES, STYLES
from fire_atlas.effect.flame.study import study_flame
from fire_atlas.pipeline.animation.classify import classify
from fire_atlas.recipe.effect import WITHOUT_FLAKES, Flakes
from fire_atlas.recipe.models import Recipe
from tests.support.clips import clip_of, open_clip, real
from tests.support.effect import context_of, recipe_of, run_effect
from tests.support.fire_kinds import KINDS, streaming

PAINTED = {
    "gas ring": ("gas", "anime"),
    "candle in a bright room": ("candle", "film"),
    "pixel torch": ("campfire", "pixel"),
    "pink comet": ("campfire", "anime"),
    "grey puff": ("explosion", "grey"),
    "daylight bonfire": ("campfire", "film"),
    "flat vector fire": ("campfire", "cartoon"),
    "lava": ("none", "film"),
    "explosion": ("explosion", "film"),
    "sparkler": ("none", "film"),
    "smoke without fire": ("none", "film"),
    "blue soul fire": ("campfire", "anime"),
    "glossy flame": ("campfire", "anime"),
    "thin ring": ("campfire", "film"),
}
"""Class and style of each."""

SAMPLES = {
    "campfire": ("campfire", "film"),
    "candle": ("candle", "film"),
    "torch": ("torch", "film"),
    "fireball": ("campfire", "film"),
    "explosion": ("explosion", "film"),
    "cartoon": ("campfire", "cartoon"),
    "pixel_art": ("campfire", "pixel"),
}

REAL = {
    "cartoon_fluent_fire": ("campfire", "anime"),
    "cartoon_freedoom_fire": ("campfire", "pixel"),
    "cartoon_tauran_flame_sheet": ("campfire", "film"),
    "cartoon_wesnoth_campfire": ("campfire", "film"),
    "cartoon_wesnoth_fireball_impact": ("explosion", "film"),
    "real_candle_red": ("candle", "film"),
    "real_fireplace_gif": ("campfire", "film"),
    "real_firewall_stock": ("wall", "film"),
    "sim_unity_flame02": ("campfire", "film"),
    "sim_unity_flame03": ("campfire", "film"),
}


class _Notes(SilentProgress):
    """Keeps the notes of a step."""

    def __init__(self) -> None:
        self.notes = list[str]()

    def note(self, message: str) -> None:
        """Keep a note."""
        self.notes.append(message)


def classified(clip: Clip, keys: dict[str, Any] | None = None) -> tuple[Recipe, list[str]]:
    """Return the recipe of ``keys`` as the class of a clip fills it in, and the notes."""
    recipe, progress = recipe_of(keys or {}), _Notes()
    with Workers(1) as workers:
        study = study_flame(clip, recipe.features, None, workers)
        return classify(recipe, clip, study, context_of(workers, progress)), progress.notes


def flakes_of(clip: Clip, keys: dict[str, Any] | None = None) -> Flakes:
    """Return the section ``flakes`` as the class of a clip fills it in."""
    flakes = classified(clip, keys)[0].flakes
    assert flakes != "none"
    return flakes


@pytest.mark.parametrize(("name", "kind"), PAINTED.items())
def test_each_kind_of_fire_has_its_class_and_style(name: str, kind: tuple[str, str]) -> None:
    flakes = flakes_of(KINDS[name]())
    assert (flakes.fire_class, flakes.style) == kind


@pytest.mark.parametrize(
    ("name", "kind"), [*SAMPLES.items(), *(real(*each) for each in REAL.items())]
)
def test_clips_have_their_class_and_style(name: str, kind: tuple[str, str]) -> None:
    flakes = flakes_of(open_clip(name))
    assert (flakes.fire_class, flakes.style) == kind


@pytest.mark.parametrize("name", ["gas ring", "lava", "smoke without fire", "sparkler"])
def test_nothing_is_shed_where_no_flakes_belong(name: str) -> None:
    clip = KINDS[name]()
    assert not len(run_effect(clip).births)
    assert len(run_effect(clip, {"flakes": {"class": "campfire", "rate": 60}}).analysis.field.u)


def test_the_note_says_which_class_why_and_how_to_override_it() -> None:
    burns = "class: campfire (orange flame that rises, area 0.22 heights²)"
    looks = "style: film (shades and edges as of light)"
    both = f"{burns}, {looks}; flakes.class and flakes.style override"
    for stated, note in (
        ({}, both),
        ({"style": "film"}, f"{burns}; flakes.class overrides"),
        ({"class": "campfire"}, f"{looks}; flakes.style overrides"),
    ):
        assert classified(open_clip("campfire"), {"flakes": stated})[1] == [note]


def test_what_is_stated_is_neither_measured_nor_noted() -> None:
    stated = {"class": "candle", "style": "pixel"}
    recipe, notes = classified(open_clip("campfire"), {"flakes": stated})
    assert recipe.flakes != "none"
    assert (recipe.flakes.fire_class, recipe.flakes.style) == ("candle", "pixel")
    assert notes == []


def test_what_the_recipe_states_wins() -> None:
    stated = {"rate": 44.0, "bursts": 0.5, "sparks": 0.1, "colors": ("#ff0000",), "sprite": "soft"}
    flakes = flakes_of(KINDS["pixel torch"](), {"flakes": stated})
    assert {key: getattr(flakes, key) for key in stated} == stated
    keys = {"composite": {"palette": "none"}}
    assert classified(KINDS["pixel torch"](), keys)[0].composite.palette == "none"


def rate_of(clip: Clip, keys: dict[str, str]) -> float:
    rate = flakes_of(clip, {"flakes": keys}).rate
    assert rate != "auto"
    return rate


def test_class_and_style_scale_the_rate() -> None:
    clip = open_clip("campfire")
    burns = {name: rate_of(clip, {"class": name, "style": "film"}) for name in CLASSES}
    assert burns["none"] == burns["gas"] == 0
    assert 0 < burns["candle"] < 0.2 * burns["campfire"]
    looks = {name: rate_of(clip, {"class": "campfire", "style": name}) for name in STYLES}
    assert looks["film"] == burns["campfire"]
    assert max(looks["cartoon"], looks["pixel"]) < looks["film"] / 2


@pytest.mark.parametrize(
    ("style", "sprite", "palette"),
    [
        ("film", "soft", "none"),
        ("anime", "soft", "none"),
        ("grey", "soft", "none"),
        ("cartoon", "soft", "clip"),
        ("pixel", "pixel", "clip"),
    ],
)
def test_a_style_states_a_whole_look(style: str, sprite: str, palette: str) -> None:
    recipe = classified(open_clip("campfire"), {"flakes": {"style": style}})[0]
    assert recipe.flakes != "none"
    assert (recipe.flakes.sprite, recipe.composite.palette) == (sprite, palette)
    colours = recipe.flakes.colors
    if style == "film":
        assert colours == "auto"
    else:
        light = hex_to_linear(colours)
        assert (np.ptp(light, axis=1).max() == 0) == (style == "grey")


@pytest.mark.parametrize(
    ("old", "new"), [("flat", "cartoon"), ("pixel", "pixel"), ("art", "anime"), ("grey", "grey")]
)
def test_a_class_that_says_how_fire_looks_is_refused_with_the_style(old: str, new: str) -> None:
    with pytest.raises(ValidationError, match=f"`style: {new}`"):
        recipe_of({"flakes": {"class": old}})


def test_by_day_neither_sky_nor_bright_smoke_sheds_anything() -> None:
    effect = run_effect(KINDS["daylight bonfire"](), {"timeline": {"loop": "none"}})
    assert len(effect.births) > 50
    assert effect.births[:, 1].min() > 0.3 * effect.clip.height
    assert effect.study.box.top > 0.3 * effect.clip.height


def test_the_paper_knows_no_classes() -> None:
    recipe, notes = classified(KINDS["pixel torch"](), {"features": {"preset": "paper"}})
    assert recipe.flakes != "none" and notes == []
    assert recipe.flakes.fire_class == recipe.flakes.style == "auto"


def test_pixel_art_gets_flakes_in_its_own_colours_alone() -> None:
    """Every pixel that flakes have changed has a colour that occurs in the clip."""
    effect = run_effect(KINDS["pixel torch"](), {"flakes": {"rate": 120}})
    count = effect.clip.count
    own = np.unique(np.concatenate([_codes(effect.clip.read(i)).ravel() for i in range(count)]))
    shown, plain = (_codes(read(count // 2)) for read in (effect.finished, effect.clip.read))
    changed = shown[shown != plain]
    assert changed.size
    assert np.isin(changed, own).all()


def test_flat_art_gets_dots_in_its_own_colours_with_smooth_edges() -> None:
    """A pixel that flakes have changed has a colour of the clip, or lies between one and what it
    covers: (p - q) is a multiple of (c - q)."""
    effect = run_effect(KINDS["flat vector fire"](), {"flakes": {"rate": 120}})
    frames = [effect.clip.read(i) for i in range(effect.clip.count)]
    colours = np.concatenate([unpremultiply(each)[each[..., 3] > 0.5] for each in frames])
    own = np.unique(np.insert(colours, 3, 1.0, axis=1), axis=0)
    shown, plain = (read(len(frames) // 2) for read in (effect.finished, effect.clip.read))
    changed = (np.abs(shown - plain) > 1e-3).any(axis=2)
    shown, plain = shown[changed], plain[changed]
    way = own - plain[:, None]
    part = np.clip(((shown - plain)[:, None] * way).sum(2) / ((way**2).sum(2) + 1e-9), 0, 1)
    off = np.abs(plain[:, None] + part[..., None] * way - shown[:, None]).max(axis=2)
    assert off.min(axis=1).max() < 0.01
    whole = (np.abs(own - shown[:, None]).max(axis=2) < 0.01).any(axis=1)
    assert 0.3 < whole.mean() < 0.95, "dots, and their edges"


def _codes(pixels: Pixels) -> NDArray[np.int64]:
    """Return the straight sRGB colour of each pixel (h, w) as a whole number."""
    shown = encode_bytes(unpremultiply(pixels)).astype(np.int64)
    return np.asarray(shown @ [1 << 16, 1 << 8, 1], np.int64)


@pytest.mark.parametrize("name", ["pixel_art", "pixel torch"])
def test_pixel_art_gets_whole_hard_pixels(name: str) -> None:
    clip = KINDS[name]() if name in KINDS else open_clip(name)
    effect = run_effect(clip, {"flakes": {"rate": 60}})
    assert effect.tracks.hard
    assert all(set(np.unique(effect.finished(i)[..., 3])) <= {0, 1} for i in range(clip.count))


def test_grey_fire_sheds_grey_flakes() -> None:
    light = hex_to_linear(flakes_of(KINDS["grey puff"]()).colors)
    assert (np.ptp(light, axis=1) == 0).all()


@pytest.mark.parametrize(("name", "channel"), [("pink comet", 0), ("blue soul fire", 2)])
def test_coloured_fire_sheds_flakes_of_its_own_hue(name: str, channel: int) -> None:
    light = hex_to_linear(flakes_of(KINDS[name]()).colors)
    assert (light.argmax(axis=1) == channel).all()
    assert (np.ptp(light, axis=1) > 0.3).all()


def test_the_class_does_not_depend_on_resolution_rate_or_direction() -> None:
    clip = streaming((-0.9, 0.0))
    halved = clip_of([clip.read(i)[::2, ::2] for i in range(clip.count)])
    mirrored = clip_of([clip.read(i)[:, ::-1] for i in range(clip.count)])
    slower = replace(clip, fps=12.0)
    found = {flakes_of(each).fire_class for each in (clip, halved, mirrored, slower)}
    assert found == {"campfire"}


def test_recipes_know_which_classes_shed_no_flakes() -> None:
    assert {name for name, burns in CLASSES.items() if burns.rate == 0} == WITHOUT_FLAKES

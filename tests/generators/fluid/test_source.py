"""Fluid as a source: what its keys do, what is refused before a simulation, loops and one-shots."""

import json
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from fire_atlas.cli import main
from fire_atlas.core.errors import RecipeError
from fire_atlas.core.pixels import srgb_to_linear
from fire_atlas.core.workers import Workers
from fire_atlas.generators.fluid.memory import Memory
from fire_atlas.generators.fluid.recording import record
from fire_atlas.generators.fluid.renderer import EDGE, FluidView, fluid_camera
from fire_atlas.generators.fluid.scene import Scene, build_scene
from fire_atlas.generators.fluid.volume import Volume
from fire_atlas.generators.settings import GenerationSettings
from fire_atlas.recipe.fluid import FluidSource
from fire_atlas.recipe.source import Views
from fire_atlas.recipe.wind import Wind
from fire_atlas.sources import fluid
from fire_atlas.sources.reader import OpeningContext

SMALL: dict[str, Any] = {"kind": "fluid", "resolution": 22, "width": 60, "height": 80}


@lru_cache(maxsize=32)
def simulated(keys: str, frames: int, level: float) -> FluidView:
    """Return the fire of a small recipe with the keys that JSON states, seen from the front."""
    source = FluidSource.model_validate(SMALL | json.loads(keys))
    settings = GenerationSettings(1, Wind(level=level), frames, 24.0, True, Views())
    scene = build_scene(source, settings)
    with Workers(2) as workers:
        volumes: list[Volume] = []
        record(scene, workers, volumes.append)
    return FluidView(scene, volumes, fluid_camera(source, 0, 0), "srgb")


def fire(frames: int = 10, level: float = 0.0, **keys: Any) -> FluidView:
    return simulated(json.dumps(keys), frames, level)


def pictures(view: FluidView) -> NDArray[np.float32]:
    """Return the later frames, (n, height, width, 4)."""
    count = len(view.volumes)
    return np.stack([view.frame(i) for i in range(count // 2, count)])


def height(view: FluidView) -> float:
    """Return the mean height above the lower edge of what covers, px."""
    cover = pictures(view)[..., 3].mean(axis=(0, 2))
    return float((cover * np.arange(len(cover))[::-1]).sum() / cover.sum())


def width(view: FluidView) -> float:
    """Return the standard deviation of what covers from left to right, px."""
    cover = pictures(view)[..., 3].mean(axis=(0, 1))
    place = np.arange(len(cover))
    middle = (cover * place).sum() / cover.sum()
    return float(np.sqrt((cover * (place - middle) ** 2).sum() / cover.sum()))


def lean(view: FluidView) -> float:
    """Return how far the upper half of the fire is to the right of its foot, px."""
    cover = pictures(view)[..., 3].mean(axis=0)
    half = len(cover) // 2
    return float((cover[:half].sum(axis=0) * np.arange(cover.shape[1])).sum() / cover[:half].sum())


def brightness(view: FluidView) -> float:
    return float(pictures(view)[..., :3].mean())


def smokiness(view: FluidView) -> float:
    count = len(view.volumes)
    return float(np.mean([view.smoke(i).mean() for i in range(count // 2, count)]))


def blueness(view: FluidView) -> float:
    shown = pictures(view)[..., :3].sum(axis=(0, 1, 2))
    return float(shown[2] / shown[0])


def sharpness(view: FluidView) -> float:
    shown = pictures(view)[..., :3].sum(axis=3)
    return float(np.abs(np.diff(shown, axis=2)).mean() / shown.mean())


BOOM: dict[str, Any] = {"fire": "explosion", "radius": 0.17}


@pytest.mark.parametrize(
    ("figure", "common", "less", "more", "factor"),
    [
        (height, {}, {"fuel_rate": 0.4}, {"fuel_rate": 1.6}, 1.15),
        (width, {}, {"radius": 0.2}, {"radius": 0.3}, 1.2),
        (brightness, {}, {"heat": 0.7}, {"heat": 1.3}, 1.5),
        (height, {}, {"lift": 0.4}, {"lift": 2.0}, 1.1),
        (width, {"fire": "steam"}, {"turbulence": 0.0}, {"turbulence": 3.0}, 1.1),
        (sharpness, {}, {"detail": 0.0}, {"detail": 1.0}, 1.02),
        (smokiness, {}, {"smoke": 0.2}, {"smoke": 1.5}, 2.0),
        (blueness, {"fire": "steam"}, {"smoke_colour": "#c08040"}, {"smoke_colour": "#4080c0"}, 2),
        (width, BOOM, {"blast": 0.1}, {"blast": 1.0}, 1.2),
        (height, {"fire": "steam"}, {"speed": 0.3}, {"speed": 3.0}, 1.2),
        (lean, {"fire": "steam"}, {"direction": [-1, 0, 1]}, {"direction": [1, 0, 1]}, 1.2),
        (
            width, {}, {"burners": [{"size": 0.1}]},
            {"burners": [{"at": [-0.2, 0, 0], "size": 0.1}, {"at": [0.2, 0, 0], "size": 0.1}]}, 1.5,
        ),
        (
            brightness, {}, {"burners": [{"size": 0.12, "strength": 0.3}]},
            {"burners": [{"size": 0.12}]}, 1.3,
        ),
    ],
)  # fmt: skip
def test_each_key_does_what_it_says(
    figure: Callable[[FluidView], float],
    common: dict[str, Any],
    less: dict[str, Any],
    more: dict[str, Any],
    factor: float,
) -> None:
    low, high = figure(fire(**common, **less)), figure(fire(**common, **more))
    assert high > factor * low, f"{low:.4g} and {high:.4g}"


def test_wind_bends_the_fire_its_own_way() -> None:
    still = lean(fire())
    assert lean(fire(level=3.0)) > still + 2


def test_a_finer_resolution_has_more_cubes() -> None:
    cells = [
        fire_scene.grid.cell
        for fire_scene in (
            build_scene(
                FluidSource.model_validate(SMALL | {"resolution": resolution}),
                GenerationSettings(1, Wind(), 10, 24.0, True, Views()),
            )
            for resolution in ("draft", "normal", "final", 48)
        )
    ]
    assert cells == pytest.approx([0.75**0.5 / n for n in (32, 64, 96, 48)])


def test_what_burns_for_a_while_begins_and_ends_empty() -> None:
    view = fire(frames=16, burning=[0.05, 0.3])
    cover = [view.frame(i)[..., 3].max() for i in range(16)]
    assert cover[0] <= 2 / 255 and cover[-1] <= 2 / 255
    assert max(cover) > 0.5
    assert not view.scene.loop


def test_an_explosion_begins_and_ends_empty() -> None:
    view = fire(frames=16, **BOOM)
    cover = [view.frame(i)[..., 3].max() for i in range(16)]
    assert cover[0] <= 2 / 255 and cover[-1] <= 2 / 255
    assert max(cover) > 0.9


@pytest.mark.parametrize(
    ("keys", "level"),
    [
        ({}, 0.0), ({"fire": "smoke"}, 0.0), ({"fire": "steam"}, 0.0),
        ({"fire": "flamethrower", "radius": 0.12}, 0.0), ({"fire": "torch", "radius": 0.14}, 3.0),
    ],
)  # fmt: skip
def test_a_loop_has_no_seam(keys: dict[str, Any], level: float) -> None:
    view = fire(frames=24, level=level, **keys)
    shown = [view.frame(i)[..., :3] for i in range(24)]
    steps = [float(np.abs(shown[i] - shown[i - 1]).mean()) for i in range(24)]
    around = max(steps[-1], steps[1])
    assert steps[0] <= 1.25 * max(around, float(np.median(steps)))


def test_a_muzzle_flash_shines_for_a_moment_with_lobes_beside_its_jet_and_leaves_smoke() -> None:
    keys = {"fire": "muzzle_flash", "resolution": 32, "width": 112, "height": 80}
    source = FluidSource.model_validate(SMALL | keys)
    scene = build_scene(source, GenerationSettings(0, Wind(), 14, 40.0, True, Views()))
    with Workers(2) as workers:
        volumes: list[Volume] = []
        record(scene, workers, volumes.append)
    view = FluidView(scene, volumes, fluid_camera(source, 0, 0), "srgb")
    light = [float(srgb_to_linear(view.frame(i)[..., :3]).mean()) for i in range(14)]
    assert light[0] == 0 and np.argmax(light) in (1, 2)
    assert max(light[5:]) < 0.2 * max(light)
    assert view.smoke(6).max() > 0.05
    lit = np.argwhere(view.frame(int(np.argmax(light)))[..., 3] > 0.5)
    (top, left), (bottom, right) = lit.min(axis=0), lit.max(axis=0)
    # Side lobes above and below the jet, which reaches farther ahead.
    assert top < 0.35 * 80 and bottom > 0.65 * 80 and right - left > 1.3 * (bottom - top)
    # Between the lobes it is dark: they fill less of their box than a ball does (79 %).
    assert len(lit) < 0.6 * (bottom - top + 1) * (right - left + 1)


@pytest.mark.parametrize(
    ("keys", "level", "side"),
    [
        ({"fire": "smoke", "radius": 0.2}, 5.0, "right side"),
        ({"fire": "torch", "radius": 0.3}, 0.0, "top"),
    ],
)
def test_what_leaves_the_frame_fades_before_its_side_and_is_noted(
    keys: dict[str, Any],
    level: float,
    side: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    view = fire(10, level, **keys)
    turns = 0 if side == "top" else 1  # the side comes to lie at the top
    shown = np.rot90(pictures(view)[..., 3].max(axis=0), turns)
    hidden = np.rot90(view.smoke(9), turns)
    edge = round(EDGE * 80)
    assert shown[0].max() == hidden[0].max() == 0 and shown[edge].max() > 0.25
    assert (np.diff(shown[: edge + 1].max(axis=1)) > 0).all()
    recipe = tmp_path / "fire.yaml"
    timeline = {"frames": 10, "fps": 24}
    recipe.write_text(json.dumps(
        {"source": SMALL | keys, "wind": {"level": level}, "timeline": timeline, "flakes": "none"}
    ))  # fmt: skip
    assert main(["build", str(recipe), "-o", str(tmp_path / "out")]) == 0
    said = " ".join(capsys.readouterr().err.split())
    assert "the fire leaves the frame at its" in said and side in said
    assert ("fuel_rate or lift, or" in said) == (side == "top")


def test_of_gas_at_the_lower_edge_no_lift_is_advised(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A ball of fire in the air: with four times the lift it reaches as far down."""
    source = SMALL | {"fire": "fireball", "radius": 0.3}
    recipe = tmp_path / "fire.yaml"
    recipe.write_text(json.dumps(
        {"source": source, "timeline": {"frames": 10, "fps": 24}, "flakes": "none"}
    ))  # fmt: skip
    assert main(["build", str(recipe), "-o", str(tmp_path / "out")]) == 0
    said = " ".join(capsys.readouterr().err.split())
    assert "lower edge; use less source.radius or fuel_rate, or another aspect" in said


@pytest.mark.parametrize("name", ["campfire", "steam", "explosion"])
def test_smoke_and_what_burns_are_as_large_as_the_frame(name: str) -> None:
    """Also below the ground, where the gas ends."""
    view = fire(4, fire=name, smoke=0.3, radius=0.2)
    assert view.burning is not None
    assert view.smoke(1).shape == view.burning(1).shape == view.frame(1).shape[:2]


def test_a_view_from_the_back_is_the_mirror_image_of_light_without_smoke() -> None:
    view = fire()
    back = view.seen_by(fluid_camera(FluidSource.model_validate(SMALL), 180, 0))
    ahead, behind = view.frame(5)[..., :3], back.frame(5)[:, ::-1, :3]
    assert np.abs(ahead - behind).mean() < 0.3 * ahead.mean()


def test_fire_lies_where_it_is_seen_from_the_side() -> None:
    view = fire(burners=[{"at": [0, -0.15, 0], "size": 0.12}])
    lit = np.argwhere(view.frame(8)[..., 3] > 0.5).mean(axis=0)
    depth = view.fire_depth(8, lit[1:], lit[:1], np.array([0.5]))
    assert depth == pytest.approx(0.15 * 80, abs=4)
    assert view.front_surface(8).depth[int(lit[0]), int(lit[1])] > 4


BAD: dict[str, tuple[dict[str, Any], dict[str, Any], str]] = {
    "a small burner": (
        {"radius": 0.02},
        {},
        "source.radius: makes a burner 0.0192 heights wide, which is 0.49 cubes at resolution: 22",
    ),
    "a burner outside": (
        {"burners": [{"at": [2, 0, 0]}]},
        {},
        "source.burners.0: places a burner at [2.0, 0.0, 0.0] heights, outside of the box",
    ),
    "a fast jet": (
        {"fire": "flamethrower", "radius": 0.1, "speed": 15, "resolution": 160},
        {"timeline": {"fps": 8}},
        "source.speed: lets gas leave at 15 heights/s",
    ),
    "a large box": (
        {"resolution": 160, "width": 64, "height": 256},
        {},
        "source.resolution: 160 makes a box of",
    ),
    "nothing to see": (
        {"fuel_rate": 0, "smoke": 0},
        {},
        "source.fuel_rate: nothing is to be seen of a campfire without fuel and smoke",
    ),
    "no such fire": (
        {"fire": "candel"},
        {},
        "source.fire: must be one of campfire, torch, flamethrower",
    ),
    "no direction": ({"direction": [0, 0, 0]}, {}, "[0, 0, 1] is up"),
    "radius beside burners": (
        {"radius": 0.2, "burners": [{"size": 0.2}]},
        {},
        "burners state sizes of their own: remove radius, or burners",
    ),
    "back in time": ({"burning": [2, 1]}, {}, "the first number must not exceed the second"),
    "levels of wind": ({}, {"wind": {"levels": [0, 2]}}, "wind.levels: gas that burns has no"),
    "a crossfade": ({}, {"timeline": {"loop": "crossfade"}}, "timeline.loop: crossfade joins"),
}


@pytest.mark.parametrize("name", BAD)
def test_check_refuses_what_cannot_be_simulated(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    keys, others, message = BAD[name]
    path = tmp_path / "fire.yaml"
    path.write_text(json.dumps({"source": SMALL | keys, **others}), encoding="utf-8")
    assert main(["check", str(path)]) == 2
    said = capsys.readouterr().err
    assert message in said and "Traceback" not in said


def test_a_build_writes_flakes_and_maps_and_says_that_it_plays_once(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "boom.yaml"
    document = {
        "source": {"kind": "fluid", "resolution": 20, "width": 48, "height": 48, **BOOM},
        "timeline": {"frames": 10},
        "maps": {"smoke": True, "normals": True, "depth": True},
        "views": {"count": 2},
    }
    path.write_text(json.dumps(document), encoding="utf-8")
    assert main(["build", str(path), "-o", str(tmp_path / "one"), "--jobs", "1"]) == 0
    assert "plays once, as source.fire: explosion begins and ends" in capsys.readouterr().err
    assert main(["build", str(path), "-q", "-o", str(tmp_path / "two"), "--jobs", "3"]) == 0
    one, two = (
        {file.name: file.read_bytes() for file in (tmp_path / name).iterdir()}
        for name in ("one", "two")
    )
    assert one == two
    assert {"boom.png", "boom.smoke.png", "boom.normals.png", "boom.depth.png"} <= one.keys()
    tracks = json.loads(one["boom.view_0.flakes.json"])
    assert tracks["loop"] is False and tracks["frame_count"] == 10


def test_steam_hides_as_much_as_is_drawn_of_it() -> None:
    view = fire(fire="steam")
    for index in (3, 7):
        drawn = view.frame(index)[..., 3]
        assert drawn.max() > 0.3
        # Smoke is worn at its edges by the px when it is drawn, by the cube when it hides.
        difference = np.abs(view.smoke(index) - drawn)
        assert difference.max() < 0.06 and difference.mean() < 0.005


@pytest.mark.parametrize("name", ["campfire", "explosion"])
def test_frames_are_kept_while_the_rest_is_simulated(name: str) -> None:
    """All but those at a loop's end that may be led to its beginning, and one before them."""
    source = FluidSource.model_validate(SMALL | {"fire": name, "radius": 0.2})
    scene = build_scene(source, GenerationSettings(1, Wind(), 12, 24.0, True, Views()))
    simulated_by, counted = list[int](), [0]

    def count() -> None:
        counted[0] += 1

    with Workers(2) as workers:
        record(scene, workers, lambda _: simulated_by.append(counted[0]), count)
    free = 12 - (scene.overlap + 1 if scene.overlap else 0)
    assert simulated_by[:free] == [scene.settling + k for k in range(free)]
    assert simulated_by[free:] == [scene.settling + 12] * (12 - free)


def test_a_simulation_that_breaks_ends_the_drawing_that_waits_for_memory(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def broken(
        scene: Scene, jobs: int, keep: Callable[[Volume], None], count: Callable[[], None]
    ) -> None:
        for _ in range(4):
            keep(Volume.of(scene.grid.zeros(4)))
        raise RecipeError("it broke", key=("source",))

    monkeypatch.setattr(Memory, "at_once_while_simulating", 0)
    monkeypatch.setattr(fluid, "record_apart", broken)
    settings = GenerationSettings(1, Wind(), 12, 24.0, True, Views())
    with Workers(3) as workers, pytest.raises(RecipeError, match="it broke"):
        fluid.open_fluid(
            FluidSource.model_validate(SMALL), settings, OpeningContext("srgb", workers)
        )

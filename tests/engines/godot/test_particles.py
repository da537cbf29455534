"""Particles of Godot, which the game moves, are born, shine and last as the tracks state."""

import json
import shutil
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from fire_atlas.cli import main
from fire_atlas.core.shipped import shipped
from fire_atlas.effect.flakes.tracks import COLUMNS, SPAWN_COLUMNS, Tracks
from fire_atlas.engines.godot.particles import particle_settings
from tests.support.godot4 import Godot4, picture

SIZE = (320, 320)
ROW = dict.fromkeys(COLUMNS, 0.0) | {
    "size": 4.0, "stretch": 1.5, "r": 1.0, "g": 0.5, "a": 0.5, "life": 2.0, "tail": 0.5,
}  # fmt: skip
SIDE, STEP, PICTURES = 3, 0.1, 75
"""Side of the squares that are watched one by one, px; time between pictures, s; their number."""


def test_particles_of_the_engine_are_as_the_tracks_state(godot4: Godot4, tmp_path: Path) -> None:
    recipe = tmp_path / "fire.yaml"
    source = {"path": str(shipped("samples") / "campfire"), "height": 120, "fps": 24}
    recipe.write_text(json.dumps({
        "source": source, "flakes": {"bake": False}, "tracks": ["json"], "exports": ["godot"],
    }))  # fmt: skip
    assert main(["build", "-q", str(recipe), "-o", str(tmp_path)]) == 0
    shutil.copy(Path(__file__).with_name("particles.gd"), tmp_path)
    job = {"do": "ask", "script": "res://particles.gd", "scene": "res://fire_particles.tscn"}
    watched, crowd = godot4.run(
        tmp_path,
        [{**job, "seconds": STEP, "count": PICTURES, "side": SIDE},
         {**job, "seconds": STEP, "count": 2, "side": 1, "amount": 4000}],
        SIZE,
    )  # fmt: skip

    tracks = json.loads((tmp_path / "fire.flakes.json").read_text())
    column = {name: i for i, name in enumerate(tracks["columns"])}
    rows = np.concatenate([frame["rows"] for frame in tracks["frames"]])
    spawns = tracks["spawns"]
    duration = tracks["frame_count"] / tracks["fps"]
    assert max(spawn["life"] for spawn in spawns) < duration, "so that an id is a flight"
    rate = len(spawns) / duration
    born, lives = lives_of([set(places(picture(answer))) for answer in watched])
    assert len(born) / (PICTURES * STEP) == pytest.approx(rate, rel=0.1)
    assert np.median(lives) == pytest.approx(np.median([s["life"] for s in spawns]), rel=0.15)

    sizes = told(picture(crowd[2]))[:, 0] * 16
    assert np.median(sizes) == pytest.approx(np.median([s["size"] for s in spawns]), rel=0.1)
    shown = np.concatenate([told(picture(answer)) for answer in crowd[:2]])
    light = rows[:, [column[name] for name in "rgb"]] * rows[:, [column["a"]]]
    age = np.floor(rows[:, column["age"]] / rows[:, column["life"]] * 5)
    mean = np.mean([light[age == k].mean(axis=0) for k in range(5)], axis=0)
    assert (shown / (1 - shown)).mean(axis=0)[:2] == pytest.approx(mean[:2], rel=0.1)


def told(image: NDArray[np.uint8]) -> NDArray[np.float64]:
    """Return what each px of a particle tells, 0..1: (px, 3). The ground is blue."""
    return image[image[..., 2] < 255].astype(float) / 255


def places(image: NDArray[np.uint8]) -> Iterator[tuple[int, int]]:
    """Yield the corner of every square that touches no other."""
    lit = (image[..., 2] < 255).astype(np.uint8)
    _, _, found, _ = cv2.connectedComponentsWithStats(lit)
    for x, y, _, _, area in found[1:].tolist():
        if area == SIDE * SIDE:
            yield x, y


def lives_of(
    pictures: list[set[tuple[int, int]]],
) -> tuple[list[tuple[int, int]], list[float]]:
    """Return the particles that were born in a series of pictures, and the lives, s, of those born
    so early that all have ended."""
    seen = Counter(place for each in pictures for place in each)
    first = {place: i for i, each in reversed([*enumerate(pictures)]) for place in each}
    born = [place for place, i in first.items() if i > 0]
    return born, [seen[place] * STEP for place in born if first[place] < len(pictures) - 25]


def thrown(count: int, gravity: tuple[float, float], seconds: float, *, hard: bool) -> Tracks:
    """Return tracks of sparks born together that fly up at 100 px/s, each 10 px beside another."""
    frames = []
    for i in range(round(seconds * 24)):
        rows = np.tile([dict(ROW, age=i / 24)[name] for name in COLUMNS], (count, 1))
        rows[:, 0] = np.arange(count)
        rows[:, 1] = 10 * np.arange(count) + gravity[0] * (i / 24) ** 2 / 2
        rows[:, 2] = 200 - 100 * i / 24 + gravity[1] * (i / 24) ** 2 / 2
        rows[:, 3:5] = gravity[0] * i / 24, -100 + gravity[1] * i / 24
        frames.append(rows)
    spawns = np.ones((count, len(SPAWN_COLUMNS)))
    spawns[:, 0] = np.arange(count)
    return Tracks.one_shot(24, (200, 200), 0, spawns, frames, hard)


def test_flights_of_a_throw_give_its_settings() -> None:
    made = particle_settings(thrown(11, (30, 60), 0.5, hard=False), (100, 200))
    assert made is not None
    timing, motion, look = made.timing, made.motion, made.look
    assert timing.one_shot and (timing.amount, timing.amount_ratio) == (11, 1)
    assert (timing.lifetime, timing.lifetime_randomness) == (2.0, 0)
    assert timing.explosiveness == pytest.approx(1 - 1 / 48)
    assert motion.gravity == pytest.approx((30, 60))
    assert motion.speeds == pytest.approx((100, 100))
    assert motion.centre == pytest.approx((-50, 0)) and motion.extents == pytest.approx((50, 0))
    assert motion.direction[1] < -0.98 and motion.spread < 1
    assert look.sizes == (4, 4) and look.stretch == 1.5 and look.tail == 0.5
    assert look.colours[0] == pytest.approx([0.5, 0.25, 0.0])
    assert look.brightness == pytest.approx(np.ones(8))


def test_squares_stay_squares_and_without_flakes_there_is_nothing() -> None:
    squares = particle_settings(thrown(3, (0, 0), 0.2, hard=True), (0, 0))
    assert squares is not None and (squares.look.stretch, squares.look.tail) == (1, -1)
    empty = thrown(0, (0, 0), 0.2, hard=False)
    assert particle_settings(empty, (0, 0)) is None

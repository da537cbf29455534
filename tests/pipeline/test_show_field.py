"""Marks of the analysis: of a clip whose motion is known."""

import json
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image
from scipy import ndimage

from fire_atlas.cli import main
from fire_atlas.core.context import BuildContext
from fire_atlas.core.workers import Workers
from fire_atlas.pipeline.animation.show_field import field_marks
from fire_atlas.pipeline.input.check import load_checked
from fire_atlas.preview.field_marks import FieldLayer, FieldMarks, MarkGrid, Marks
from fire_atlas.recipe.tree import read_tree
from tests.support.wind import SILK
from tests.support.wind import recipe_in as in_winds

WIDTH, HEIGHT, COUNT, FPS = 96, 64, 10, 24
STEP = 3
"""How far the fire moves from frame to frame, px."""

N = 2.0
"""Exponent of κ."""


class Moving(NamedTuple):
    """A fire that moves sideways, inspected."""

    way: int
    seen: FieldMarks
    frames: list[NDArray[np.float64]]

    def centre(self, i: int) -> float:
        """x of its centre in frame ``i``, px."""
        return WIDTH / 2 + self.way * STEP * (i - COUNT / 2)


def fire_at(x: float) -> NDArray[np.uint8]:
    """Return a grey picture of a textured ball of fire with its centre at ``x``."""
    rows, columns = np.mgrid[:HEIGHT, :WIDTH] + 0.5
    ball = np.clip((15 - np.hypot(columns - x, rows - HEIGHT / 2)) / 3, 0, 1)
    texture = 0.75 + 0.25 * np.sin((columns - x) / 2.2) * np.sin(rows / 2.7)
    return np.asarray(np.rint(255 * ball * texture), np.uint8)


def recipe_in(folder: Path, way: int) -> Path:
    """Write a recipe for a fire that moves right (1) or left (-1), by the paper's constants."""
    (folder / "clip").mkdir(parents=True)
    for i in range(COUNT):
        grey = fire_at(WIDTH / 2 + way * STEP * (i - COUNT / 2))
        Image.fromarray(np.dstack([grey] * 3)).save(folder / "clip" / f"{i:02}.png")
    recipe = folder / "ball.yaml"
    recipe.write_text(
        json.dumps({
            "source": {"path": "clip", "fps": FPS, "matte": "luminance"},
            "timeline": {"loop": "none"},
            "features": {"preset": "paper", "n": N},
            # Towards where it moves, but too weak to move anything.
            "buoyancy": {"motion": "flow", "feature_force": "auto", "lift": [way * 1e-6, 0]},
        }),
        encoding="utf-8",
    )  # fmt: skip
    return recipe


@pytest.fixture(scope="module", params=[1, -1], ids=["right", "left"])
def moving(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Moving:
    way: int = request.param
    recipe = recipe_in(tmp_path_factory.mktemp("moving"), way)
    with Workers(2) as workers:
        loaded = load_checked(read_tree(recipe))
        (seen,) = field_marks(loaded, BuildContext.silent(workers)).values()
    files = sorted((recipe.parent / "clip").iterdir())
    frames = []
    for file in files:
        with Image.open(file) as image:
            frames.append(np.asarray(image.convert("L"), np.float64))
    return Moving(way, seen, frames)


def inside(moving: Moving, i: int, layer: FieldLayer) -> NDArray[np.float32]:
    """Return the arrows of a layer that begin well within the fire."""
    arrows = moving.seen.frames[i][layer]
    near = np.hypot(arrows[:, 0] - moving.centre(i), arrows[:, 1] - HEIGHT / 2) < 11
    return np.asarray(arrows[near])


@pytest.mark.parametrize("i", [3, 6])
def test_arrows_of_field_and_force_point_where_the_fire_moves(moving: Moving, i: int) -> None:
    field = np.median(inside(moving, i, "field")[:, 2:], axis=0)
    assert field[0] == pytest.approx(moving.way * STEP * FPS, rel=0.08)
    assert abs(field[1]) < 2
    force = np.median(inside(moving, i, "force")[:, 2:], axis=0)
    assert force[0] * moving.way > 50 * abs(force[1])


def expected_features(moving: Moving, i: int) -> NDArray[np.float64]:
    """Return Fv* (H, W, 2) of eq. 1-3 as printed, with ε = 40 and β = 0.02, by SciPy alone."""
    y, x = np.mgrid[-8:9, -8:9]
    narrow, wide = (np.exp(-(x**2 + y**2) / (2 * s * s)) / s for s in (1.0, 1.6))
    printed = (narrow - wide) / np.sqrt(2 * np.pi)
    edges = ndimage.correlate(moving.frames[i], printed, mode="nearest")
    slope = np.stack([ndimage.sobel(edges, axis=a, mode="nearest") for a in (1, 0)], -1)
    along = np.arange(WIDTH) / (WIDTH - 1)
    kappa = (along if moving.way > 0 else 1 - along) ** N
    strong = np.hypot(*np.moveaxis(slope, -1, 0)) > 40
    vectors = slope * (kappa * strong)[..., None]
    length = np.hypot(*np.moveaxis(vectors, -1, 0))
    return np.asarray(vectors + 0.02 * length[..., None] * np.array([moving.way, 0]))


@pytest.mark.parametrize("i", [3, 6])
def test_arrows_of_features_are_the_papers_vectors_where_they_stand(moving: Moving, i: int) -> None:
    arrows, expected = moving.seen.frames[i]["features"], expected_features(moving, i)
    column, row = (np.floor(arrows[:, k]).astype(int) for k in (0, 1))
    longest = np.abs(expected).max()
    assert np.abs(arrows[:, 2:] - expected[row, column]).max() < 0.05 * longest
    ahead = (arrows[:, 0] - moving.centre(i)) * moving.way
    length = np.hypot(arrows[:, 2], arrows[:, 3])
    assert length[ahead > 5].mean() > 2 * length[ahead < -5].mean(), "κ grows to the front"


@pytest.mark.parametrize("i", [3, 6])
def test_candidates_lie_where_the_vectors_exceed_alpha(moving: Moving, i: int) -> None:
    dots = moving.seen.frames[i]["candidates"]
    assert moving.seen.grid.block == 1
    weight = np.zeros((HEIGHT, WIDTH))
    weight[np.floor(dots[:, 1]).astype(int), np.floor(dots[:, 0]).astype(int)] = dots[:, 2]
    expected = np.hypot(*np.moveaxis(expected_features(moving, i), -1, 0))
    alike = (weight > 0) == (expected > 0.03)
    # ε cuts off at a slope of 40, which the two filters round differently.
    assert (weight > 0).sum() > 100 and (~alike).sum() <= 0.02 * (weight > 0).sum()
    assert set(dots[:, 2]) == {1.0}, "all candidates are alike"


def test_blur_is_the_fields_path_while_the_shutter_is_open(moving: Moving) -> None:
    frame = moving.seen.frames[5]
    blur, field = frame["blur"], frame["field"]
    assert np.array_equal(blur[:, :2], field[:, :2])
    along = (field[:, 0] - 0.5) / (WIDTH - 1)
    kappa = (along if moving.way > 0 else 1 - along) ** N
    shutter = 1  # of the preset
    expected = field[:, 2] * kappa * shutter / FPS
    assert np.abs(blur[:, 2] - expected).max() < 0.02 * np.abs(expected).max()


def test_of_vectors_that_cancel_the_strongest_is_shown() -> None:
    x = np.zeros((8, 8), np.float32)
    x[2, 3], x[2, 4], x[6, 6] = -5, 4, 1
    marks = MarkGrid(4, 1).strongest(x, np.zeros_like(x), (8, 16))
    assert marks.tolist() == [[11.5, 18.5, -5, 0], [12.5, 18.5, 4, 0], [14.5, 22.5, 1, 0]]


def test_candidates_that_share_a_square_are_one_dot() -> None:
    places = np.array([0, 1, 5]), np.array([0, 0, 3])
    dots = MarkGrid(4, 2).dots(*places, np.array([1.0, 3.0, 2.0]))
    assert dots.tolist() == [[1.25, 0.5, 4.0], [5.5, 3.5, 2.0]]


def test_the_longest_mark_is_that_of_the_whole_clip() -> None:
    frames: list[dict[FieldLayer, Marks]] = [
        {"field": np.array([[0, 0, 3 * k, 4 * k]], np.float32)} for k in (1, 2)
    ]
    longest = FieldMarks.of(MarkGrid(4, 1), frames).longest
    assert longest["field"] == pytest.approx(10, rel=0.02)


def test_each_loop_of_a_fire_in_several_winds_has_the_field_of_its_wind(tmp_path: Path) -> None:
    keys = {"wind": {"levels": [0, 4], "direction": "right"}, "timeline": {"frames": 6}}
    recipe = in_winds(tmp_path, {**SILK, **keys})
    with Workers(1) as workers:
        found = field_marks(load_checked(read_tree(recipe)), BuildContext.silent(workers))
    assert list(found) == ["wind_0", "wind_1"]
    calm, windy = (
        np.mean([frame["field"][:, 2].mean() for frame in marks.frames]) for marks in found.values()
    )
    # A level is 0.15 frame heights per second; drag pulls the air towards that.
    assert 0.5 < (windy - calm) / (4 * 0.15 * SILK["source"]["height"]) < 1.5


def test_a_recipe_without_the_effect_is_refused_with_advice(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Image.new("RGBA", (8, 8)).save(tmp_path / "a.png")
    recipe = tmp_path / "plain.yaml"
    recipe.write_text("source: {path: a.png}\nflakes: none\nmotion_blur: none\n")
    assert main(["preview", "--field", str(recipe)]) == 2
    assert "take out flakes: none or motion_blur: none" in capsys.readouterr().err
    assert {path.name for path in tmp_path.iterdir()} == {"a.png", "plain.yaml"}

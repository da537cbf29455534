"""Haze: how hot air shifts what is seen through it, in known fields and in whole builds."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fire_atlas.core.pixels import Plane, magnitude
from fire_atlas.core.shipped import shipped
from fire_atlas.effect.field.hot_air import thinness
from fire_atlas.effect.field.record import FieldRecord
from fire_atlas.maps.haze import Haze, haze_of
from tests.support.hazes import HazePage
from tests.support.repo import Repo, pages

ROWS, COLUMNS, CELL, FRAMES = 40, 30, 4, 48
KAPPA = np.ones((ROWS * CELL, COLUMNS * CELL), np.float32)


def haze(heat: np.ndarray[Any, Any], kappa: Plane = KAPPA, seed: int = 1) -> Haze:
    """Return the haze of a loop in which air of constant heat (rows, columns) rises by 100 px/s."""
    record = FieldRecord.empty(FRAMES, (ROWS, COLUMNS), CELL, 24, True, has_heat=True)
    assert record.heat is not None
    record.heat[:] = heat
    record.v[:] = -100
    return haze_of(thinness(record, len(kappa), seed), kappa, CELL)


def column() -> np.ndarray[Any, Any]:
    x = np.arange(COLUMNS) - (COLUMNS - 1) / 2
    return np.broadcast_to(np.exp(-((x / 4) ** 2)), (ROWS, COLUMNS))


def test_a_hot_column_spreads_what_is_behind_it_as_a_thin_lens_does() -> None:
    """Its axis is seen where it is; the sides are seen from further out, where air is denser."""
    cells = np.stack(haze(column()).cells).astype(np.float32)
    across = cells[:, 10:30, :, 0].mean(axis=(0, 1))
    left, right = across[8:14], across[16:22]
    assert (left < 0).all() and (right > 0).all()
    assert abs(across[14:16].mean()) < 0.2 * right.max()
    density = 1 / (1 + 3 * column()[0])
    wanted = np.gradient(density) / CELL * len(KAPPA) ** 2 * 7e-4
    assert across[6:24] == pytest.approx(wanted[6:24], abs=0.3 * float(wanted.max()))


def test_cold_air_and_the_ground_beneath_a_fire_stay_as_they_are() -> None:
    cold = haze(np.zeros((ROWS, COLUMNS)))
    assert not np.stack(cold.cells).any() and cold.seen(0) is None
    kappa = np.ones_like(KAPPA)
    kappa[80:] = 0
    (first, *_) = haze(column(), kappa).cells
    assert first[:20].any() and not first[20:].any()


def test_eddies_rise_with_the_air_and_the_loop_closes() -> None:
    cells = np.stack(haze(column()).cells).astype(np.float32)
    vertical = cells[:, :, 10:20, 1]  # the column itself bends nothing up or down
    steps = np.abs(np.roll(vertical, -1, axis=0) - vertical).mean(axis=(1, 2))
    assert 0.8 < steps[-1] / np.median(steps[:-1]) < 1.25
    # 100 px/s are about one cell a frame.
    risen = np.abs(vertical[1:, 8:29] - vertical[:-1, 9:30]).mean()
    still = np.abs(vertical[1:, 8:29] - vertical[:-1, 8:29]).mean()
    assert risen < 0.6 * still
    other = haze(column(), seed=2).cells[0]
    assert not np.array_equal(other, haze(column()).cells[0])


@pytest.fixture
def repo(tmp_path: Path) -> Repo:
    return Repo(tmp_path / "repo")


RECIPE: dict[str, Any] = {
    "source": {"path": str(shipped("samples") / "campfire"), "fps": 24, "height": 120},
    "maps": {"haze": True},
}


def test_pages_have_room_for_the_haze_and_the_fire_is_as_it_was(repo: Repo) -> None:
    settings = {**RECIPE, "flakes": "none", "timeline": {"fps": 12}}
    repo.built(repo.recipe("fire.yaml", **settings))
    page = HazePage.read(repo.build)
    length = [magnitude(*np.moveaxis(page.of(i), 2, 0)) for i in range(len(page.frames))]
    above = [each["spriteSourceSize"]["y"] for each in page.frames]
    assert max(above) < 12, "up to where haze fades at the frame's border"
    assert max(each.max() for each in length) > 0.8
    assert page.entry["scale"] >= max(page.entry["reach"]) - 0.0005, "rounded"
    for each in length:  # where a frame was cut off, nothing is seen to be missing
        assert each[:2].max() < 0.25 and each[-8:].max() < 0.05
    repo.built(repo.recipe("plain.yaml", **{**settings, "maps": {}}))
    for i, (one, other) in enumerate(zip(frames(repo, "fire"), frames(repo, "plain"), strict=True)):
        assert np.array_equal(one, other), i


def frames(repo: Repo, name: str) -> list[np.ndarray[Any, Any]]:
    """Return the whole frames of an atlas of one page."""
    ((atlas, page),) = pages(repo.build, name)
    whole = []
    for entry in atlas["frames"].values():
        place, trim, size = (entry[k] for k in ("frame", "spriteSourceSize", "sourceSize"))
        frame = np.zeros((size["h"], size["w"], 4), np.uint8)
        frame[trim["y"] : trim["y"] + trim["h"], trim["x"] : trim["x"] + trim["w"]] = page[
            place["y"] : place["y"] + place["h"], place["x"] : place["x"] + place["w"]
        ]
        whole.append(frame)
    return whole


@pytest.mark.parametrize(
    "atlas", [{"layout": "grid", "padding": 4}, {"scales": [1, 0.5]}, {"extrude": 2}]
)
def test_every_layout_has_the_same_haze(repo: Repo, atlas: dict[str, Any]) -> None:
    settings = {**RECIPE, "flakes": "none", "timeline": {"fps": 12}}
    repo.built(repo.recipe("fire.yaml", **settings))
    wanted = HazePage.read(repo.build)
    repo.built(repo.recipe("fire.yaml", **settings, atlas=atlas))
    page, step = HazePage.read(repo.build), wanted.entry["scale"] / 127
    for i in (0, 7):
        both = (wanted.of(i) != 0) & (page.of(i) != 0)
        assert np.abs(page.of(i) - wanted.of(i))[both].max() <= 1.01 * step
    if "scales" in atlas:
        half = HazePage.read(repo.build, "fire@0.5x")
        assert half.entry["scale"] == pytest.approx(page.entry["scale"] / 2, rel=0.01)


def test_views_and_winds_have_haze_too_and_it_is_the_same_at_any_number_of_workers(
    repo: Repo,
) -> None:
    silk = {"kind": "silk", "width": 48, "height": 64, "rows": 10, "columns": 8}
    recipe = repo.recipe("views.yaml", source=silk, views={"count": 2}, timeline={"frames": 6},
                         maps={"haze": True}, flakes={"rate": 20})  # fmt: skip
    once = repo.built(recipe, "--jobs", "1")
    assert once == repo.built(recipe, "--jobs", "2", "--force")
    assert all(page_has_haze(repo, "views", i) for i in (0, 6))
    winds = repo.recipe("winds.yaml", source=silk, wind={"levels": [0, 3]}, timeline={"frames": 6},
                        maps={"haze": True}, flakes="none")  # fmt: skip
    repo.built(winds)
    assert all(page_has_haze(repo, "winds", i) for i in range(0, 12, 3))


def page_has_haze(repo: Repo, name: str, i: int) -> bool:
    return bool(HazePage.read(repo.build, name).of(i).any())


def test_sprites_have_no_haze_and_rotated_frames_no_vectors(repo: Repo) -> None:
    repo.clip(4)
    haze: dict[str, Any] = {"maps": {"haze": True}}
    ran = repo.run("build", repo.recipe(source={"kind": "sprites", "path": "clip"}, **haze))
    assert ran.code == 2 and "fire.yaml:1: maps" in ran.err
    ran = repo.run("check", repo.recipe(**haze, flakes="none", atlas={"rotate": True}))
    assert ran.code == 2 and "maps.haze" in ran.err and "atlas.rotate" in ran.err


def test_a_scene_that_hides_its_haze_is_noted(repo: Repo) -> None:
    chance = np.random.default_rng(4)
    wall = chance.integers(60, 90, (60, 80, 3)).astype(np.uint8)
    images = []
    for i in range(8):
        image = wall.copy()
        image[20 - i % 4 * 3 : 55, 30 : 45 + i % 3] = (255, 180, 60)
        images.append(image)
    repo.frames(images)
    ran = repo.run("build", repo.recipe(maps={"haze": True}, flakes="none"))
    assert ran.code == 0 and "maps.haze: the clip is an opaque scene" in ran.err
    ran = repo.run("build", repo.recipe("fire.yaml", **RECIPE, timeline={"fps": 12}))
    assert "opaque scene" not in ran.err


def test_inspect_prints_its_strength(repo: Repo) -> None:
    repo.built(repo.recipe("fire.yaml", **RECIPE, timeline={"fps": 12}))
    scale = json.loads((repo.build / "fire.json").read_text())["meta"]["maps"][0]["scale"]
    ran = repo.run("inspect", repo.build / "fire.json")
    assert "haze" in ran.out and f"{scale:g} px" in ran.out

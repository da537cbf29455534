"""The slider of the preview page changes the wind of a fire, in a real browser."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fire_atlas.cli import main
from fire_atlas.preview.blend import blend
from tests.preview.browser import Browser, assert_quiet, picture, previewed, watch
from tests.support.graph import Place
from tests.support.wind import LEVELS, SILK, Walker, recipe_in

LOOK = ("look",)
GRAPH = (
    "run",
    """[
  document.getElementById("graph").getAttribute("aria-label"),
  document.querySelector("#graph .wanted").textContent.trim(),
  document.querySelectorAll("#graph .now").length,
]""",
)
SHOWN = "document.getElementById('caption').textContent.split(' ')[0]"


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    # With this seed a loop is left later than at its first frame, which is passed at once.
    recipe = recipe_in(tmp_path_factory.mktemp("wind"), SILK, seed=2)
    assert main(["build", str(recipe), "-q", "--jobs", "1"]) == 0
    return previewed(recipe.parent / "build" / "fire.json")


@pytest.fixture(scope="module")
def walker(page: Path) -> Walker:
    return Walker.of(page.with_name("fire.json"))


def place_of(caption: str) -> Place:
    _, name, number = caption.split(" ")[0].split("/")
    return name, int(number)


def set_wind(level: int) -> tuple[tuple[Any, ...], ...]:
    """Return the steps that move the slider to a level, by key."""
    on = [("press", "ArrowRight")] * level
    return ("run", "document.getElementById('wind').focus()"), ("press", "Home"), *on


def test_twenty_random_moves_of_the_slider_show_what_a_game_shows(
    browser: Browser, page: Path, walker: Walker
) -> None:
    chance = np.random.default_rng(5)
    moves = list(zip(chance.integers(0, len(LEVELS), 20), chance.integers(5, 80, 20), strict=True))
    steps: list[tuple[Any, ...]] = []
    for level, count in moves:
        step = f"(document.getElementById('on').click(), {SHOWN})"
        walk = f"Array.from({{length: {count}}}, () => {step})"
        steps += [*set_wind(int(level)), ("run", walk), ("pixels", "#picture"), LOOK, GRAPH]
    seen = browser.visit(page, *steps)
    assert_quiet(seen, page)
    results = [each for each in seen.results if each is not None]
    now, visited = ("wind_0", 0), set[str]()
    for i, (level, count) in enumerate(moves):
        frames, drawn, look, graph = results[4 * i : 4 * i + 4]
        wanted = []
        for _ in range(count):
            now = walker.after(now, int(level))
            wanted.append(now)
            visited.add(now[0])
        assert [place_of(frame) for frame in frames] == wanted
        expected = blend(walker.cuts[now], (16, 16, 20), "straight", "srgb")
        assert np.abs(picture(drawn)[..., :3].astype(int) - expected).max() <= 2
        assert look["label"] == f"{now[0]}, frame {now[1] + 1} of {walker.count(now[0])}"
        winds = [str(LEVELS[int(number)]) for number in now[0].split("_")[1:]]
        assert graph == [f"0, 2, 5; now: {' to '.join(winds)}", str(LEVELS[level]), 1]
    assert visited == {state.animation for state in walker.graph.states}


def test_it_plays_through_all_winds_in_between(
    browser: Browser, page: Path, walker: Walker
) -> None:
    until = "caption.includes('/wind_2/') || passed > 30000"
    seen = browser.visit(page, *set_wind(2), watch(until), moves=True)
    assert_quiet(seen, page)
    began, _, first = seen.results[-1][0]
    now, passed = place_of(first), 0
    names = [now[0]]
    for time, _, caption in seen.results[-1]:
        frames = (time - began) * walker.atlas.sheet.fps / 1000
        while passed < frames - 1.01 or (now != place_of(caption) and passed < frames):
            now = walker.after(now, 2)
            passed += 1
            names += [now[0]] if now[0] != names[-1] else []
        assert now == place_of(caption)
    assert set(names) <= {"wind_0", "wind_0_1", "wind_1", "wind_1_2", "wind_2"}
    assert len(names) > 2 and names[-1] == "wind_2"


def test_frames_pass_into_the_next_animation_where_the_fire_goes_on_there(
    browser: Browser, page: Path, walker: Walker
) -> None:
    [way] = [each for each in walker.graph.transitions if each.before == "wind_0"]
    seen = browser.visit(
        page, ("click", "[name=between][value=blend]"), *set_wind(1),
        *[("press", "Tab")], *[("click", "#on")] * way.frame, ("press", "."),
        ("pixels", "#picture"), LOOK, ("press", "."), LOOK,
    )  # fmt: skip
    assert_quiet(seen, page)
    drawn, half, entered = seen.results[-3:]
    leaving, entry = ("wind_0", way.frame), (way.after, way.entry)
    weighed = []
    for place in (leaving, entry):
        pixel = walker.cuts[place].astype(float) / 255
        weighed.append(np.dstack([pixel[..., :3] * pixel[..., 3:], pixel[..., 3:]]))
    mixed = (weighed[0] + weighed[1]) / 2
    ground = np.array([16, 16, 20]) / 255
    expected = 255 * (mixed[..., :3] + ground * (1 - mixed[..., 3:]))
    assert np.abs(picture(drawn)[..., :3] - expected).max() <= 2
    assert half["label"].startswith(f"wind_0, between frames {way.frame + 1} and 1 of wind_0_1")
    assert entered["label"].startswith("wind_0_1, frame 1 of")


def test_a_key_sets_the_next_wind(browser: Browser, page: Path) -> None:
    level = ("run", "document.getElementById('level').textContent")
    seen = browser.visit(page, *[("press", "w"), level] * 3, LOOK)
    assert_quiet(seen, page)
    *levels, look = [each for each in seen.results if each is not None]
    assert levels == ["2", "5", "0"], "after the strongest comes the weakest"
    assert look["said"] == "wind 0"


def test_the_slider_follows_a_chosen_animation(browser: Browser, page: Path) -> None:
    choose = """(name) => {
      const list = document.getElementById("animation");
      list.value = [...list.options].find((each) => each.text === name).value;
      list.dispatchEvent(new Event("change"));
      return document.getElementById("level").textContent;
    }"""
    names = ["wind_2", "wind_2_1", "wind_0", "wind_0_1"]
    seen = browser.visit(page, *[("run", f"({choose})({name!r})") for name in names])
    assert_quiet(seen, page)
    assert seen.results == ["5", "2", "0", "2"]

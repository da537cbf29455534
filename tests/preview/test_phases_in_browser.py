"""The preview page lights a fire and puts it out, in a real browser."""

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image, ImageSequence

from fire_atlas.cli import main
from fire_atlas.formats.tracks.tracks_json import read_all_tracks
from fire_atlas.preview.blend import blend
from fire_atlas.preview.lamps import lamps_of
from tests.preview.browser import Browser, assert_quiet, built, picture, watch
from tests.support.graph import Place
from tests.support.phases import OUT, PhaseWalker

LOOK = ("look",)
PIXELS = ("pixels", "#picture")
STEP = "(document.getElementById('on').click(), document.getElementById('caption').textContent)"
STATE = """(() => {
  const text = (selector) => document.querySelector(selector).textContent.trim();
  return {
    button: text("#phase"), told: text("#phase-told"),
    now: [...document.querySelectorAll("#graph .now text")].map((each) => each.textContent),
    wanted: text("#graph .wanted text"),
    nodes: [...document.querySelectorAll("#graph text")].map((each) => each.textContent),
    label: document.getElementById("graph").getAttribute("aria-label"),
  };
})()"""
KEY, BUTTON = ("press", "e"), ("click", "#phase")
"""They do the same."""

Steps = list[tuple[Any, ...]]


@pytest.fixture(scope="module")
def page_of(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """A build of a fire that loops in 24 frames, is lit in 10 and goes out in 14."""

    def build(**phases: Any) -> Path:
        return built(
            tmp_path_factory.mktemp("phases"), count=36, tracks=["json", "light"],
            timeline={"frames": 24, "loop": "crossfade"},
            phases={"ignite": 10 / 24, "extinguish": 14 / 24, **phases},
        )  # fmt: skip

    return build


@pytest.fixture(scope="module")
def page(page_of: Callable[..., Path]) -> Path:
    return page_of()


@pytest.fixture(scope="module")
def walker(page: Path) -> PhaseWalker:
    return PhaseWalker.of(page.with_name("fire.json"))


def place_of(caption: str) -> Place:
    if caption == "nothing is drawn":
        return OUT
    _, name, number = caption.split(" ")[0].split("/")
    return name, int(number)


def walked(count: int) -> tuple[str, str]:
    """Return a step that takes as many steps of the player, and gives the captions it sees."""
    return "run", f"Array.from({{length: {count}}}, () => {STEP})"


def pressed_until(caption: str) -> tuple[str, str]:
    """Return a step that presses the button, and gives all that is seen up to a caption."""
    what, seen = watch(f"caption.includes('{caption}') || passed > 30000")
    press = "document.getElementById('phase').click()"
    return what, f"(() => {{ const seen = {seen}; {press}; return seen; }})()"


def test_twenty_random_moments_each_way_show_what_a_game_shows(
    browser: Browser, page: Path, walker: PhaseWalker
) -> None:
    counts = np.random.default_rng(1).integers(1, 32, 40).tolist()
    steps: Steps = [("click", "[name=flakes][value=marks]")]
    for i, count in enumerate(counts):
        steps += [KEY if i % 8 else BUTTON, walked(count), PIXELS, ("run", STATE), LOOK]
    seen = browser.visit(page, *steps)
    assert_quiet(seen, page)
    tracks = read_all_tracks(walker.atlas)
    now, is_lit, visited = ("burn", 0), True, set[str]()
    for i, count in enumerate(counts):
        captions, drawn, state, look = seen.results[4 * i : 4 * i + 4]
        is_lit, wanted = not is_lit, []
        for _ in range(count):
            now = walker.after(now, is_lit)
            wanted.append(now)
            visited.add(now[0])
        assert [place_of(caption) for caption in captions] == wanted
        expected = blend(walker.cuts[now], (16, 16, 20), "straight", "srgb")
        assert np.abs(picture(drawn)[..., :3].astype(int) - expected).max() <= 2
        assert look["label"] == f"{now[0]}, frame {now[1] + 1} of {walker.count(now[0])}"
        assert f" · {len(tracks[now[0]].frames[now[1]])} flakes" in look["caption"]
        assert state["now"] == [walker.phase(now)]
        assert state["label"] == f"out, ignite, burn, extinguish; now: {walker.phase(now)}"
        assert state["wanted"] == ("burn" if is_lit else "out")
        assert state["button"] == ("Put out" if is_lit else "Light")
    assert visited == {state.animation for state in walker.graph.states}


def test_it_plays_on_until_it_is_out_and_rests_there(
    browser: Browser, page: Path, walker: PhaseWalker
) -> None:
    """The page's own clock passes along the graph, and goes on when the fire is lit again."""
    last = f"fire/extinguish/{walker.end[1]:04}"
    seen = browser.visit(
        page, pressed_until(last), ("wait", 300), LOOK, ("run", STATE), pressed_until("/burn/"),
        moves=True,
    )  # fmt: skip
    assert_quiet(seen, page)
    going_out, rest, state, lit = seen.results
    for captions, is_lit in (going_out, False), (lit, True):
        now = place_of(captions[0][2])
        for _, _, caption in captions:  # a busy machine lets the page draw few of the frames
            ahead = 0
            while now != place_of(caption) and ahead < walker.atlas.sheet.fps:
                now = walker.after(now, is_lit)
                ahead += 1
            assert now == place_of(caption)
    assert place_of(going_out[-1][2]) == place_of(rest["caption"]) == walker.end
    assert rest["playing"], "the fire is out, but its viewer did not pause it"
    assert state["told"] == "is out"
    assert place_of(lit[-1][2])[0] == "burn"


def test_what_comes_next_is_told_and_said(
    browser: Browser, page: Path, walker: PhaseWalker
) -> None:
    step, key, state = walked(1), KEY, ("run", STATE)
    leaving = min(way.frame for way in walker.graph.transitions if way.before == "burn")
    seen = browser.visit(
        page, state, key, state, LOOK, key, state, key, walked(leaving + 1), state, key, state,
        walked(walker.count("extinguish") + 1), step, state, key, state, LOOK,
    )  # fmt: skip
    assert_quiet(seen, page)
    told = [each["told"] for each in seen.results if isinstance(each, dict) and "told" in each]
    assert told == [
        "burns", f"goes out after frame {leaving + 1}", "burns",
        "goes out", "goes out, then is lit", "is being lit", "is being lit, then goes out",
    ]  # fmt: skip
    said = [each["said"] for each in seen.results if isinstance(each, dict) and "said" in each]
    assert said == [f"the fire goes out after frame {leaving + 1}", f"the fire {told[-1]}"]


def test_half_steps_lead_out_and_back(browser: Browser, page: Path, walker: PhaseWalker) -> None:
    count = 2 * (walker.count("burn") + walker.count("extinguish"))
    half = """(document.body.dispatchEvent(new KeyboardEvent("keydown", {key: ".", bubbles: true})),
      document.getElementById("now").textContent)"""
    halves = "run", f"Array.from({{length: {count}}}, () => {half})"
    seen = browser.visit(page, ("click", "[name=between][value=blend]"), KEY, halves, KEY, halves)
    assert_quiet(seen, page)
    now, is_lit = ("burn", 0), True
    for positions in seen.results:
        is_lit, wanted = not is_lit, list[str]()
        while len(wanted) < count:
            following = walker.after(now, is_lit)
            between = [f"{now[1] + 1.5:.2f}"] if following != now else []
            now = following
            wanted += [*between, str(now[1] + 1)]
        assert positions == wanted[:count]


def test_a_picture_shows_how_it_is_lit_and_put_out(page: Path, walker: PhaseWalker) -> None:
    atlas = page.with_name("fire.json")
    assert main(["preview", str(atlas), "--webp", "-q"]) == 0
    shown = [
        blend(walker.cuts[name, i], (16, 16, 20), "straight", "srgb")
        for name in ("ignite", "burn", "extinguish")
        for i in range(walker.count(name))
    ]
    with Image.open(atlas.with_name("fire.preview.webp")) as picture:
        frames = [frame.convert("RGB") for frame in ImageSequence.Iterator(picture)]
    assert len(frames) == len(shown)
    for frame, expected in zip(frames, shown, strict=True):
        assert np.abs(np.asarray(frame).astype(int) - expected).mean() < 1


@pytest.mark.parametrize("has_tracks", [True, False])
def test_the_lamp_is_as_bright_in_each_animation_as_beside_the_loop(
    page: Path, tmp_path: Path, has_tracks: bool
) -> None:
    ignored = shutil.ignore_patterns(*[] if has_tracks else ["*.light.json"])
    shutil.copytree(page.parent, tmp_path / "build", ignore=ignored)
    walker = PhaseWalker.of(tmp_path / "build" / "fire.json")
    names = [animation.name for animation in walker.atlas.sheet.animations]
    lamps = dict(zip(names, map(np.array, lamps_of(walker.atlas)), strict=True))
    assert abs(lamps["burn"][:, :3].mean(axis=0).max() - 1) < 1e-3
    light = {(name, i): row[:3].max() for name in names for i, row in enumerate(lamps[name])}
    for way in walker.graph.transitions:
        ratio = light[way.after, way.entry] / light[way.before, way.frame]
        assert 0.75 < ratio < 1.33, way
    assert light[walker.end] < 0.01


NODES = ["out", "ignite", "burn", "extinguish"]
SCENE, BLACK = (("click", f"[name=backdrop][value='{which}']") for which in ("scene", "#000000"))
FLOOR = np.s_[-72:-62, 180:205]
"""A part of the floor in the scene before the fire, px, that it does not hide."""


@pytest.mark.parametrize("absent", ["none of them", "ignite", "extinguish"])
def test_a_fire_without_a_phase_passes_over_it_at_once(
    absent: str, browser: Browser, page: Path, page_of: Callable[..., Path]
) -> None:
    shown = page if absent not in NODES else page_of(**{absent: "none"})
    walker = PhaseWalker.of(shown.with_name("fire.json"))
    counts = [7, 5, 28, 9, 30, 3, 20, 28]
    steps = [step for i, n in enumerate(counts) for step in (KEY, walked(n))]
    seen = browser.visit(
        shown, ("run", STATE), BLACK, *steps, SCENE, PIXELS, BLACK, KEY, walked(30), PIXELS,
        ("run", STATE), SCENE, PIXELS,
    )  # fmt: skip
    assert_quiet(seen, shown)
    first, *captions, lit, last, black, state, dark = seen.results
    assert first["nodes"] == [node for node in NODES if node != absent]
    now, is_lit = ("burn", 0), True
    for seen_there, count in zip([*captions, last], [*counts, 30], strict=True):
        is_lit, wanted = not is_lit, []
        for _ in range(count):
            now = walker.after(now, is_lit)
            wanted.append(now)
        assert [place_of(caption) for caption in seen_there] == wanted
    assert now == walker.end and state["now"] == ["out"]
    warm, cold = (picture(each)[FLOOR][..., :3].astype(int) for each in (lit, dark))
    assert (warm[..., 0] > warm[..., 2] + 10).all() and (cold[..., 0] < cold[..., 2]).all()
    assert not picture(black)[..., :3].any(), "this fire leaves nothing that stands in it"

"""The preview page does in a real browser what it promises, opened as a file, without a network."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from fire_atlas.cli import main
from fire_atlas.core.pixels import decode_bytes, encode_bytes
from fire_atlas.core.shipped import shipped
from fire_atlas.effect.composition.composite import exposed_together
from fire_atlas.effect.flakes.drawing import draw_flakes
from fire_atlas.formats.atlas.texture_packer import read_atlas
from fire_atlas.formats.tracks.tracks_json import read_tracks, write_tracks_json
from fire_atlas.preview.blend import blend
from fire_atlas.preview.cut_frames import aligned_frames
from tests.preview.browser import (
    COUNT,
    OPEN_DETAILS,
    Browser,
    assert_quiet,
    built,
    off_time,
    picture,
    previewed,
    watch,
)
from tests.support.embers import SIDE, SINGLE, SMALL, overlapping, tracks_of

LOOK = ("look",)


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page of an atlas with several pages and a layer, that plays once."""
    return built(tmp_path_factory.mktemp("page"), atlas={"max_size": 90}, maps={"flame": True})


@pytest.fixture(scope="module")
def loop(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page of a loop of 2 s."""
    return built(tmp_path_factory.mktemp("loop"), count=48)


PACKINGS: list[dict[str, Any]] = [
    {"alpha": "straight", "blend_space": "srgb"},
    {"alpha": "straight", "blend_space": "linear", "rotate": True},
    {"alpha": "premultiplied", "blend_space": "srgb", "max_size": 90},
    {"alpha": "premultiplied", "blend_space": "linear", "layout": "grid"},
    {"alpha": "additive", "blend_space": "srgb", "format": "webp"},
    {"alpha": "additive", "blend_space": "linear", "trim": "none"},
]


@pytest.mark.parametrize("atlas", PACKINGS, ids=lambda atlas: "-".join(map(str, atlas.values())))
def test_every_frame_is_blended_as_its_client_blends_it(
    atlas: dict[str, Any], browser: Browser, tmp_path: Path
) -> None:
    page = built(tmp_path, "--background", "#204060", atlas=atlas)
    look_and_step = [("pixels", "#picture"), ("press", "ArrowRight")] * COUNT
    seen = browser.visit(
        page, *look_and_step, ("click", "[value='#ffffff']"), ("pixels", "#picture")
    )
    assert_quiet(seen, page)
    frames = list(aligned_frames(read_atlas(page.with_name("fire.json"))))
    grounds = [(32, 64, 96)] * COUNT + [(255, 255, 255)]
    for frame, ground, drawn in zip([*frames, frames[0]], grounds, seen.results, strict=True):
        expected = blend(frame, ground, atlas["alpha"], atlas["blend_space"])
        shown = picture(drawn)
        assert shown.shape[:2] == expected.shape[:2]
        assert np.abs(shown[..., :3].astype(int) - expected).max() <= 2
        assert shown[..., 3].min() == 255


def test_it_plays_and_pauses_by_mouse_and_by_key(browser: Browser, loop: Path) -> None:
    hold = [LOOK, ("wait", 300), LOOK]
    seen = browser.visit(
        loop, LOOK, ("press", "["), ("press", "["), ("wait", 700), LOOK,
        ("press", "Space"), *hold, ("click", "#play"), LOOK, ("click", "#play"), *hold,
        moves=True,
    )  # fmt: skip
    assert_quiet(seen, loop)
    start, later, paused, still, again, stopped, held = seen.results
    assert (start["playing"], start["speed"]) == (True, "1")
    assert (later["playing"], later["speed"]) == (True, "0.25")
    assert not paused["playing"] and still["frame"] == paused["frame"]
    assert paused["said"] == f"paused at frame {paused['frame']}"
    assert again["playing"]
    assert not stopped["playing"] and held["frame"] == stopped["frame"]


def test_frames_go_by_at_their_time(browser: Browser, loop: Path) -> None:
    seen = browser.visit(loop, ("press", "["), watch("passed > 4000"), moves=True)
    times, frames = np.array([each[:2] for each in seen.results[0]]).T
    count = len(read_atlas(loop.with_name("fire.json")).frames)
    assert np.abs(off_time(frames, times, 1000 / 12, count)).max() < 1.01


def test_who_prefers_stillness_gets_it_until_they_ask(browser: Browser, loop: Path) -> None:
    seen = browser.visit(loop, LOOK, ("wait", 300), LOOK, ("press", "Space"), LOOK)
    before, after, asked = seen.results
    assert not before["playing"] and after["frame"] == before["frame"] == 1
    assert asked["playing"]


def test_it_steps_by_mouse_by_key_and_on_the_bar(browser: Browser, page: Path) -> None:
    by = [("click", "#on"), ("press", "ArrowRight"), ("click", "#back"), ("press", "ArrowLeft"),
          ("press", "ArrowLeft"), ("press", "Home"), ("press", "End"),
          ("run", "document.getElementById('scrub').focus()"), ("press", "ArrowLeft"),
          ("press", "Home"), ("press", "ArrowRight")]  # fmt: skip
    seen = browser.visit(page, *(each for step in by for each in (step, LOOK)))
    looks = [result for result in seen.results if result]
    assert [each["frame"] for each in looks] == [2, 3, 2, 1, 6, 1, 6, 6, 5, 1, 2]
    assert looks[0]["label"] == "fire, frame 2 of 6"
    assert looks[0]["value"] == looks[0]["said"] == "frame 2 of 6"
    assert_quiet(seen, page)


CONTROLS = [
    ("view", "[name=view][value=seam]", "2", ["play", "seam"]),
    ("view", "[name=view][value=page]", "3", ["play", "page"]),
    ("backdrop", "[value='#000000']", "b", ["#101014", "#000000"]),
    ("flakes", "[name=flakes][value=marks]", "f", ["off", "marks"]),
    ("between", "[name=between][value=blend]", "m", ["hold", "blend"]),
    ("outline", "#outline", "o", [False, True]),
    ("pixels", "#pixels", "p", [False, True]),
    ("repeat", "#repeat", "r", [True, False]),
    ("zoom", "#larger", "+", ["200 %", "300 %"]),
    ("zoom", "#smaller", "-", ["200 %", "100 %"]),
]


@pytest.fixture(scope="module")
def toggled(browser: Browser, page: Path) -> Any:
    """What the page looked like before and after each control, by mouse; again by key."""
    steps: list[tuple[Any, ...]] = []
    for _, selector, key, _ in CONTROLS:
        for act in (("click", selector), ("press", key)):
            reset = "document.querySelectorAll('input').forEach((input) => {"
            reset += "input.checked = input.defaultChecked; });"
            reset += "document.getElementById('repeat').checked = true;"
            reset += "document.querySelector('[name=view]').dispatchEvent(new Event('change'))"
            blur = "document.activeElement.blur()"
            steps += [("run", reset), ("run", blur), LOOK, act, LOOK, ("pixels", "#picture"),
                      ("pixels", "#marks")]  # fmt: skip
    seen = browser.visit(page, *steps)
    assert_quiet(seen, page)
    return seen.results


@pytest.mark.parametrize(
    "number", range(len(CONTROLS)), ids=lambda i: "-".join(CONTROLS[i][::2][:1])
)
def test_each_control_works_by_mouse_and_by_key(number: int, toggled: Any) -> None:
    name, _, _, values = CONTROLS[number]
    for way in range(2):
        _, _, before, after, _, _ = toggled[6 * (2 * number + way) :][:6]
        assert [before[name], after[name]] == values


def frames_of(page: Path) -> list[NDArray[np.uint8]]:
    return list(aligned_frames(read_atlas(page.with_name("fire.json"))))


def test_the_seam_lays_the_last_frame_over_the_first(browser: Browser, page: Path) -> None:
    seen = browser.visit(page, ("press", "2"), ("pixels", "#picture"), LOOK, ("press", "d"),
                         ("pixels", "#picture"), LOOK)  # fmt: skip
    frames = [blend(f, (0, 0, 0), "straight", "srgb").astype(float) for f in frames_of(page)]
    overlay, stated, difference, _ = seen.results
    grey = [frame @ np.array([0.2126, 0.7152, 0.0722]) for frame in frames]
    shown = picture(overlay).astype(float)
    assert np.abs(shown[..., 0] - grey[-1]).max() <= 2
    assert np.abs(shown[..., 1] - grey[0]).max() <= 2
    expected = np.minimum(4 * np.abs(frames[-1] - frames[0]), 255)
    assert np.abs(picture(difference)[..., :3] - expected).max() <= 8
    assert stated["label"] == "fire, last and first frame, overlay"


def test_a_page_shows_its_frames_and_leads_to_them(browser: Browser, page: Path) -> None:
    atlas = read_atlas(page.with_name("fire.json"))
    sheet = atlas.sheet
    assert len(sheet.pages) > 1
    number, target = [(i, r) for i, r in enumerate(sheet.regions) if r.page == 0][-1]
    middle = target.x + target.width / 2, target.y + target.height / 2
    seen = browser.visit(
        page, ("press", "3"), LOOK, ("run", "getComputedStyle(canvases).width"),
        ("pixels", "#picture"),
        ("run", "document.getElementById('sheet').value = 1, "
                "document.getElementById('sheet').dispatchEvent(new Event('change'))"), LOOK,
    )  # fmt: skip
    first, width, drawn, _, second = seen.results
    assert first["size"] == [sheet.pages[0].width, sheet.pages[0].height]
    assert (first["caption"], second["caption"]) == ("fire.png", "fire-1.png")
    with Image.open(page.with_name("fire.png")) as image:
        expected = blend(np.asarray(image.convert("RGBA")), (16, 16, 20), "straight", "srgb")
    assert np.abs(picture(drawn)[..., :3].astype(int) - expected).max() <= 2
    scale = float(width.removesuffix("px")) / sheet.pages[0].width
    x, y = (round(place * scale) for place in middle)
    seen = browser.visit(
        page, ("press", "3"), ("hover", "#marks", x, y), LOOK,
        ("press_at", "#marks", x, y), ("press", "1"), LOOK,
    )  # fmt: skip
    hovered, chosen = seen.results
    assert hovered["caption"] == target.name
    assert (chosen["caption"].split(" ")[0], chosen["frame"]) == (target.name, number + 1)


def test_flakes_are_marked_where_the_tracks_say(browser: Browser, page: Path) -> None:
    seen = browser.visit(page, ("press", "ArrowRight"), ("pixels", "#marks"), ("press", "f"),
                         ("pixels", "#marks"), LOOK)  # fmt: skip
    without, marked, stated = seen.results
    assert not picture(without)[..., 3].any()
    tracks = read_tracks(page.with_name("fire.flakes.json"))
    assert tracks is not None
    rows = tracks.frames[1]
    assert stated["caption"] == f"fire/0001 · {len(rows)} flakes"
    lines = picture(marked)[..., 3] > 0
    scale = lines.shape[0] / tracks.height
    near = np.zeros_like(lines)
    for x, y, size, stretch in rows[:, [1, 2, 5, 6]] * scale:
        reach = int(size * stretch / scale / 2 + 4 * scale)
        near[max(int(y) - reach, 0) : int(y) + reach, max(int(x) - reach, 0) : int(x) + reach] = (
            True
        )
        around = lines[
            max(int(y) - reach, 0) : int(y) + reach, max(int(x) - reach, 0) : int(x) + reach
        ]
        assert around.any() or not around.size
    assert lines[near].sum() > 0.5 * lines.sum()


@pytest.mark.parametrize("kind", [*SINGLE, *SMALL, "overlapping"])
def test_embers_are_drawn_over_the_flame_as_in_our_frames(
    kind: str, browser: Browser, tmp_path: Path
) -> None:
    page = built(tmp_path, flakes={"bake": False})
    rows = overlapping() if kind == "overlapping" else (SINGLE | SMALL)[kind]
    tracks = tracks_of(rows, COUNT)
    file = write_tracks_json("fire", tracks)
    page.with_name(file.name).write_bytes(file.data)
    previewed(page.with_name("fire.json"))
    seen = browser.visit(
        page, ("press", "End"), ("press", "f"), ("press", "f"), ("pixels", "#picture")
    )
    assert_quiet(seen, page)
    drawn = picture(seen.results[0])[..., :3].astype(int)
    height, width = drawn.shape[:2]
    flame = decode_bytes(blend(frames_of(page)[-1], (16, 16, 20), "straight", "srgb"))
    light = draw_flakes(tracks.frames[0], SIDE, SIDE).rgb()[:height, :width]
    assert np.abs(drawn - encode_bytes(exposed_together(flame, light))).max() <= 3
    assert light.max() > 0.02


def test_the_flakes_of_all_rounds_are_played(browser: Browser, tmp_path: Path) -> None:
    keys = {"flakes": {"bake": False, "rounds": 3}, "timeline": {"loop": "crossfade"}}
    page = built(tmp_path, count=24, **keys)
    tracks = read_tracks(page.with_name("fire.flakes.json"))
    assert tracks is not None and tracks.rounds == 3
    count, total = tracks.round_frames, len(tracks.frames)

    def told(frame: int, caption: str) -> int:
        """Return the frame of the tracks that the page shows."""
        alive, stated = caption.partition(" · ")[2].split(" flakes, round ")
        at = (int(stated[0]) - 1) * count + frame - 1
        assert int(alive) == len(tracks.frames[at])
        return at

    def stepped(key: str, times: int) -> list[int]:
        looks = [each for _ in range(times) for each in (("press", key), LOOK)]
        seen = browser.visit(page, ("press", "f"), LOOK, *looks)
        assert_quiet(seen, page)
        return [told(look["frame"], look["caption"]) for look in seen.results]

    assert stepped("ArrowRight", total) == [*range(total), 0]
    assert stepped("ArrowLeft", 2) == [0, total - 1, total - 2]
    rounds = "new Set(seen.map((told) => told[2].split('round ')[1])).size"
    until = f"passed > {total * 1000 / 24} && {rounds} === 3 || passed > 60000"
    seen = browser.visit(page, ("press", "f"), watch(until), moves=True)
    assert_quiet(seen, page)
    played = np.array([told(*shown) for _, *shown in seen.results[0]])
    times = np.array([time for time, *_ in seen.results[0]])
    assert set(played // count) == {0, 1, 2}
    off = np.abs(off_time(played, times, 1000 / 24, total))
    assert off.max() < 1.01, "no round is skipped or repeated"


def test_an_animation_that_plays_once_stops_at_its_end(browser: Browser, tmp_path: Path) -> None:
    source = {"path": str(shipped("samples") / "campfire"), "fps": 6, "count": 24, "height": 96}
    page = built(tmp_path, source=source, timeline={"loop": "none"})
    over = """new Promise((done) => {
      const play = document.getElementById("play");
      const is_over = () => play.ariaPressed === "false" && done();
      new MutationObserver(is_over).observe(play, {attributes: true});
      is_over();
      setTimeout(done, 60000);
    })"""
    seen = browser.visit(page, LOOK, ("run", over), LOOK, ("press", "Space"), LOOK, moves=True)
    start, _, end, again = seen.results
    assert (start["repeat"], start["playing"]) == (False, True)
    assert (end["frame"], end["playing"]) == (24, False)
    assert again["playing"] and again["frame"] < 24


def sprites(folder: Path) -> Path:
    """A recipe that packs two animations of different sizes."""
    (folder / "clip").mkdir()
    for name, count, side in (("walk", 4, 30), ("run", 2, 50)):
        for i in range(count):
            image = np.zeros((side, side + i, 4), np.uint8)
            image[i : side - 4, 4:] = (40 * i + 50, 90, 200, 255)
            Image.fromarray(image).save(folder / "clip" / f"{name}_{i}.png")
    recipe = folder / "hero.yaml"
    recipe.write_text(json.dumps({"source": {"kind": "sprites", "path": "clip"}}))
    return recipe


def test_one_of_several_animations_is_chosen(browser: Browser, tmp_path: Path) -> None:
    assert main(["build", str(sprites(tmp_path)), "-q"]) == 0
    page = previewed(tmp_path / "build" / "hero.json")
    pick = "document.getElementById('animation').focus()"
    seen = browser.visit(
        page, LOOK, ("run", pick), ("press", "ArrowDown"), LOOK, ("pixels", "#picture")
    )
    assert_quiet(seen, page)
    first, _, second, drawn = seen.results
    atlas = read_atlas(page.with_name("hero.json"))
    one, two = atlas.sheet.animations
    assert (first["label"], first["of"]) == (f"{one.name}, frame 1 of {len(one.frames)}", "of 2")
    assert (second["label"], second["of"]) == (f"{two.name}, frame 1 of {len(two.frames)}", "of 4")
    assert picture(drawn).shape[:2] == (30, 33), "its frames, not those of the other"


def test_names_cannot_break_out_of_the_page(browser: Browser, tmp_path: Path) -> None:
    page = built(tmp_path)
    evil = "</script><script>window.broken = 1</script><img src=x onerror='window.broken=1'>&amp;"
    atlas = page.with_name("fire.json")
    document = json.loads(atlas.read_text())
    frames = document["frames"]
    document["frames"] = {key.replace("fire/", f"{evil}/"): value for key, value in frames.items()}
    document["animations"] = {evil: list(document["frames"])}
    atlas.write_text(json.dumps(document))
    previewed(atlas)
    seen = browser.visit(page, LOOK, ("run", "window.broken === undefined"))
    assert_quiet(seen, page)
    stated, whole = seen.results
    assert whole is True
    assert stated["caption"].startswith(f"{evil}/0000")
    assert stated["label"] == f"{evil}, frame 1 of 6"


NAMELESS = """[...document.querySelectorAll("button, input, select, output, canvas[role]")]
  .filter((each) => each.offsetParent !== null)
  .filter((each) => !(each.getAttribute("aria-label") || [...(each.labels ?? [])].some((l) =>
    l.textContent.trim()) || each.textContent.trim()))
  .map((each) => each.outerHTML)"""

REACH = "document.activeElement.id || document.activeElement.name || document.activeElement.tagName"


def test_everything_has_a_name_and_is_reached_by_tab(browser: Browser, page: Path) -> None:
    tabs = [each for _ in range(24) for each in (("press", "Tab"), ("run", REACH))]
    seen = browser.visit(page, ("run", NAMELESS), *tabs)
    nameless, *reached = seen.results
    assert nameless == []
    assert {
        "view", "stage", "back", "play", "on", "scrub", "speed", "repeat", "backdrop", "own",
        "smaller", "larger", "fit", "pixels", "outline", "between", "layer", "flakes", "SUMMARY",
    } <= set(reached)  # fmt: skip


def test_focus_is_seen(browser: Browser, page: Path) -> None:
    outline = "(() => { const at = document.activeElement, by = at.nextElementSibling;"
    outline += "const shown = at.type === 'radio' ? by : at;"
    outline += (
        "return getComputedStyle(shown).outlineStyle + getComputedStyle(shown).outlineWidth })()"
    )
    tabs = [each for _ in range(14) for each in (("press", "Tab"), ("run", outline))]
    assert set(browser.visit(page, *tabs).results) == {"solid2px"}


@pytest.mark.parametrize("width", [320, 420, 800, 1600])
def test_no_width_needs_to_be_scrolled_sideways(browser: Browser, page: Path, width: int) -> None:
    wide = "[document.scrollingElement.scrollWidth, innerWidth]"
    inside = """[...document.querySelectorAll("button, select, .choices, #scrub")]
      .filter((each) => each.offsetParent !== null)
      .every((each) => each.getBoundingClientRect().right <= innerWidth + 0.5)"""
    seen = browser.visit(page, ("run", wide), ("run", inside), size=(width, 800))
    (content, window), fits = seen.results
    assert content <= window and fits


def test_figures_of_embers_are_those_that_inspect_prints(browser: Browser, page: Path) -> None:
    rows = "[...document.querySelectorAll('tr')].map((row) => row.innerText.split(/[\\t\\n]+/))"
    shown, unfolded = browser.visit(page, ("run", rows), OPEN_DETAILS, ("run", rows)).results
    stated = {row[0]: row[1:] for row in unfolded if len(row) > 1}
    assert "born" not in {row[0] for row in shown}
    tracks = read_tracks(page.with_name("fire.flakes.json"))
    assert tracks is not None
    assert stated["born"] == [str(len(tracks.spawns))]
    assert stated["end higher than born"][1].endswith("at least 0.7")
    first = read_atlas(page.with_name("fire.json")).sheet.pages[0]
    assert [f"{first.width} × {first.height}"] in (row[1:] for row in shown)

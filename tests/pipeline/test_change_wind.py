"""Fire that answers the wind while a game runs: loops, and transitions between them."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fire_atlas.cli import main
from fire_atlas.core.shipped import shipped
from fire_atlas.effect.flakes.tracks import COLUMNS
from fire_atlas.formats.tracks.tracks_json import read_tracks
from fire_atlas.timeline.wind_change import MAX_STEP
from tests.support.repo import contents
from tests.support.wind import SILK, Walker, lean_of, recipe_in

PROFILE: dict[str, Any] = {
    "source": {
        "kind": "profile", "path": str(shipped("samples") / "candle"), "count": 24, "height": 64,
        "slices": 4,
    },
    "wind": {"levels": [0, 2]},
    "timeline": {"frames": 24, "fps": 12},
    "flakes": {"rate": 60, "bake": False},
}  # fmt: skip
"""A calm fire, which leans faster than it moves otherwise if the wind changes at an even pace."""

KINDS = {"silk": SILK, "profile": PROFILE}


@pytest.fixture(scope="module", params=KINDS)
def walker(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Walker:
    folder = tmp_path_factory.mktemp(request.param)
    recipe = recipe_in(folder, KINDS[request.param])
    assert main(["build", str(recipe), "-q", "--jobs", "1"]) == 0
    return Walker.of(folder / "build" / "fire.json")


@pytest.mark.slow
def test_no_step_of_a_hundred_walks_is_seen(walker: Walker) -> None:
    chance, visited = np.random.default_rng(1), set[str]()
    steps = {loop: walker.steps_of(loop) for loop in walker.loops}
    limits = {}
    for state in walker.graph.states:
        if state.wind is None:
            one, other = walker.ends_of(state.animation)
            limits[state.animation] = MAX_STEP * np.median(steps[one] + steps[other])
    for _ in range(100):
        now = str(chance.choice(walker.loops)), int(chance.integers(24))
        for wanted in chance.integers(0, len(walker.loops), 3).tolist():
            for _ in range(200):
                following = walker.after(now, wanted)
                for transition in limits.keys() & {now[0], following[0]}:
                    assert walker.step(now, following) <= limits[transition], (now, following)
                now = following
                visited.add(now[0])
            assert now[0] == walker.loops[wanted]
    assert visited == {state.animation for state in walker.graph.states}


@pytest.mark.slow
def test_lean_rises_with_the_level_and_transitions_lie_between(walker: Walker) -> None:
    frames: dict[str, list[Any]] = {}
    for (name, _), picture in walker.frames.items():
        frames.setdefault(name, []).append(picture)
    leans = {name: lean_of(pictures) for name, pictures in frames.items()}
    levels = [leans[loop] for loop in walker.loops]
    assert (np.diff(levels) > 0.05).all(), levels
    for state in walker.graph.states:
        if state.wind is None:
            low, high = sorted(leans[loop] for loop in walker.ends_of(state.animation))
            assert low - 0.01 < leans[state.animation] < high + 0.01, (state.animation, leans)


@pytest.mark.slow
def test_frames_have_one_size_and_foot_so_that_the_fire_stays_in_place(walker: Walker) -> None:
    regions = walker.atlas.frames
    assert len({(each.frame_width, each.frame_height, *each.anchor) for each in regions}) == 1


@pytest.mark.slow
def test_flakes_fly_on_in_a_transition_and_fade(walker: Walker) -> None:
    folder = walker.atlas.path.parent
    x, y, a = (COLUMNS.index(name) for name in ("x", "y", "a"))

    def rows(name: str, frame: int) -> dict[tuple[float, float], float]:
        """Return the opacity of all flakes at each place."""
        tracks = read_tracks(folder / f"fire.{name}.flakes.json")
        assert tracks is not None
        found = dict[tuple[float, float], float]()
        for row in tracks.frames[frame % len(tracks.frames)].tolist():
            found[row[x], row[y]] = found.get((row[x], row[y]), 0.0) + row[a]
        return found

    seen = 0
    for state in walker.graph.states:
        if state.wind is not None:
            continue
        before, after = walker.ends_of(state.animation)
        [leave] = [each for each in walker.graph.transitions if each.after == state.animation]
        [enter] = [each for each in walker.graph.transitions if each.before == state.animation]
        count = walker.count(state.animation)
        for frame in range(count):
            shown = rows(state.animation, frame)
            left = rows(before, leave.frame + 1 + frame)
            entered = rows(after, enter.entry - count + frame)
            assert shown.keys() == left.keys() | entered.keys()
            for place in left.keys() - entered.keys():
                assert shown[place] <= left[place]
            seen += len(shown)
        first, last = rows(state.animation, 0), rows(state.animation, count - 1)
        left, entered = rows(before, leave.frame + 1), rows(after, enter.entry - 1)
        assert all(first[place] > 0.8 * left[place] - 0.005 for place in left)
        assert all(last[place] > 0.8 * entered[place] - 0.005 for place in entered)
    assert seen > 50


@pytest.mark.slow
def test_the_number_of_workers_changes_nothing(tmp_path: Path) -> None:
    keys = {**SILK, "wind": {"levels": [0, 3]}, "timeline": {"frames": 10, "fps": 12}}
    recipe = recipe_in(tmp_path, keys)
    found = []
    for jobs in ("1", "3"):
        assert main(["build", str(recipe), "-q", "--force", "--jobs", jobs]) == 0
        found.append(contents(tmp_path / "build"))
    assert found[0] == found[1]


@pytest.mark.slow
def test_without_flakes_and_with_a_blurred_flame_it_is_built(tmp_path: Path) -> None:
    keys = {**SILK, "wind": {"levels": [0, 3]}, "timeline": {"frames": 10, "fps": 12}}
    recipe = recipe_in(tmp_path, keys, flakes="none", motion_blur={"flame": True})
    assert main(["build", str(recipe), "-q"]) == 0
    walker = Walker.of(tmp_path / "build" / "fire.json")
    assert walker.count("wind_0_1") == 6
    assert not list((tmp_path / "build").glob("*.flakes.json"))

"""Built loops, and clips that play once, as an engine plays them from the written tracks."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fire_atlas.core.shipped import shipped
from fire_atlas.effect.flakes.tracks import COLUMNS
from tests.support.repo import Repo, tracks_of

FLAKES = {"rate": 150, "life": [0.3, 2.6]}


class Player:
    """An engine that plays the tracks: it moves every flake by its velocity, and knows its id."""

    def __init__(self, tracks: Mapping[str, Any]) -> None:
        self.tracks = tracks
        self.column = {name: i for i, name in enumerate(tracks["columns"])}
        self.seen: dict[int, tuple[float, float, float, float]] = {}
        self.worst = 0.0

    def show(self, frame: int) -> int:
        """Show a frame; return how many flakes are alive."""
        rows = self.tracks["frames"][frame % self.tracks["frame_count"]]["rows"]
        now = {row[0]: tuple(row[self.column[c]] for c in ("x", "y", "vx", "vy")) for row in rows}
        assert len(now) == len(rows), "an id is in a frame twice"
        for flake in now.keys() & self.seen.keys():
            x, y, vx, vy = self.seen[flake]
            moved = np.hypot(now[flake][0] - x, now[flake][1] - y)
            speed = np.hypot(vx, vy) / self.tracks["fps"]
            self.worst = max(self.worst, float(moved / max(speed, 0.02)))
        self.seen = now
        return len(now)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["campfire", "real_firewall_stock"])
def test_a_hundred_loops_in_a_small_player(clips: Path, repo: Repo, name: str) -> None:
    if name == "campfire":
        repo.clip(count=48)
        recipe = repo.recipe(flakes=FLAKES)
    else:
        folder = str(clips / name / "frames")
        recipe = repo.recipe(source={"path": folder, "fps": 25, "height": 135}, flakes=FLAKES)
    repo.built(recipe)
    tracks = tracks_of(repo.build, "fire")
    assert tracks["loop"] and tracks["columns"] == list(COLUMNS)
    assert any(spawn["wraps"] for spawn in tracks["spawns"])
    player, count = Player(tracks), tracks["frame_count"]
    alive = [player.show(frame) for frame in range(100 * count)]
    assert all(a == b for a, b in zip(alive, alive[count:], strict=False)), "alive is periodic"
    assert player.worst <= 1.5, "a flake jumps"


def test_no_spark_is_born_in_the_tail_and_it_ends_when_the_last_has_burnt_out(
    repo: Repo,
) -> None:
    repo.clip(count=8)
    keys: dict[str, Any] = {"flakes": {"life": [0.3, 0.7], "rate": 300}}
    repo.built(repo.recipe(timeline={"loop": "none", "tail": True}, **keys))
    tracks = tracks_of(repo.build, "fire")
    age = tracks["columns"].index("age")
    counts = [len(frame["rows"]) for frame in tracks["frames"]]
    assert 8 + 8 <= len(counts) <= 8 + 18
    assert counts[-1] > 0 or len(counts) == 16
    assert max(spawn["t"] for spawn in tracks["spawns"]) < 8 / 24
    for n, frame in enumerate(tracks["frames"][9:], 9):
        assert all(row[age] >= (n - 8) / 24 - 1e-3 for row in frame["rows"])


def test_of_sparks_too_dim_to_be_waited_for_no_birth_is_written_without_a_row(
    repo: Repo,
) -> None:
    repo.clip(count=8)
    keys: dict[str, Any] = {"flakes": {"rate": 300, "intensity": 1e-4}}
    repo.built(repo.recipe(timeline={"loop": "none", "tail": True}, **keys))
    tracks = tracks_of(repo.build, "fire")
    seen = {row[tracks["columns"].index("id")] for each in tracks["frames"] for row in each["rows"]}
    assert seen == {spawn["id"] for spawn in tracks["spawns"]}


_LEFT = "timeline.tail: true lets them burn out"


def test_sparks_that_glow_where_a_clip_breaks_off_are_reported(repo: Repo) -> None:
    repo.clip(count=7)
    keys: dict[str, Any] = {"flakes": {"rate": 200}}
    plain = repo.run("build", repo.recipe("plain.yaml", **keys))
    assert plain.code == 0 and _LEFT in plain.out + plain.err
    ran = repo.run("build", repo.recipe("lasting.yaml", timeline={"tail": True}, **keys))
    assert ran.code == 0 and _LEFT not in ran.out + ran.err


def test_sparks_of_a_fire_that_burns_out_are_cold_by_then(repo: Repo) -> None:
    explosion = {"path": str(shipped("samples") / "explosion"), "fps": 24}
    ran = repo.run("build", repo.recipe(source=explosion))
    assert ran.code == 0 and _LEFT not in ran.out + ran.err
    tracks = tracks_of(repo.build, "fire")
    assert all(spawn["t"] + spawn["life"] <= 31 / 24 + 1 / 60 for spawn in tracks["spawns"])


def test_inspect_says_how_well_a_loop_goes_round(repo: Repo) -> None:
    repo.clip(count=48)
    repo.built(repo.recipe(flakes="none", motion_blur="none"))
    said = repo.run("inspect", repo.build / "fire.json", "--loops").out
    assert "seam step" in said and "percentile" in said


def test_inspect_has_no_loop_figures_for_what_plays_once(repo: Repo) -> None:
    repo.clip(count=8)
    repo.built(repo.recipe(timeline={"loop": "none"}))
    for details in ([], ["--loops"]):
        assert "seam step" not in repo.run("inspect", repo.build / "fire.json", *details).out


def test_the_number_of_workers_changes_nothing_about_a_cut_and_retimed_loop(
    repo: Repo,
) -> None:
    repo.clip(count=20)
    recipe = repo.recipe(timeline={"loop": "crossfade", "fps": 40, "frames": 24})
    one = repo.built(recipe, "--jobs", "1")
    assert tracks_of(repo.build, "fire")["frame_count"] == 24
    assert repo.built(recipe, "--force", "--jobs", "2") == one


@pytest.mark.parametrize(
    ("timeline", "advice"),
    [
        ({"loop": "pingpong", "tail": True}, "use loop: none"),
        ({"loop": "crossfade", "tail": 1.5}, "leave tail out"),
        ({"loop": "none", "overlap": 4}, "use loop: crossfade"),
        ({"loop": "pingpong", "frames": 9}, "frames: 10 or 8"),
        ({"tail": "yes"}, "true, false or a number of seconds"),
        ({"overlap": True}, "`auto` or a whole number"),
        ({"overlap": 0}, "at least 1"),
        ({"frames": 0}, "at least 1"),
        ({"fps": 0}, "at least 0.01"),
        ({"loop": "round"}, "must be one of 'auto', 'none', 'crossfade', 'pingpong'"),
    ],
)
def test_contradictions_are_refused_with_advice(
    repo: Repo, timeline: dict[str, Any], advice: str
) -> None:
    repo.clip(count=4)
    ran = repo.run("check", repo.recipe(timeline=timeline))
    assert ran.code == 2
    assert advice.replace("'", "") in ran.err.replace("'", "")


def test_a_tail_without_flakes_is_refused(repo: Repo) -> None:
    repo.clip(count=4)
    ran = repo.run("check", repo.recipe(timeline={"tail": True}, flakes="none"))
    assert ran.code == 2 and "flakes is none" in ran.err


def _sliding(repo: Repo) -> None:
    """Put frames on the repo that end elsewhere than they begin."""
    frames = []
    for i in range(16):
        frame = np.zeros((48, 96, 4), np.uint8)
        shade = np.clip(255 - 6 * np.abs(np.arange(96) - 12 - 4 * i), 0, 255)
        frame[8:40] = np.stack([shade, shade // 2, shade // 9, shade], axis=1)
        frames.append(frame)
    repo.frames(frames)


def test_a_recipe_that_only_packs_keeps_its_frames(repo: Repo) -> None:
    _sliding(repo)
    repo.built(repo.recipe(flakes="none", motion_blur="none"))
    kept = json.loads((repo.build / "fire.json").read_text(encoding="utf-8"))
    assert len(kept["frames"]) == 16 and not kept["meta"]["fireAtlas"]["loops"]["fire"]
    repo.built(repo.recipe(flakes="none", motion_blur="none", timeline={"loop": "crossfade"}))
    cut = json.loads((repo.build / "fire.json").read_text(encoding="utf-8"))
    assert len(cut["frames"]) == 13 and cut["meta"]["fireAtlas"]["loops"]["fire"]

"""Source ``profile`` on a person's repo: recipes, ``learn``, files, errors."""

import contextlib
import io
import json
import shutil
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from PIL import Image

from fire_atlas.atlas.encode import encode_frame
from fire_atlas.cli import main
from fire_atlas.core.clip import Clip
from fire_atlas.core.shipped import shipped
from fire_atlas.sources import profile as sources_profile
from tests.generators.profile.flames import swaying

SMALL = {"slices": 4, "particles": 20}


def run(*arguments: str | Path) -> tuple[int, str]:
    """Run ``fire-atlas`` and return its exit code and all it said."""
    said = io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
        code = main([str(argument) for argument in arguments])
    return code, said.getvalue()


def save(clip: Clip, folder: Path) -> Path:
    folder.mkdir()
    for i in range(clip.count):
        picture = encode_frame(clip.read(i), "straight", "srgb")
        Image.fromarray(picture).save(folder / f"{i:04}.png")
    return folder


@pytest.fixture(scope="module")
def filmed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the clip of a swaying flame, and one of the same from the right: made once."""
    folder = tmp_path_factory.mktemp("filmed")
    save(swaying(16)[0], folder / "front")
    save(swaying(16, half=28.0)[0], folder / "side")
    return folder


@pytest.fixture
def repo(filmed: Path, tmp_path: Path) -> Path:
    """A folder of the test's own with these clips."""
    shutil.copytree(filmed, tmp_path, dirs_exist_ok=True)
    return tmp_path


def recipe(repo: Path, source: dict[str, Any] | None = None, **keys: Any) -> Path:
    given = {"kind": "profile", "path": "front", **SMALL, **(source or {})}
    usual = {"timeline": {"frames": 6}, "flakes": "none", "motion_blur": "none"}
    path = repo / "fire.yaml"
    path.write_text(json.dumps({"source": given, **usual, **keys}))
    return path


def built(path: Path, *more: str) -> dict[str, bytes]:
    code, said = run("build", path, "--force", *more)
    assert code == 0, said
    return {file.name: file.read_bytes() for file in sorted((path.parent / "build").iterdir())}


def test_a_recipe_builds_new_frames_of_any_length(repo: Path) -> None:
    files = built(recipe(repo, timeline={"frames": 40, "fps": 12}))
    atlas = json.loads(files["fire.json"])
    assert len(atlas["frames"]) == 40
    first = next(iter(atlas["frames"].values()))
    assert first["duration"] == pytest.approx(1000 / 12, abs=0.01)
    manifest = json.loads(files["fire.manifest.json"])
    assert manifest["inputs"][0]["path"] == "front/0000.png"


@pytest.mark.slow
def test_a_size_builds_the_bytes_of_its_height_written_out(repo: Path) -> None:
    code, said = run("learn", repo / "front", "-o", repo / "kite.profile.json")
    assert code == 0, said
    learnt = {"path": "kite.profile.json"}
    files = built(recipe(repo, {**learnt, "size": "game"}), "--set", "source.size=draft")
    same = built(recipe(repo, {**learnt, "height": 192}))
    assert files.pop("fire.manifest.json") and same.pop("fire.manifest.json")
    assert files == same
    frame = json.loads(files["fire.json"])["frames"]["fire/0000"]["sourceSize"]
    assert frame["h"] == 192 > frame["w"]
    by_default = json.loads(built(recipe(repo, learnt))["fire.json"])["frames"]["fire/0000"]
    shape = by_default["sourceSize"]["w"] / by_default["sourceSize"]["h"]
    assert frame["w"] / frame["h"] == pytest.approx(shape, rel=0.05)


@pytest.mark.slow
def test_views_are_animations_of_their_own(repo: Path) -> None:
    keys: dict[str, Any] = {"views": {"count": 3, "elevation": 20}, "flakes": {"rate": 20}}
    files = built(recipe(repo, {"side_path": "side"}, **keys))
    atlas = json.loads(files["fire.json"])
    assert "fire/view_2/0005" in atlas["frames"]
    assert "fire.view_1.flakes.json" in files


@pytest.mark.slow
def test_the_same_bytes_at_any_worker_count(repo: Path) -> None:
    path = recipe(repo, views={"count": 2}, flakes={"rate": 20})
    assert built(path, "--jobs", "1") == built(path, "--jobs", "5")


@pytest.mark.slow
def test_a_profile_file_builds_what_its_clip_builds(repo: Path) -> None:
    code, said = run("learn", repo / "front", "-o", repo / "kite.profile.json")
    assert code == 0, said
    picture = cv2.imread(str(repo / "kite.profile.png"))
    assert picture is not None and np.ptp(picture) > 200
    of_clip = built(recipe(repo))
    of_file = built(recipe(repo, {"path": "kite.profile.json"}))
    assert of_file["fire.png"] == of_clip["fire.png"]
    assert of_file["fire.json"] == of_clip["fire.json"]


@pytest.mark.slow
def test_a_build_is_fresh_until_either_clip_changes(repo: Path) -> None:
    path = recipe(repo, {"side_path": "side"})
    built(path)
    assert "up to date" in run("build", path)[1]
    Image.open(repo / "side" / "0001.png").save(repo / "side" / "0000.png")
    code, said = run("build", path)
    assert code == 0 and "up to date" not in said


@pytest.mark.slow
def test_learning_from_two_sides_on_the_command_line(repo: Path) -> None:
    out = repo / "both.profile.json"
    sides = repo / "front", "--side", repo / "side"
    code, said = run("learn", *sides, "-o", out, "--set", "cells=4")
    assert code == 0, said
    file = json.loads(out.read_bytes())
    assert [side["colours"]["cells"] for side in file["sides"]] == [4, 4]


@pytest.mark.parametrize(
    ("source", "keys", "message"),
    [
        ({"kind": "profil"}, {}, "source.kind: must be one of fluid, frames, profile, silk"),
        ({"slcies": 3}, {}, "source.slcies: unknown key; did you mean source.slices?"),
        (
            {"sampling": "nearest"},
            {},
            "source.sampling: unknown key here; it is one of `kind: frames`",
        ),
        ({"slices": 0}, {}, "source.slices: must be at least 1; got 0"),
        ({}, {"wind": {"level": 6}}, "wind.level: must be at most 5; got 6"),
        ({}, {"views": {"count": 65}}, "views.count: must be at most 64; got 65"),
        ({"kind": "frames"}, {}, "source.slices: unknown key here; it is one of `kind: profile`"),
        ({"path": "nothing"}, {}, "nothing: does not exist"),
        ({"side_path": "nothing"}, {}, "nothing: does not exist"),
    ],
)
def test_mistakes_in_a_recipe_are_refused_with_advice(
    repo: Path, source: dict[str, Any], keys: dict[str, Any], message: str
) -> None:
    code, said = run("check", recipe(repo, source, **keys))
    assert code != 0 and message in said, said
    assert "Traceback" not in said


@pytest.mark.parametrize(
    ("timeline", "message"),
    [
        ({"loop": "pingpong"}, "timeline.loop: pingpong joins the ends of a clip"),
        ({"loop": "crossfade"}, "timeline.loop: crossfade joins the ends of a clip"),
        ({"overlap": 4}, "timeline.overlap: applies to clips only"),
        ({"loop": "none", "tail": True}, "timeline.tail: applies to clips only"),
    ],
)
def test_what_is_for_footage_is_refused(repo: Path, timeline: dict[str, Any], message: str) -> None:
    code, said = run("check", recipe(repo, timeline=timeline, flakes={"rate": 5}))
    assert code == 2 and message in said, said


def test_views_are_refused_for_footage(repo: Path) -> None:
    path = repo / "plain.yaml"
    path.write_text(json.dumps({"source": {"path": "front"}, "views": {"count": 8}}))
    code, said = run("check", path)
    assert code == 2 and "views: frames have one side" in said


def test_a_clip_without_fire_leaves_nothing_behind(repo: Path) -> None:
    still = repo / "still"
    still.mkdir()
    for i in range(8):
        Image.open(repo / "front" / "0000.png").save(still / f"{i}.png")
    code, said = run("build", recipe(repo, {"path": "still"}))
    assert code == 1 and "no fire found" in said
    assert not list((repo / "build").glob("*")) if (repo / "build").exists() else True
    code, said = run("learn", still, "-o", repo / "x.profile.json")
    assert code == 1 and not (repo / "x.profile.json").exists()


def test_a_profile_of_a_later_version_is_refused_by_a_build(repo: Path) -> None:
    later = repo / "later.profile.json"
    later.write_text(json.dumps({"format": "fire-atlas/profile", "version": 4}))
    code, said = run("build", recipe(repo, {"path": "later.profile.json"}))
    assert code == 1 and "version 4" in said and "update fire-atlas" in said


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("cells", 4), ("threshold", 50), ("start", 1), ("count", 8), ("fps", 12),
        ("matte", "alpha"), ("black", 4), ("grid", {"columns": 1, "rows": 1}),
    ],
)  # fmt: skip
def test_keys_of_learning_are_refused_for_a_profile_file(
    repo: Path, key: str, value: object
) -> None:
    (repo / "x.profile.json").write_text("{}")
    code, said = run("check", recipe(repo, {"path": "x.profile.json", key: value}))
    assert code == 2 and f"source.{key}: says how to learn" in said and "remove it" in said, said


@pytest.mark.parametrize(
    "key", ["slices=3", "particles=50", "detail=0.5", "height=64", "size=game"]
)
def test_keys_of_generating_are_refused_by_learn(repo: Path, key: str) -> None:
    code, said = run("learn", repo / "front", "-o", repo / "x.profile.json", "--set", key)
    assert code == 2 and "says how fire is generated" in said and "in the recipe" in said, said


def test_a_profile_file_does_not_take_a_side_view_too(repo: Path) -> None:
    (repo / "x.profile.json").write_text("{}")
    code, said = run("build", recipe(repo, {"path": "x.profile.json", "side_path": "side"}))
    assert code == 1 and "source.side_path: is in " in said and "remove it" in said


def test_a_clip_is_not_its_own_side_view(repo: Path) -> None:
    for command in ("check", "build"):
        code, said = run(command, recipe(repo, {"path": "front", "side_path": "./side/../front"}))
        assert code == 1 and "source.side_path: is " in said and "filmed from its right" in said
    code, said = run("learn", repo / "front", "--side", repo / "front", "-o", repo / "x.json")
    assert code == 1 and "filmed from its right side, or leave it out" in said, said
    assert not (repo / "x.json").exists()


@pytest.mark.slow
def test_learn_names_its_output_and_will_not_overwrite_its_input(
    repo: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(repo)
    assert run("learn", "front")[0] == 0
    assert (repo / "front.profile.json").is_file() and (repo / "front.profile.png").is_file()
    code, said = run("learn", "front", "-o", "front.png")
    assert code == 2 and "ends in .json" in said


@pytest.mark.slow
@pytest.mark.parametrize(
    ("count", "advice"),
    [(6, "8 to 60 are best; 6 show few poses"), (8, None), (60, None), (72, "of 72, those beyond")],
)
def test_learn_says_when_a_clip_is_short_or_long(
    repo: Path, tmp_path: Path, count: int, advice: str | None
) -> None:
    frames = sorted((repo / "front").glob("*.png"))
    clip = tmp_path / "clip"
    clip.mkdir()
    for i in range(count):
        shutil.copy(frames[i % len(frames)], clip / f"{i:03}.png")
    code, said = run("learn", clip, "-o", tmp_path / "x.profile.json")
    assert code == 0
    assert ("are best" in said) == (advice is not None)
    assert advice is None or advice in said


@pytest.mark.slow
@pytest.mark.parametrize("taken", ["kite.profile.json", "kite.profile.png"])
def test_learn_replaces_a_file_only_when_that_is_asked_for(repo: Path, taken: str) -> None:
    (repo / taken).write_text("mine")
    line = ("learn", repo / "front", "-o", repo / "kite.profile.json")
    code, said = run(*line)
    assert code == 1 and f"{taken}: exists already" in said and "--overwrite" in said
    assert {path.name for path in repo.glob("kite*")} == {taken}
    assert (repo / taken).read_text() == "mine"
    code, said = run(*line, "--overwrite")
    assert code == 0 and (repo / taken).read_bytes() != b"mine", said


@pytest.mark.slow
def test_learn_replaces_no_file_that_comes_while_it_learns(
    repo: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    learn = sources_profile.learn_from_files

    def learn_while_another_writes(*arguments: Any) -> Any:
        (repo / "kite.profile.json").write_text("mine")
        return learn(*arguments)

    monkeypatch.setattr(sources_profile, "learn_from_files", learn_while_another_writes)
    code, said = run("learn", repo / "front", "-o", repo / "kite.profile.json")
    assert code == 1 and "kite.profile.json: exists already" in said
    assert (repo / "kite.profile.json").read_text() == "mine"
    assert {path.name for path in repo.glob("kite*")} == {"kite.profile.json"}


@pytest.mark.parametrize("preset", ["endless_candle", "windy_torch"])
def test_the_ready_recipes_check_with_their_samples(preset: str) -> None:
    code, said = run("check", shipped("recipes") / f"{preset}.yaml")
    assert code == 0, said

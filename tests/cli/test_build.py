"""``build`` as people, scripts and build systems run it."""

import json
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from subprocess import CompletedProcess

import numpy as np
import pytest

from fire_atlas.core.interruption import MESSAGE
from tests.support.synthetic_fire import write_video

Run = Callable[..., CompletedProcess[str]]


def events(result: CompletedProcess[str]) -> list[dict[str, object]]:
    return [json.loads(line) for line in result.stdout.splitlines()]


def test_a_build_goes_to_the_folder_build_beside_the_recipe(run: Run, campfire: Path) -> None:
    result = run("build", campfire.name)
    assert result.returncode == 0
    assert (campfire.parent / "build" / "campfire.png").is_file()
    assert result.stdout.startswith("campfire.yaml: 4 files in build (")


def test_o_chooses_the_folder(run: Run, campfire: Path) -> None:
    assert run("build", campfire.name, "-o", "assets/fire").returncode == 0
    assert (campfire.parent / "assets" / "fire" / "campfire.json").is_file()
    assert not (campfire.parent / "build").exists()


def test_a_second_build_has_nothing_to_do_unless_forced(run: Run, campfire: Path) -> None:
    page = campfire.parent / "build" / "campfire.png"
    run("build", campfire.name)
    written = page.stat().st_mtime_ns
    assert run("build", campfire.name).stdout == "campfire.yaml: up to date\n"
    assert page.stat().st_mtime_ns == written
    assert "4 files" in run("build", campfire.name, "--force").stdout
    assert page.stat().st_mtime_ns > written


def test_without_a_terminal_stages_are_plain_lines(run: Run, campfire: Path) -> None:
    result = run("build", campfire.name)
    assert "campfire.yaml: render (6)\n" in result.stderr
    assert "\x1b" not in result.stderr + result.stdout


def test_quiet_says_nothing_and_verbose_names_the_files(run: Run, campfire: Path) -> None:
    quiet = run("build", campfire.name, "-q")
    assert (quiet.stdout, quiet.stderr) == ("", "")
    verbose = run("build", campfire.name, "-v", "--force")
    assert f"  {Path('build') / 'campfire.png'}\n" in verbose.stdout
    assert "  render: " in verbose.stdout


def test_the_frames_of_a_video_are_counted_as_they_are_decoded(run: Run, campfire: Path) -> None:
    frames = [np.full((32, 32, 4), 40 * i, np.uint8) for i in range(6)]
    write_video(campfire.with_name("fire.mp4"), frames, "libx264", "yuv420p", {"crf": "5"}, rate=12)
    chosen = ("--set", "source={path: fire.mp4, crop: auto}")
    stated = events(run("build", campfire.name, "--json", *chosen))
    for stage in "look for the flame", "decode":
        seen = [event for event in stated if event.get("stage") == stage]
        assert {event["total"] for event in seen} == {6}
        assert (seen[0]["done"], seen[-1]["done"]) == (0, 6)


def test_json_lines_tell_a_program_everything(run: Run, campfire: Path) -> None:
    result = run("build", campfire.name, "--json")
    stated = events(result)
    render = [event for event in stated if event.get("stage") == "render"]
    assert (render[0]["done"], render[-1]["done"]) == (0, 6)
    assert {event["total"] for event in render} == {6}
    assert {event["recipe"] for event in stated} == {"campfire.yaml"}
    assert stated[-1]["event"] == "done"
    assert str(Path("build") / "campfire.png") in stated[-1]["files"]  # type: ignore[operator]
    assert set(stated[-1]) == {"event", "recipe", "fresh", "files", "timings", "statistics"}
    assert result.stderr == ""
    again = events(run("build", campfire.name, "--json"))[-1]
    assert again["fresh"] is True and again["timings"] == {}
    for key in ("files", "statistics"):
        assert again[key] == stated[-1][key] and again[key]
    frozen = events(run("build", campfire.name, "--json", "--frozen"))[-1]
    assert frozen == again


def test_json_lines_tell_of_errors_too(run: Run, campfire: Path) -> None:
    result = run("build", campfire.name, "--json", "--set", "flakes.rate=x")
    assert result.returncode == 2
    assert events(result) == [
        {
            "event": "error",
            "recipe": "campfire.yaml",
            "message": '--set flakes.rate: must be `auto` or a number; got "x"',
        }
    ]


def test_one_bad_recipe_does_not_stop_the_others(run: Run, campfire: Path) -> None:
    campfire.with_name("a.yaml").write_text("source: {path: clip}\nzzz: 1\n")
    campfire.with_name("b.yaml").write_text("source: {path: nowhere}\n")
    result = run("build", ".")
    assert result.returncode == 2
    assert "error: a.yaml:2: zzz: unknown key" in result.stderr
    assert "nowhere: does not exist" in result.stderr
    assert "campfire.yaml: 4 files in build" in result.stdout


def test_a_failed_build_alone_exits_with_1(run: Run, campfire: Path) -> None:
    campfire.write_text("source: {path: nowhere}\n")
    assert run("build", campfire.name).returncode == 1


def test_recipes_that_would_overwrite_each_other_are_not_built(run: Run, campfire: Path) -> None:
    campfire.with_name("b.yaml").write_text("source: {path: clip}\nname: campfire\n")
    result = run("build", ".")
    assert result.returncode == 2
    assert "would write the same files" in result.stderr
    assert not (campfire.parent / "build").exists()


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
@pytest.mark.parametrize("command", ["build", "check", "preview"])
def test_a_missing_recipe_is_bad_usage_and_a_missing_input_a_failure(
    run: Run, campfire: Path, command: str
) -> None:
    result = run(command, "none.yaml")
    assert result.returncode == 2 and "there is no such recipe file" in result.stderr
    (campfire.parent / "clip").rename(campfire.parent / "elsewhere")
    result = run(command, campfire.name)
    assert result.returncode == 1 and "clip: does not exist" in result.stderr


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_build_exits_with_130_and_leaves_things_as_they_were(
    run: Run, campfire: Path, environment: dict[str, str], number: signal.Signals
) -> None:
    run("build", campfire.name)
    before = {path: path.stat().st_mtime_ns for path in (campfire.parent / "build").rglob("*")}
    command = ["build", campfire.name, "--set", "source.height=1200", "--jobs", "1", "--json"]
    with subprocess.Popen(
        [sys.executable, "-m", "fire_atlas", *command],
        cwd=campfire.parent,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout is not None
        while '"stage"' not in process.stdout.readline():
            time.sleep(0.01)
        process.send_signal(number)
        out, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert err == f"error: {MESSAGE}\n"
    assert json.loads(out.splitlines()[-1])["event"] == "error"
    after = {path: path.stat().st_mtime_ns for path in (campfire.parent / "build").rglob("*")}
    assert after == before

"""Every bad recipe: exit code 2, advice on stderr, no traceback, nothing written."""

from collections.abc import Callable
from pathlib import Path
from subprocess import CompletedProcess

import pytest

Run = Callable[..., CompletedProcess[str]]

BOMB = "a: &a [1, 1, 1, 1, 1, 1, 1, 1, 1]\n" + "".join(
    f"{chr(98 + i)}: &{chr(98 + i)} [{', '.join(['*' + chr(97 + i)] * 9)}]\n" for i in range(12)
)

BAD = {
    "an unknown key": (
        b"source: {path: clip}\nflakes:\n  alhpa: 1\n",
        "error: bad.yaml:3: flakes.alhpa: unknown key; did you mean flakes.alpha?\n",
    ),
    "a wrong type": (
        b"source: {path: clip}\nflakes: {rate: many}\n",
        'error: bad.yaml:2: flakes.rate: must be `auto` or a number; got "many"\n',
    ),
    "a value out of range": (
        b"source: {path: clip}\nflakes: {life: [1, 99]}\n",
        "error: bad.yaml:2: flakes.life.1: must be at most 60; got 99\n",
    ),
    "no source": (
        b"seed: 3\n",
        "error: bad.yaml:1: source: is missing: where the fire comes from\n",
    ),
    "an alias bomb": (BOMB.encode(), "is too big for a recipe"),
    "another encoding": (
        "# glühend\nsource: {path: clip}\n".encode("latin-1"),
        "error: bad.yaml:1: byte 4 of the file is not UTF-8; save it as UTF-8\n",
    ),
    "a name that climbs": (
        b"source: {path: clip}\nname: ../x\n",
        "error: bad.yaml:2: name: must be a plain file name, not a path",
    ),
    "extending itself": (
        b"extends: ./bad.yaml\n",
        "error: bad.yaml:1: extends: goes round in a circle (bad.yaml -> bad.yaml)",
    ),
    "a key twice": (
        b"seed: 1\nsource: {path: clip}\nseed: 2\n",
        "error: bad.yaml:3: seed: stands here a second time, after line 1; keep one\n",
    ),
    "keys that exclude each other": (
        b"source: {path: clip}\natlas:\n  layout: grid\n  rotate: true\n",
        "error: bad.yaml:4: atlas.rotate: a grid shows every frame upright; use layout packed",
    ),
    "beyond a limit of what is written": (
        b"source: {path: clip}\nmaps:\n  motion: unity\n",
        "error: bad.yaml:3: maps.motion: unity motion vectors need a flipbook with cells of equal",
    ),
    "broken yaml": (b"source: {path: clip\n", "error: bad.yaml:2: is no valid YAML"),
}


@pytest.mark.parametrize("command", ["build", "build --dry-run", "check", "preview"])
@pytest.mark.parametrize(("text", "message"), BAD.values(), ids=BAD)
def test_a_bad_recipe_gets_advice_and_writes_nothing(
    run: Run, campfire: Path, command: str, text: bytes, message: str
) -> None:
    bad = campfire.with_name("bad.yaml")
    bad.write_bytes(text)
    before = sorted(campfire.parent.rglob("*"))
    result = run(*command.split(), "bad.yaml")
    assert result.returncode == 2
    assert message in result.stderr
    assert result.stdout == ""
    assert "Traceback" not in result.stderr
    assert sorted(campfire.parent.rglob("*")) == before


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("flakes.rate", "error: --set flakes.rate: must be key=value"),
        ("flakes.rate=many", 'error: --set flakes.rate: must be `auto` or a number; got "many"'),
        ("flakes.rtae=3", "error: --set flakes.rtae: unknown key; did you mean flakes.rate?"),
        ("flakes.rate=[", "error: --set flakes.rate: is no valid YAML"),
        ("name=../x", "error: --set name: must be a plain file name"),
        (
            "maps.motion=unity",
            "error: --set maps.motion: unity motion vectors need a flipbook",
        ),
    ],
)
def test_a_bad_set_is_named(run: Run, campfire: Path, override: str, message: str) -> None:
    result = run("build", campfire.name, "--set", override)
    assert result.returncode == 2
    assert message in result.stderr
    assert "Traceback" not in result.stderr
    assert not (campfire.parent / "build").exists()


def test_a_missing_recipe_is_named(run: Run) -> None:
    result = run("build", "none.yaml")
    assert (result.returncode, result.stdout) == (2, "")
    assert result.stderr == "error: none.yaml: there is no such recipe file\n"


def test_a_traceback_is_shown_only_when_asked_for(run: Run) -> None:
    result = run("build", "none.yaml", "-vv")
    assert "Traceback" in result.stderr
    assert result.stderr.endswith("error: none.yaml: there is no such recipe file\n")


def test_check_finds_a_source_that_is_not_there(run: Run, campfire: Path) -> None:
    result = run("check", campfire.name, "--set", "source.path=clop")
    assert result.returncode == 1
    assert result.stderr.startswith("error: --set source.path: ")
    assert "clip" in result.stderr

"""What a build would do, and what it depends on."""

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from subprocess import CompletedProcess

import pytest

Run = Callable[..., CompletedProcess[str]]


def tree_of(folder: Path) -> dict[Path, int]:
    return {path: path.stat().st_mtime_ns for path in folder.rglob("*")}


def spoil_output(recipe: Path) -> None:
    (recipe.parent / "build" / "campfire.png").write_bytes(b"")


def change_input(recipe: Path) -> None:
    frame = recipe.parent / "clip" / "0002.png"
    shutil.copy(recipe.parent / "clip" / "0004.png", frame)


def add_input(recipe: Path) -> None:
    shutil.copy(recipe.parent / "clip" / "0004.png", recipe.parent / "clip" / "0006.png")


CHANGES: list[tuple[Callable[[Path], object], str]] = [
    (lambda recipe: shutil.rmtree(recipe.parent / "build"), "holds no sound campfire.manifest"),
    (
        lambda recipe: recipe.write_text(recipe.read_text() + "seed: 5\n"),
        "the recipe says something",
    ),
    (change_input, "clip/0002.png has changed"),
    (add_input, "there are other inputs: clip/0006.png is new"),
    (lambda recipe: (recipe.parent / "clip" / "0005.png").unlink(), "clip/0005.png is gone"),
    (spoil_output, "campfire.png is missing, or not as it was written"),
]


@pytest.mark.parametrize(("change", "why"), CHANGES, ids=[why for _, why in CHANGES])
def test_a_dry_run_says_why_and_writes_nothing(
    run: Run, campfire: Path, change: Callable[[Path], object], why: str
) -> None:
    run("build", campfire.name, "-q")
    change(campfire)
    before = tree_of(campfire.parent)
    result = run("build", campfire.name, "--dry-run")
    assert result.returncode == 0
    assert result.stdout.startswith("campfire.yaml: would be built: ")
    assert why in result.stdout
    assert tree_of(campfire.parent) == before


def test_a_dry_run_of_what_is_up_to_date(run: Run, campfire: Path) -> None:
    run("build", campfire.name, "-q")
    assert run("build", campfire.name, "--dry-run").stdout == "campfire.yaml: up to date\n"
    forced = run("build", campfire.name, "--dry-run", "--force").stdout
    assert forced == "campfire.yaml: would be built: --force\n"
    told = json.loads(run("build", campfire.name, "--dry-run", "--json").stdout)
    assert told == {"event": "plan", "recipe": "campfire.yaml", "fresh": True, "why": None}


def test_a_dry_run_finds_what_is_wrong(run: Run, campfire: Path) -> None:
    campfire.write_text(campfire.read_text() + "zzz: 1\n")
    result = run("build", campfire.name, "--dry-run")
    assert result.returncode == 2
    assert "zzz: unknown key" in result.stderr


def rules_of(text: str) -> dict[str, list[str]]:
    """Read a depfile: targets, and what each needs."""
    rules = {}
    for line in text.replace("\\\n", " ").splitlines():
        if not line.strip():
            continue
        words, word, i = [], "", 0
        while i < len(line):
            if line[i : i + 2] in ("\\ ", "\\#", "$$"):
                word += line[i + 1]
                i += 1
            elif line[i] == " ":
                words += [word] if word else []
                word = ""
            else:
                word += line[i]
            i += 1
        words += [word] if word else []
        assert words[0].endswith(":")
        rules[words[0][:-1]] = words[1:]
    return rules


def test_a_depfile_names_all_that_is_read(run: Run, campfire: Path) -> None:
    campfire.with_name("base.yaml").write_text(campfire.read_text())
    (campfire.parent / "my.j2").write_text("{{ name }}")
    campfire.write_text("extends: base.yaml\nexports: [json, {template: my.j2, to: x.txt}]\n")
    run("build", campfire.name, "-q", "--depfile", "fire.d")
    rules = rules_of((campfire.parent / "fire.d").read_text())
    frames = [f"clip/{i:04}.png" for i in range(6)]
    needs = ["campfire.yaml", "base.yaml", *frames, "my.j2", "clip"]
    assert rules.pop("build/campfire.manifest.json") == needs
    assert rules == {need: [] for need in needs}


def test_a_depfile_is_written_for_what_is_up_to_date_and_not_for_what_failed(
    run: Run, campfire: Path
) -> None:
    campfire.with_name("bad.yaml").write_text("source: {path: nowhere}\n")
    run("build", campfire.name, "-q")
    result = run("build", ".", "-q", "--depfile", "fire.d")
    assert result.returncode == 1
    rules = rules_of((campfire.parent / "fire.d").read_text())
    assert [target for target, needs in rules.items() if needs] == ["build/campfire.manifest.json"]


@pytest.fixture
def awkward(campfire: Path) -> Path:
    """The recipe in a folder, with frames, whose names build systems have to be told with care."""
    folder = campfire.parent / "my $fire #1"
    folder.mkdir()
    (campfire.parent / "clip").rename(folder / "a clip $2 #3")
    moved = campfire.rename(folder / campfire.name)
    moved.write_text(moved.read_text().replace("path: clip", 'path: "a clip $2 #3"'))
    return moved


def test_spaces_dollars_and_hashes_are_escaped(run: Run, awkward: Path) -> None:
    run("build", f"{awkward.parent.name}/{awkward.name}", "-q", "--depfile", "fire.d")
    rules = rules_of((awkward.parent.parent / "fire.d").read_text())
    assert "my $fire #1/a clip $2 #3/0003.png" in rules["my $fire #1/build/campfire.manifest.json"]


def program(name: str) -> str:
    found = shutil.which(name)
    if found:
        return found
    if os.environ.get("CI"):
        pytest.fail(f"needs {name}")
    pytest.skip(f"needs {name}")


@pytest.mark.parametrize("system", ["make", "ninja"])
def test_build_systems_build_again_when_an_input_changes(
    system: str, awkward: Path, tmp_path: Path, environment: dict[str, str]
) -> None:
    """make and ninja read the depfile, with names that only escapes can tell."""
    command = [program(system)]
    # Both make one $ of two; the shell keeps it where a backslash stands before.
    recipe = "my \\$$fire #1/campfire.yaml"
    fire = f'"{sys.executable}" -m fire_atlas build "{recipe}" -q -o out --depfile fire.d'
    target = "out/campfire.manifest.json"
    if system == "make":
        rule = f"{target}:\n\t{fire}\n\techo built\n-include fire.d\n"
        (tmp_path / "Makefile").write_text(rule)
    else:
        rule = f"rule fire\n  command = {fire} && echo built\n  depfile = fire.d\n"
        (tmp_path / "build.ninja").write_text(f"{rule}build {target}: fire\n")

    def built() -> bool:
        ran = subprocess.run(
            command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=60,
            check=False,
        )  # fmt: skip
        assert ran.returncode == 0, ran.stdout + ran.stderr
        return "\nbuilt" in f"\n{ran.stdout}"

    assert built()
    assert not built()
    frame = awkward.parent / "a clip $2 #3" / "0001.png"
    frame.write_bytes((awkward.parent / "a clip $2 #3" / "0002.png").read_bytes())
    assert built()
    assert not built()
    frame.unlink()
    assert built(), "a frame that is gone is no missing file, but another clip"

"""What a build would do, and what it depends on."""

import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from subprocess import CompletedProcess

import pytest

Run = Callable[..., CompletedProcess[str]]

posix = pytest.mark.skipif(sys.platform == "win32", reason="names of POSIX")


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
    (lambda recipe: shutil.rmtree(recipe.parent / "build"), "holds no valid campfire.manifest"),
    (
        lambda recipe: recipe.write_text(recipe.read_text() + "seed: 5\n"),
        "the recipe has changed",
    ),
    (change_input, "clip/0002.png has changed"),
    (add_input, "the inputs differ: clip/0006.png is new"),
    (lambda recipe: (recipe.parent / "clip" / "0005.png").unlink(), "clip/0005.png is gone"),
    (spoil_output, "campfire.png is missing or was changed"),
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
    stated = json.loads(run("build", campfire.name, "--dry-run", "--json").stdout)
    assert stated == {"event": "plan", "recipe": "campfire.yaml", "fresh": True, "why": None}


def test_a_dry_run_finds_what_is_wrong(run: Run, campfire: Path) -> None:
    campfire.write_text(campfire.read_text() + "zzz: 1\n")
    result = run("build", campfire.name, "--dry-run")
    assert result.returncode == 2
    assert "zzz: unknown key" in result.stderr


def rules_of(text: str) -> dict[str, list[str]]:
    """Read a depfile: targets, and what each needs."""
    rules = {}
    for line in text.replace("\\\n", " ").splitlines():
        words = re.findall(r"(?:\\[ #:]|\$\$|[^ ])+", line)
        if words:
            target, *needs = [re.sub(r"\\([ #:])|\$(\$)", r"\1\2", word) for word in words]
            assert target.endswith(":")
            rules[target[:-1]] = needs
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


AWKWARD = ["100%", "my $fire #1/a:b back\\slash/it's [a] {b} ~c, d+e@f! feu de café"]
"""Names that build systems need escapes for. (The quote only make reads everywhere.)"""


def program(name: str) -> str:
    found = shutil.which(name)
    if found:
        return found
    if os.environ.get("CI"):
        pytest.fail(f"needs {name}")
    pytest.skip(f"needs {name}")


def build_system(
    system: str, folder: Path, environment: dict[str, str], out: str
) -> Callable[[], bool]:
    """Let make or ninja build ``campfire.yaml`` of a folder into ``out``.

    Returns a function that runs it, and returns whether it had anything to do.
    """
    command = program(system)
    fire = f'"{sys.executable}" -m fire_atlas build campfire.yaml -q -o {out} --depfile fire.d'
    target = f"{out}/campfire.manifest.json"
    if system == "make":
        rule = f"{target}:\n\t{fire}\n\techo built\n-include fire.d\n"
        (folder / "Makefile").write_text(rule)
    else:
        rule = f"rule fire\n  command = {fire} && echo built\n  depfile = fire.d\n"
        (folder / "build.ninja").write_text(f"{rule}build {target}: fire\n")

    def built() -> bool:
        ran = subprocess.run(
            [command], cwd=folder, env=environment, capture_output=True, text=True, timeout=60,
            check=False,
        )  # fmt: skip
        assert ran.returncode == 0, ran.stdout + ran.stderr
        return "\nbuilt" in f"\n{ran.stdout}"

    return built


@pytest.mark.slow
@posix
@pytest.mark.parametrize("system", ["make", "ninja"])
@pytest.mark.parametrize("name", AWKWARD)
def test_build_systems_build_again_when_an_input_changes(
    system: str, name: str, campfire: Path, tmp_path: Path, environment: dict[str, str]
) -> None:
    """make and ninja read the depfile, with names that only escapes can tell."""
    if system == "ninja":
        name = name.replace("'", "")
    clip = campfire.parent / name
    clip.parent.mkdir(parents=True, exist_ok=True)
    (campfire.parent / "clip").rename(clip)
    campfire.write_text(campfire.read_text().replace("path: clip", f"path: {json.dumps(name)}"))
    built = build_system(system, tmp_path, environment, "out")
    assert built()
    assert not built()
    (clip / "0001.png").write_bytes((clip / "0002.png").read_bytes())
    assert built()
    assert not built()
    if system == "ninja" or "%" not in name:
        (clip / "0005.png").unlink()
        assert built(), "a frame that is gone is no missing file, but another clip"


@pytest.mark.slow
@posix
@pytest.mark.parametrize("system", ["make", "ninja"])
@pytest.mark.parametrize("touched", ["clip/0001.png", "campfire.yaml", "clip"])
def test_build_systems_have_nothing_to_do_after_an_input_was_touched(
    system: str, touched: str, campfire: Path, tmp_path: Path, environment: dict[str, str]
) -> None:
    runs = build_system(system, tmp_path, environment, "build")
    assert runs() and not runs()
    manifest = tmp_path / "build/campfire.manifest.json"
    before = manifest.read_bytes()
    (tmp_path / touched).touch()
    assert runs(), "it cannot know yet that the content is the same"
    assert not runs()
    assert manifest.read_bytes() == before


def test_only_a_build_gives_the_manifest_the_time_of_a_touched_input(
    run: Run, campfire: Path
) -> None:
    run("build", campfire.name, "-q")
    manifest = campfire.parent / "build" / "campfire.manifest.json"
    first = tree_of(campfire.parent)
    run("build", campfire.name, "-q")
    assert tree_of(campfire.parent) == first
    later = max(first.values()) + 10**9
    os.utime(campfire.parent / "clip" / "0002.png", ns=(later, later))
    touched = tree_of(campfire.parent)
    for option in ("--dry-run", "--frozen"):
        assert run("build", campfire.name, "-q", option).returncode == 0
        assert tree_of(campfire.parent) == touched
    assert "up to date" in run("build", campfire.name).stdout
    assert tree_of(campfire.parent) == {**touched, manifest: later}


@posix
@pytest.mark.parametrize(
    "name", ["a\tb", "a\fb", "a\vb", "a;b", "a=b", "a|b", "a\nb", "a\\", "a\\ b", "a&", "a:"]
)
def test_names_that_no_depfile_can_tell_are_refused(run: Run, campfire: Path, name: str) -> None:
    template = campfire.with_name(f"{name}")
    template.write_text("{{ name }}")
    export = json.dumps({"template": name, "to": "x.txt"})
    campfire.write_text(campfire.read_text() + f"exports: [{export}]\n")
    result = run("build", campfire.name, "-q", "--depfile", "fire.d")
    assert result.returncode == 1
    assert "rename it" in result.stderr
    assert not (campfire.parent / "fire.d").exists()


@pytest.mark.parametrize(
    "name",
    ["campfire.yaml", "clip/0003.png", "build/campfire.png", "build/campfire.manifest.json"],
)
def test_a_depfile_overwrites_no_input_and_no_output(run: Run, campfire: Path, name: str) -> None:
    run("build", campfire.name, "-q")
    before = (campfire.parent / name).read_bytes()
    result = run("build", campfire.name, "--force", "--depfile", name)
    assert result.returncode == 1
    assert f"{name}: is not a depfile" in result.stderr
    assert (campfire.parent / name).read_bytes() == before


@posix
@pytest.mark.skipif(not shutil.which("make"), reason="needs make")
@pytest.mark.parametrize("name", [".IGNORE", ".ONESHELL", ".SECONDEXPANSION", ".DEFAULT"])
def test_names_that_are_orders_to_make_are_names_in_a_depfile(
    run: Run, campfire: Path, name: str
) -> None:
    campfire.with_name(name).write_text("{{ name }}")
    export = json.dumps({"template": name, "to": "x.txt"})
    campfire.write_text(campfire.read_text() + f"exports: [{export}]\n")
    assert run("build", campfire.name, "-q", "--depfile", "fire.d").returncode == 0
    text = campfire.with_name("fire.d").read_text()
    assert f"  {name}" in text and f"\n{name}:" not in text
    campfire.with_name("Makefile").write_text("all:\n\t@false\n\t@echo went on\ninclude fire.d\n")
    made = subprocess.run(
        ["make"], cwd=campfire.parent, capture_output=True, text=True, check=False
    )
    assert made.returncode == 2 and "went on" not in made.stdout


def test_a_file_that_begins_with_an_empty_line_is_no_depfile(run: Run, campfire: Path) -> None:
    notes = campfire.with_name("notes.txt")
    notes.write_text("\nmine\n")
    assert run("build", campfire.name, "--depfile", "notes.txt").returncode == 1
    assert notes.read_text() == "\nmine\n"


def test_a_depfile_does_not_overwrite_what_the_same_build_wrote(run: Run, campfire: Path) -> None:
    result = run("build", campfire.name, "--depfile", "build/campfire.json")
    assert result.returncode == 1
    assert "is not a depfile" in result.stderr
    assert json.loads((campfire.parent / "build" / "campfire.json").read_text())["frames"]


def test_a_depfile_overwrites_an_earlier_one(run: Run, campfire: Path) -> None:
    for frames in ("4", "3"):
        options = ("--set", f"source.count={frames}", "--depfile", "fire.d")
        assert run("build", campfire.name, "-q", *options).returncode == 0
    needs = rules_of((campfire.parent / "fire.d").read_text())["build/campfire.manifest.json"]
    assert "clip/0002.png" in needs
    assert "clip/0003.png" not in needs

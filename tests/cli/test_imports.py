"""Commands that need no pixels must start fast: nothing heavy is imported for them."""

import subprocess
import sys
from pathlib import Path

import pytest

HEAVY = ("cv2", "numpy", "PIL", "scipy", "rich")


def imported(arguments: list[str], cwd: Path, environment: dict[str, str]) -> set[str]:
    """Return the modules a fresh interpreter has after running the command."""
    code = (
        "import sys\n"
        "from fire_atlas.cli import main\n"
        "try: code = main(sys.argv[1:])\n"
        "except SystemExit as error: code = error.code\n"
        "assert not code, code\n"
        "print('MODULES', *sys.modules)"
    )
    output = subprocess.run(
        [sys.executable, "-c", code, *arguments],
        cwd=cwd,
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    return set(output.rpartition("MODULES ")[2].split())


@pytest.mark.parametrize(
    ("arguments", "unwanted"),
    [
        (["--help"], (*HEAVY, "pydantic", "yaml", "shutil", "dataclasses")),
        (["build", "--help"], (*HEAVY, "pydantic", "yaml", "shutil", "dataclasses")),
        (["check", "campfire.yaml"], ("rich", "scipy")),
        (["schema"], HEAVY),
        (["clean", "campfire.yaml"], (*HEAVY, "pydantic")),
        (["init"], (*HEAVY, "pydantic")),
    ],
    ids=" ".join,
)
def test_light_commands_import_nothing_heavy(
    campfire: Path, environment: dict[str, str], arguments: list[str], unwanted: tuple[str, ...]
) -> None:
    modules = imported(arguments, campfire.parent, environment)
    assert "fire_atlas.cli" in modules
    assert modules.isdisjoint(unwanted)


def test_a_recipe_that_is_invalid_is_refused_without_anything_heavy(
    campfire: Path, environment: dict[str, str]
) -> None:
    campfire.write_text("source: {path: clip, fsp: 3}\n")
    code = (
        "import sys\nfrom fire_atlas.cli import main\n"
        "print(main(['check', 'campfire.yaml']), *sys.modules)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=campfire.parent, env=environment, capture_output=True, text=True, check=True,
    )  # fmt: skip
    exit_code, *modules = done.stdout.split()
    assert exit_code == "2" and set(modules).isdisjoint(HEAVY)


def test_the_package_itself_imports_nothing_heavy(environment: dict[str, str]) -> None:
    code = "import sys, fire_atlas; print(*sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True
    )
    assert set(done.stdout.split()).isdisjoint((*HEAVY, "pydantic", "yaml", "argparse"))


def test_a_build_with_nothing_to_do_imports_nothing_heavy(
    campfire: Path, environment: dict[str, str]
) -> None:
    assert "cv2" in imported(["build", campfire.name, "-q"], campfire.parent, environment)
    for options in ([], ["--dry-run"], ["--depfile", "fire.d"]):
        modules = imported(["build", campfire.name, "-q", *options], campfire.parent, environment)
        assert modules.isdisjoint((*HEAVY, "pydantic"))

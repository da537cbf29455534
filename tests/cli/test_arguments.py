"""What the command line understands, and what it says when it does not."""

from collections.abc import Callable
from pathlib import Path
from subprocess import CompletedProcess

import pytest

from fire_atlas import __version__
from fire_atlas.cli import main
from fire_atlas.cli.arguments import parse

Run = Callable[..., CompletedProcess[str]]


def test_version_and_help_succeed(run: Run) -> None:
    assert run("--version").stdout == f"fire-atlas {__version__}\n"
    stated = run("--help")
    assert stated.returncode == 0
    for command in ("build", "check", "init", "watch", "clean", "preview", "inspect", "schema"):
        assert f"\n    {command} " in stated.stdout
        assert run(command, "--help").returncode == 0


def test_recipes_and_options_may_stand_in_any_order() -> None:
    args = parse(["build", "a.yaml", "-o", "out", "b.yaml", "--set", "seed=1", "--set", "x=2"])
    assert args.recipes == [Path("a.yaml"), Path("b.yaml")]
    assert args.out == Path("out")
    assert args.overrides == ["seed=1", "x=2"]


def test_what_stands_behind_two_dashes_is_no_option() -> None:
    args = parse(["build", "a.yaml", "-q", "--", "-x.yaml", "--force"])
    assert args.recipes == [Path("a.yaml"), Path("-x.yaml"), Path("--force")]
    assert args.quiet and not args.force


def test_recipes_whose_names_begin_with_a_dash_are_built(run: Run, campfire: Path) -> None:
    text = campfire.read_text()
    for name in ("-x", "-y"):
        campfire.with_name(f"{name}.yaml").write_text(f"{text}name: fire{name}\n")
    result = run("build", "-q", "--", "-x.yaml", "-y.yaml")
    assert (result.returncode, result.stdout, result.stderr) == (0, "", "")
    built = campfire.parent / "build"
    assert (built / "fire-x.png").is_file() and (built / "fire-y.png").is_file()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["biuld"], "there is no command biuld; did you mean build?"),
        (["my.fire"], "there is no command my.fire; did you mean fire-atlas build my.fire?"),
        (["zzz"], "there is no command zzz; commands are build, check,"),
        (["fire.yaml"], "did you mean fire-atlas build fire.yaml?"),
        (["-q", "build"], "-q: put options after the command, like fire-atlas build -q"),
        (["build"], "the following arguments are required: RECIPE"),
        (["build", "a.yaml", "--jbos", "3"], "there is no option --jbos; did you mean --jobs?"),
        (["build", "a.yaml", "--dry-rn"], "there is no option --dry-rn; did you mean --dry-run?"),
        (["build", "a.yaml", "--jobs", "0"], "must be a whole number from 1; got 0"),
        (["build", "a.yaml", "-q", "-v"], "not allowed with argument -q"),
        (["build", "a.yaml", "--forc"], "there is no option --forc; did you mean --force?"),
        (["inspect", "a.json", "b.json"], "one argument too many: b.json"),
        (["preview", "a.json", "--gif", "--apng"], "not allowed with argument --gif"),
    ],
)
def test_bad_usage_is_explained_with_exit_code_2(
    capsys: pytest.CaptureFixture[str], arguments: list[str], message: str
) -> None:
    assert main(arguments) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("error: ")
    assert message in err


def test_a_reader_that_stops_early_causes_no_traceback(
    environment: dict[str, str], tmp_path: Path
) -> None:
    import subprocess
    import sys

    command = [sys.executable, "-m", "fire_atlas", "schema"]
    with subprocess.Popen(
        command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.close()
        assert process.stderr.read() == b""

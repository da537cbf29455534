"""``completion``: what a shell offers."""

import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from subprocess import CompletedProcess

import pytest

Run = Callable[..., CompletedProcess[str]]


def offered(script: Path, *words: str) -> list[str]:
    """Return what bash offers for the last of ``words``."""
    line = (
        f"source {script}; COMP_WORDS=({' '.join(words)}); COMP_CWORD={len(words) - 1}; "
        f'_shtab_fire_atlas; printf "%s\\n" "${{COMPREPLY[@]}}"'
    )
    done = subprocess.run(
        ["bash", "-c", line], cwd=script.parent, capture_output=True, text=True, check=True
    )
    return done.stdout.split()


@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash")
def test_bash_completes_commands_options_and_files(run: Run, tmp_path: Path) -> None:
    script = tmp_path / "completion.bash"
    script.write_text(run("completion", "bash").stdout)
    (tmp_path / "torch.yaml").touch()
    assert offered(script, "fire-atlas", "in") == ["init", "inspect"]
    assert offered(script, "fire-atlas", "inspect", "a.json", "--fl") == ["--flakes"]
    assert offered(script, "fire-atlas", "build", "to") == ["torch.yaml"]
    assert offered(script, "fire-atlas", "completion", "f") == ["fish"]


@pytest.mark.parametrize("shell", ["zsh", "fish"])
def test_other_shells_get_a_script_with_all_commands(run: Run, shell: str) -> None:
    result = run("completion", shell)
    assert result.returncode == 0
    for word in ("build", "inspect", "completion", "flakes"):
        assert word in result.stdout


def test_a_shell_that_is_not_known_is_refused(run: Run) -> None:
    assert run("completion", "tcsh").returncode == 2

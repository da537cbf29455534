"""Recipes that share the pages of another: each is read once, and errors are located in it."""

from collections import Counter
from io import BufferedReader
from pathlib import Path
from typing import Any

import pytest

from fire_atlas.core import files
from tests.support.repo import Repo

MEMBERS = ("torch.yaml", "candle.yaml")


@pytest.fixture
def host(repo: Repo) -> Path:
    """Return a recipe with two members, one of which extends a third file."""
    repo.clip()
    repo.recipe("torch.yaml", flakes="none")
    repo.recipe("base.yaml")
    (repo.folder / "candle.yaml").write_text("extends: base.yaml\nflakes: none\n")
    return repo.recipe("fire.yaml", flakes="none", atlas={"members": list(MEMBERS)})


@pytest.fixture
def reads(monkeypatch: pytest.MonkeyPatch) -> Counter[str]:
    """Count how often each file is opened, by its name."""
    count: Counter[str] = Counter()
    opened = files.open_file

    def counting(path: Path) -> BufferedReader:
        count[path.name] += 1
        return opened(path)

    monkeypatch.setattr(files, "open_file", counting)
    return count


def assert_read_once(reads: Counter[str]) -> None:
    names = ("fire.yaml", "base.yaml", *MEMBERS)
    assert {name: reads[name] for name in names} == dict.fromkeys(names, 1)


def test_a_first_build_reads_each_recipe_once(repo: Repo, host: Path, reads: Counter[str]) -> None:
    assert repo.run("build", host).code == 0
    assert_read_once(reads)


@pytest.mark.parametrize(
    ("arguments", "is_up_to_date"),
    [
        ([], True),
        (["--dry-run"], True),
        (["--depfile", "fire.d"], True),
        (["--force"], False),
        (["--force", "--dry-run"], False),
        (["--set", "seed=2"], False),
    ],
)
def test_a_build_after_a_build_reads_each_recipe_once(
    repo: Repo,
    host: Path,
    reads: Counter[str],
    monkeypatch: pytest.MonkeyPatch,
    arguments: list[str],
    is_up_to_date: bool,
) -> None:
    monkeypatch.chdir(repo.folder)
    repo.built(host)
    reads.clear()
    ran = repo.run("build", host, *arguments)
    assert (ran.code, ran.is_up_to_date) == (0, is_up_to_date)
    assert_read_once(reads)


def test_a_check_reads_each_recipe_once(repo: Repo, host: Path, reads: Counter[str]) -> None:
    assert repo.run("check", host).code == 0
    assert_read_once(reads)


@pytest.mark.parametrize("is_built", [False, True])
def test_a_pass_of_watch_reads_each_recipe_once(
    repo: Repo,
    host: Path,
    reads: Counter[str],
    monkeypatch: pytest.MonkeyPatch,
    is_built: bool,
) -> None:
    def interrupted(*_: Any, **__: Any) -> None:
        raise KeyboardInterrupt

    if is_built:
        repo.built(host)
    reads.clear()
    monkeypatch.setattr("watchfiles.watch", interrupted)
    assert repo.run("watch", host).code == 130
    assert_read_once(reads)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (None, "torch.yaml: there is no such recipe file"),
        ("source: {path: clip}\nseed: [", "torch.yaml:3: is no valid YAML"),
        ("source: {path: clip}\n\nsede: 1", "torch.yaml:3: sede: unknown key; did you mean seed?"),
        ("extends: gone.yaml", "torch.yaml:1: extends: there is no recipe file"),
        ("atlas: {members: [base.yaml]}", "fire.yaml:1: atlas.members.0: has members itself"),
        ("source: {path: clip}\nname: candle", "fire.yaml:1: atlas.members.1: another effect"),
    ],
)
@pytest.mark.parametrize("is_built", [False, True])
def test_what_is_wrong_in_a_member_is_located(
    repo: Repo, host: Path, is_built: bool, text: str | None, message: str
) -> None:
    if is_built:
        repo.built(host)
    member = repo.folder / "torch.yaml"
    member.unlink()
    if text is not None:
        member.write_text(text)
    for command in (["build"], ["build", "--dry-run"], ["check"]):
        ran = repo.run(*command, host)
        assert ran.code == 2
        assert message in ran.err


def test_a_recipe_whose_member_is_gone_can_still_be_cleaned(repo: Repo, host: Path) -> None:
    assert "fire.png" in repo.built(host)
    (repo.folder / "torch.yaml").unlink()
    assert repo.run("clean", host).code == 0
    assert not any(repo.build.iterdir())

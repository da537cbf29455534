"""Input that is odd, but no reason to break: it works, or a line says what would be right."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from tests.support.repo import Repo, command, contents, environment, run_alone, script


def scenery(height: int, width: int) -> NDArray[np.uint8]:
    """Return an opaque picture without black."""
    return np.random.default_rng(width).integers(60, 256, (height, width, 3), np.uint8)


def packing(repo: Repo, file: str, kind: str) -> Path:
    """Write a recipe that packs the folder ``sprites`` as ``b``."""
    recipe = repo.folder / file
    recipe.write_text(
        f"name: b\nsource: {{kind: {kind}, path: sprites}}\nflakes: none\nmotion_blur: none\n",
        encoding="utf-8",
    )
    return recipe


def assert_advised(repo: Repo, text: str, *words: str) -> None:
    recipe = repo.folder / "fire.yaml"
    recipe.write_text(text, encoding="utf-8")
    for name in ("build", "check"):
        ran = repo.run(name, recipe)
        assert ran.code == 2 and "bug in fire-atlas" not in ran.err, ran
        assert all(word in ran.err for word in words), ran.err


def test_opaque_sprites_of_different_sizes_are_packed(repo: Repo) -> None:
    repo.frames([scenery(30, 20), scenery(40, 50), scenery(33, 33)])
    built = repo.built(repo.recipe(source={"kind": "sprites", "path": "clip"}))
    with Image.open(repo.build / "fire.png") as page:
        assert np.asarray(page.convert("RGBA"))[..., 3].max() == 255
    assert {"fire.png", "fire.json"} <= built.keys()


def test_a_source_that_is_null_is_missing(repo: Repo) -> None:
    assert_advised(repo, "source: null\n", "fire.yaml:1: source: is missing")


def test_a_source_that_is_null_beside_members_is_none(repo: Repo) -> None:
    repo.clip()
    repo.recipe("torch.yaml", flakes="none")
    host = repo.folder / "fire.yaml"
    host.write_text("source: null\natlas: {members: [torch.yaml]}\n", encoding="utf-8")
    repo.built(host)
    assert repo.run("build", host).is_up_to_date


@pytest.mark.parametrize("block", ["source: {path: clip, fps: 1e-300}", "timeline: {fps: 1e-300}"])
def test_a_rate_near_zero_is_refused(repo: Repo, block: str) -> None:
    repo.clip()
    source = "" if block.startswith("source") else "source: {path: clip}\n"
    assert_advised(repo, f"{source}{block}\n", "fps: must be at least 0.01; got 1e-300")


@pytest.mark.parametrize(
    ("digits", "advice"), [(40, "must be at most 4294967295"), (9000, "is too large for any key")]
)
def test_a_seed_of_many_digits_is_refused(repo: Repo, digits: int, advice: str) -> None:
    repo.clip()
    seed = "0x" + "f" * digits
    text = f"source: {{path: clip}}\nseed: {seed}\n"
    assert_advised(repo, text, "fire.yaml:2: seed: ", advice)


def test_names_that_look_like_markup_are_shown_as_they_are(
    repo: Repo, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    repo.clip(count=1)
    sprites = repo.folder / "sprites"
    sprites.mkdir()
    names = ("[red]a[b_01", "[red]a[b_02", "[bold]c_01", "[bold]c_02")
    for name in names:
        (sprites / f"{name}.png").write_bytes((repo.folder / "clip" / "0000.png").read_bytes())
    recipe = packing(repo, "b[x].yaml", "sprites")
    repo.built(recipe)
    shown = repo.run("inspect", repo.build / "b.json").out
    assert "[red]a[b" in shown and "[bold]c" in shown


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="file names that are no text")
def test_names_that_are_no_text_are_packed_and_printed(repo: Repo) -> None:
    picture = (repo.clip(count=1) / "0000.png").read_bytes()
    sprites = repo.folder / "sprites"
    sprites.mkdir()
    for name in (b"\xffa_01.png", b"\xffa_02.png", b"b\xfe.png"):
        (sprites / os.fsdecode(name)).write_bytes(picture)
    recipe = packing(repo, "\udcff.yaml", "frames")
    ran = run_alone(command("build", recipe))
    assert ran.code == 0, ran.err
    assert "\\udcff.yaml" in ran.out
    assert run_alone(command("check", recipe)).code == 0


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="a shell of POSIX")
@pytest.mark.parametrize("streams", [">&-", "2>&-", "<&- >&- 2>&-", "> /dev/full"])
def test_a_command_without_its_streams_writes_the_same_files(
    repo: Repo, recipe: Path, streams: str
) -> None:
    before = contents(repo.build)
    line = " ".join(command("build", recipe, "--force", "-v"))
    ran = subprocess.run(
        ["sh", "-c", f"{line} {streams}"], env=environment(), capture_output=True, check=False
    )
    assert contents(repo.build) == before
    assert b"bug in fire-atlas" not in ran.stdout + ran.stderr
    assert ran.returncode == (1 if "full" in streams else 0)


DIES = """
import os, signal
from fire_atlas.sources import images
images.decode_bytes = lambda *_: os.kill(os.getpid(), signal.SIGSEGV)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_a_decoder_that_crashes_takes_no_output_with_it(repo: Repo, recipe: Path) -> None:
    before = contents(repo.build)
    ran = run_alone(script(DIES, "build", recipe, "--force"))
    assert ran.code < 0
    after = {path.name: path.read_bytes() for path in repo.build.iterdir() if path.is_file()}
    assert {name: after[name] for name in before} == before
    assert repo.run("build", recipe).code == 0

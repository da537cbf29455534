"""What would take more memory or time than anybody meant is refused, and the message says how."""

import struct
import zlib
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

from fire_atlas.cli.arguments import parse
from fire_atlas.core.workload import MAX_PIXELS
from tests.support.repo import Repo


def png_of(width: int, height: int) -> bytes:
    """Return a PNG that says it is of this size, and holds no pixels."""
    head = b"IHDR" + struct.pack(">IIBBBBB", width, height, 8, 6, 0, 0, 0)
    data = struct.pack(">I", 13) + head + struct.pack(">I", zlib.crc32(head))
    return b"\x89PNG\r\n\x1a\n" + data


def test_a_huge_picture_is_refused_before_it_is_decoded(repo: Repo) -> None:
    (repo.folder / "huge.png").write_bytes(png_of(10_000, 10_000))
    ran = repo.run("build", repo.recipe(path="huge.png"))
    assert ran.code == 1 and "--limit-pixels 100000000" in ran.err
    allowed = repo.run("build", repo.recipe(path="huge.png"), "--limit-pixels", "100000000")
    assert "--limit-pixels" not in allowed.err and "truncated" in allowed.err


def gif(repo: Repo) -> dict[str, Any]:
    frames = [Image.new("L", (40, 30), 40 * i) for i in range(4)]
    frames[0].save(repo.folder / "a.gif", save_all=True, append_images=frames[1:])
    return {"path": "a.gif"}


def sheet(repo: Repo) -> dict[str, Any]:
    Image.new("RGBA", (40, 30)).save(repo.folder / "a.png")
    return {"path": "a.png", "grid": {"columns": 2, "rows": 1}}


def folder(repo: Repo) -> dict[str, Any]:
    repo.clip(height=80)
    return {"path": "clip"}


def texture(repo: Repo) -> dict[str, Any]:
    repo.clip(count=12, height=80)
    return {"kind": "silk", "height": 24, "width": 20, "texture": {"path": "clip"}}


def learnt(repo: Repo) -> dict[str, Any]:
    repo.clip(count=12, height=80)
    return {"kind": "profile", "path": "clip"}


@pytest.mark.parametrize("source", [gif, sheet, folder, texture, learnt])
@pytest.mark.parametrize("packs", [True, False])
def test_the_limit_holds_for_every_kind_of_source(repo: Repo, source: Any, packs: bool) -> None:
    keys = {"flakes": "none", "motion_blur": "none"} if packs else {}
    recipe = repo.recipe(source=source(repo), **keys)
    for command in ("build", "preview"):
        ran = repo.run(command, recipe, "--limit-pixels", "1000")
        assert ran.code == 1 and "say --limit-pixels" in ran.err, ran
    assert not repo.build.exists() or not list(repo.build.iterdir())


def test_learning_has_the_limit_too(repo: Repo, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(repo.folder)
    ran = repo.run("learn", repo.clip(count=12, height=80), "--limit-pixels", "1000")
    assert ran.code == 1 and "say --limit-pixels" in ran.err
    assert not list(Path.cwd().glob("*.profile.json"))


def test_the_command_line_has_the_limit_of_the_sources() -> None:
    assert parse(["build", "fire.yaml"]).max_pixels == MAX_PIXELS

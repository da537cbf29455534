"""A game's repo: a folder with clips and recipes, and the command that is run there."""

import contextlib
import io
import json
import os
import random
import shutil
import subprocess
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from fire_atlas.cli import main
from fire_atlas.core.shipped import shipped

PACKAGE = Path(sys.modules["fire_atlas"].__file__ or "").resolve().parent


@dataclass(frozen=True, slots=True)
class Ran:
    """How a run of the command ended."""

    code: int
    out: str
    err: str

    @property
    def is_up_to_date(self) -> bool:
        return "up to date" in self.out


class Repo:
    def __init__(self, folder: Path) -> None:
        folder.mkdir(parents=True)
        self.folder = folder
        self.build = folder / "build"

    def clip(self, count: int = 6, height: int = 80, name: str = "clip", shuffle: int = 0) -> Path:
        """Write frames of the sample campfire into a folder of the repo, ``height`` px high."""
        folder = self.folder / name
        folder.mkdir()
        frames = list(enumerate(sorted((shipped("samples") / "campfire").glob("*.png"))[:count]))
        random.Random(shuffle).shuffle(frames)
        for i, source in frames:
            image = cv2.imread(str(source), cv2.IMREAD_UNCHANGED)
            assert image is not None
            size = (round(image.shape[1] * height / image.shape[0]), height)
            cv2.imwrite(
                str(folder / f"{i:04}.png"), cv2.resize(image, size, interpolation=cv2.INTER_AREA)
            )
        return folder

    def frames(self, images: list[NDArray[np.uint8]], name: str = "clip") -> Path:
        """Write frames of one's own into a folder of the repo."""
        folder = self.folder / name
        folder.mkdir()
        for i, image in enumerate(images):
            Image.fromarray(image).save(folder / f"{i:04}.png")
        return folder

    def recipe(self, name: str = "fire.yaml", path: str = "clip", **keys: Any) -> Path:
        """Write a recipe; JSON is YAML. ``source`` may be given whole."""
        recipe = self.folder / name
        recipe.write_text(json.dumps({"source": {"path": path}, **keys}), encoding="utf-8")
        return recipe

    def run(self, *arguments: str | Path) -> Ran:
        """Run ``fire-atlas`` in this process."""
        out, err = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            code = main([str(argument) for argument in arguments])
        return Ran(code, out.getvalue(), err.getvalue())

    def built(self, recipe: Path, *arguments: str | Path) -> dict[str, bytes]:
        """Build, expect success, and return the bytes of every output."""
        ran = self.run("build", recipe, *arguments)
        assert ran.code == 0, ran.err
        return contents(self.build)


def command(*arguments: str | Path) -> list[str]:
    """Return the command line of ``fire-atlas`` in a process of its own."""
    return [sys.executable, "-P", "-m", "fire_atlas", *map(str, arguments)]


def script(code: str, *arguments: str | Path) -> list[str]:
    """Return the command line that runs ``code``, then ``fire-atlas``, in one process."""
    run = "import sys; from fire_atlas.__main__ import main; sys.exit(main())"
    return [sys.executable, "-P", "-c", f"{code}\n{run}", *map(str, arguments)]


def environment(**changes: str) -> dict[str, str]:
    """Return an environment in which the package under test is found."""
    return {**os.environ, "PYTHONPATH": str(PACKAGE.parent), **changes}


def run_alone(line: list[str], **changes: str) -> Ran:
    """Run a command line in a process of its own."""
    done = subprocess.run(
        line, env=environment(**changes), capture_output=True, text=True, timeout=120, check=False
    )
    return Ran(done.returncode, done.stdout, done.stderr)


def contents(folder: Path) -> dict[str, bytes]:
    """Return every file in ``folder``, hidden ones too, and its bytes."""
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


def pages(build: Path, name: str) -> Iterator[tuple[dict[str, Any], NDArray[np.uint8]]]:
    """Yield the description and the picture of every page of an atlas."""
    first = json.loads((build / f"{name}.json").read_text(encoding="utf-8"))
    others = first["meta"].get("related_multi_packs", [])
    for text in [json.dumps(first), *((build / n).read_text(encoding="utf-8") for n in others)]:
        page = json.loads(text)
        with Image.open(build / page["meta"]["image"]) as image:
            yield page, np.asarray(image.convert("RGBA"))


def tracks_of(build: Path, name: str) -> Mapping[str, Any]:
    """Return the flake tracks of a build, refusing what is not plain JSON."""

    def refuse(constant: str) -> None:
        raise AssertionError(f"{constant} is no JSON")

    text = (build / f"{name}.flakes.json").read_text(encoding="utf-8")
    tracks: Mapping[str, Any] = json.loads(text, parse_constant=refuse)
    return tracks


def copy_of(folder: Path, to: Path) -> Path:
    """Copy a folder, without what was built in it."""
    shutil.copytree(folder, to, ignore=shutil.ignore_patterns("build"))
    return to

"""Spoilt input of every kind that is read, through the command: it works, or a line says why not.

A case is a few files and a command line, both chosen by (seed, number). It runs in a process of a
pool that is killed after ``SECONDS``; a process that dies counts as a fault of the case it ran.
One case in fifty also runs as a command of its own.
"""

import json
import multiprocessing
import os
import shutil
import subprocess
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from io import TextIOWrapper
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from tests.campaign import corpus
from tests.campaign.mutations import (
    Chance,
    Spoil,
    spoilt_bytes,
    spoilt_json,
    spoilt_png,
    spoilt_text,
)

_COUNT = 1_500
"""Cases of a whole campaign."""

SECONDS = 10
"""How long a case may take."""

MEMORY = 6 << 30
"""Bytes of address space that a case may use."""

ALONE = 50
"""Of so many cases, one is run as a command of its own as well."""

Choice = TypeVar("Choice")
Arguments = list[str]
Scene = Callable[[Path, Path, Chance], Arguments]
"""Puts spoilt files, made from a corpus, into a folder and returns the command that reads them."""


def run(count: int | None, seed: int) -> list[str]:
    """Run ``count`` cases, print how many ended how, and return those that show a fault."""
    count, faults = count or _COUNT, list[str]()
    if isinstance(sys.stdout, TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")
    with tempfile.TemporaryDirectory(prefix="fuzz-") as folder:
        base = Path(folder) / "corpus"
        _write_corpus(base)
        results = Counter[str]()
        for number, outcome in _outcomes(base, count, seed):
            results[f"{_kind(number)}: {outcome.word}"] += 1
            if outcome.is_fault:
                faults.append(f"case {number} ({_kind(number)}): {outcome.word}\n{outcome.said}")
    for name, times in sorted(results.items()):
        print(f"{times:7} {name}")
    return faults


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of a case: a word, and for a fault what was said."""

    word: str
    said: str = ""

    @property
    def is_fault(self) -> bool:
        """Whether the case ended as none should."""
        return self.word not in ("worked", "refused")


def outcome_of(code: int, said: str) -> Outcome:
    """Judge how a command ended."""
    if "bug in fire-atlas" in said or "Warning: " in said or code not in (0, 1, 2):
        return Outcome("broke", said[-3000:])
    if code and "error: " not in said:
        return Outcome("said nothing", said[-3000:])
    return Outcome("refused" if code else "worked")


def run_case(base: Path, seed: int, number: int) -> Outcome:
    """Run one case in this process, in a folder of its own."""
    with tempfile.TemporaryDirectory(prefix="fuzz-") as name:
        folder = Path(name)
        arguments = SCENES[_kind(number)](base, folder, np.random.default_rng([seed, number]))
        try:
            outcome = outcome_of(*corpus.command(*arguments, "-vv"))
        except BaseException:
            return Outcome("escaped", traceback.format_exc()[-3000:])
        if outcome.is_fault or number % ALONE:
            return outcome
        return _run_alone(arguments)


def _run_alone(arguments: Arguments) -> Outcome:
    line = [sys.executable, "-m", "fire_atlas", *arguments]
    done = subprocess.run(line, capture_output=True, text=True, errors="replace", check=False)
    said = done.stdout + done.stderr
    if "Traceback" in said:
        return Outcome("showed a traceback", said[-3000:])
    return outcome_of(done.returncode, said)


def _kind(number: int) -> str:
    return list(SCENES)[number % len(SCENES)]


# The corpus, and what is made of it.


def _write_corpus(base: Path) -> None:
    for name in ("images", "videos"):
        (base / name).mkdir(parents=True)
    corpus.write_images(base / "images")
    corpus.write_videos(base / "videos")
    corpus.write_build(base)
    corpus.write_profile(base)
    plain = Path(_recipe(base, source={"path": "clip", "fps": 12}))
    code, text = corpus.command("check", plain, "--resolved")
    assert code == 0, text
    (base / "resolved.yaml").write_text(text, encoding="utf-8")


PACKS = {"flakes": "none", "motion_blur": "none"}


def _recipe(folder: Path, **keys: Any) -> str:
    path = folder / "case.yaml"
    path.write_text(json.dumps(keys), encoding="utf-8")
    return str(path)


def _spoil(source: Path, to: Path, spoil: Spoil, chance: Chance) -> str:
    to.write_bytes(spoil(source.read_bytes(), chance))
    return str(to)


def _one_of(chance: Chance, *choices: Choice) -> Choice:
    return choices[int(chance.integers(0, len(choices)))]


def recipe(base: Path, folder: Path, chance: Chance) -> Arguments:
    """Every key, as text, as bytes, or as values."""
    (folder / "clip").symlink_to(base / "clip")
    spoil = _one_of(chance, spoilt_text, spoilt_bytes)
    source = base / _one_of(chance, "resolved.yaml", "fire.yaml")
    path = _spoil(source, folder / "case.yaml", spoil, chance)
    return _one_of(chance, ["check", path, "--resolved"], ["build", path, "--dry-run"])


def recipe_values(base: Path, folder: Path, chance: Chance) -> Arguments:
    """Every key with odd values."""
    import yaml

    (folder / "clip").symlink_to(base / "clip")
    values = json.dumps(yaml.safe_load((base / "resolved.yaml").read_bytes())).encode()
    path = folder / "case.yaml"
    path.write_bytes(spoilt_json(values, chance))
    return _one_of(chance, ["check", str(path), "--resolved"], ["build", str(path), "--dry-run"])


def packing(base: Path, folder: Path, chance: Chance) -> Arguments:
    """A recipe that only packs, with odd values, built."""
    shutil.copytree(base / "clip", folder / "clip")
    atlas = {"max_size": 256, "padding": 2, "pivot": "base", "scales": [1, 0.5], "trim": "frame"}
    frames = {"path": "clip", "fps": 12, "start": 0, "count": 3, "height": 20}
    sprites = {
        "kind": "sprites", "path": ["clip/*.png"], "names": "path", "animations": "auto",
        "rates": {"packing": 12}, "pivots": {"0000": [0, 1]}, "borders": {"0000": [1, 2, 1, 0]},
    }  # fmt: skip
    source: dict[str, Any] = _one_of(
        chance,
        {"source": frames, "timeline": {"fps": 12, "frames": 3}, **PACKS},
        {"source": sprites},
    )
    keys = {
        **source, "atlas": atlas, "seed": 1,
        "exports": [_one_of(chance, "json", "unity", "godot", "css", "tpsheet", "phaser")],
    }  # fmt: skip
    path = Path(_recipe(folder, **keys))
    path.write_bytes(spoilt_json(path.read_bytes(), chance))
    return ["build", str(path)]


def override(base: Path, folder: Path, chance: Chance) -> Arguments:
    """A value on the command line."""
    path = _recipe(folder, source={"path": str(base / "clip")})
    text = _one_of(chance, b"flakes.rate=80", b"flakes.life=[1, 2]", b"source.fps=1e1")
    spoilt = _one_of(chance, spoilt_text, spoilt_bytes)(text, chance)
    return ["check", path, "--set", spoilt.decode(errors="replace").replace("\0", "?")]


def image(base: Path, folder: Path, chance: Chance) -> Arguments:
    """A still or an animation, in any format."""
    source = _one_of(chance, *sorted((base / "images").iterdir()))
    spoil = _one_of(chance, spoilt_bytes, spoilt_png) if source.suffix == ".png" else spoilt_bytes
    _spoil(source, folder / source.name, spoil, chance)
    grid = {"grid": {"columns": 2, "rows": 2}} if chance.random() < 0.1 else {}
    effect = PACKS if chance.random() < 0.8 else {}
    return ["build", _recipe(folder, source={"path": source.name, **grid}, **effect)]


def video(base: Path, folder: Path, chance: Chance) -> Arguments:
    """A film, in any container."""
    source = _one_of(chance, *sorted((base / "videos").iterdir()))
    _spoil(source, folder / source.name, spoilt_bytes, chance)
    return ["build", _recipe(folder, source={"path": source.name}, **PACKS)]


def profile(base: Path, folder: Path, chance: Chance) -> Arguments:
    """What was learnt of a fire."""
    spoil = _one_of(chance, spoilt_json, spoilt_bytes)
    _spoil(base / "fire.profile.json", folder / "fire.profile.json", spoil, chance)
    source = {"kind": "profile", "path": "fire.profile.json", "slices": 2, "particles": 8}
    keys = {**PACKS, "source": {**source, "height": 24}, "timeline": {"frames": 4}}
    return ["build", _recipe(folder, **keys)]


def built(name: str, *spoils: Spoil) -> Scene:
    """Return the scene in which one file of a build is spoilt, and the rest looked at."""

    def scene(base: Path, folder: Path, chance: Chance) -> Arguments:
        shutil.copytree(base / "build", folder / "build")
        for path in (base / "clip", base / "fire.yaml"):
            (folder / path.name).symlink_to(path)
        _spoil(base / "build" / name, folder / "build" / name, _one_of(chance, *spoils), chance)
        atlas, recipe = str(folder / "build" / "fire.json"), str(folder / "fire.yaml")
        if name == "fire.manifest.json":
            return _one_of(
                chance, ["inspect", atlas], ["clean", recipe], ["build", recipe, "--dry-run"]
            )
        return _one_of(
            chance, ["inspect", atlas], ["inspect", atlas, "--context"], ["preview", atlas],
            ["preview", atlas, _one_of(chance, "--gif", "--webp", "--apng", "--sheet")],
        )  # fmt: skip

    return scene


TEMPLATE = b"""{% for page in pages %}{{ page.file }} {{ page.width }}x{{ page.height }}
{% for frame in page.frames %}{{ frame.name | upper }} = {{ frame.x + 1 }} , {{ frame.y }}
{% if frame.trimmed and not frame.rotated %} {{ name | replace ( "a" , "b" ) | identifier }}
{% endif %}{% endfor %}{% endfor %}{{ animations | map ( attribute = "name" ) | join ( "," ) }}
"""


def template(base: Path, folder: Path, chance: Chance) -> Arguments:
    """A user's template, and the name it gives."""
    spoil = _one_of(chance, spoilt_text, spoilt_bytes)
    (folder / "list.j2").write_bytes(spoil(TEMPLATE, chance))
    to = spoilt_text(b"{{ name }} . {{ scale }}.txt", chance) if chance.random() < 0.3 else b"a.txt"
    exports = [{"template": "list.j2", "to": to.decode(errors="replace")}]
    still = {"path": str(base / "clip" / "0000.png")}
    return ["build", _recipe(folder, source=still, exports=exports, **PACKS)]


SCENES: dict[str, Scene] = {
    "recipe": recipe, "values of a recipe": recipe_values, "packing": packing,
    "override": override, "image": image, "more images": image, "video": video,
    "profile": profile, "atlas": built("fire.json", spoilt_json, spoilt_bytes),
    "tracks": built("fire.flakes.json", spoilt_json, spoilt_bytes),
    "manifest": built("fire.manifest.json", spoilt_json, spoilt_bytes),
    "page": built("fire.png", spoilt_bytes, spoilt_png), "template": template,
}  # fmt: skip


# The pool.


@dataclass(slots=True)
class _Worker:
    """A process that runs one case after the other.

    Attributes:
        number: The case it runs; None while it has none.
        until: When it has to have answered.
    """

    base: Path
    seed: int
    number: int | None = None
    until: float = 0.0
    connection: Connection = field(init=False)
    process: Any = field(init=False)

    def __post_init__(self) -> None:
        self.start()

    def start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self.connection, other = context.Pipe()
        arguments = (other, self.base, self.seed)
        self.process = context.Process(target=_serve, args=arguments, daemon=False)
        self.process.start()
        other.close()
        self.connection.recv()  # it is ready

    def ask(self, number: int) -> None:
        self.number, self.until = number, time.monotonic() + SECONDS
        if number % ALONE == 0:
            self.until += SECONDS
        self.connection.send(number)

    def answer(self) -> Outcome | None:
        """Return what became of its case; None while it runs. After a fault it starts afresh."""
        if self.connection.poll():
            try:
                outcome: Outcome = self.connection.recv()
            except EOFError:
                self.process.join()
                outcome = Outcome(f"died ({self.process.exitcode})")
                self.start()
            return outcome
        if time.monotonic() < self.until:
            return None
        self.process.kill()
        self.process.join()
        self.start()
        return Outcome(f"took more than {SECONDS} s")

    def stop(self) -> None:
        self.connection.close()
        self.process.join()


def _outcomes(base: Path, count: int, seed: int) -> Iterator[tuple[int, Outcome]]:
    """Run all cases in a pool; yield the number and the outcome of each as it ends."""
    numbers = iter(range(count))
    workers = [_Worker(base, seed) for _ in range(min(count, os.cpu_count() or 1))]
    for worker in workers:
        worker.ask(next(numbers))
    busy = list(workers)
    while busy:
        wait([worker.connection for worker in busy], timeout=0.2)
        for worker in list(busy):
            outcome = worker.answer()
            if outcome is None or worker.number is None:
                continue
            yield worker.number, outcome
            following = next(numbers, None)
            if following is None:
                busy.remove(worker)
                worker.stop()
            else:
                worker.ask(following)


def _serve(connection: Connection, base: Path, seed: int) -> None:
    """Answer with what becomes of each case that is asked for, until nobody asks any more."""
    import resource

    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    corpus.command("check", base / "fire.yaml")  # imports what most cases need
    sys.stderr = open(os.devnull, "w", encoding="utf-8")  # noqa: PTH123, SIM115
    connection.send(None)
    while True:
        try:
            number = connection.recv()
        except EOFError:
            return
        connection.send(run_case(base, seed, number))

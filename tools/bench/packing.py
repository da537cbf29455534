"""How densely pages are packed, beside the packers that users would otherwise pick.

Run it from the checkout: ``python -m tools.bench.packing [seeds]``. The peers are installed into a
temporary folder (PyPI: rectpack, PyTexturePacker; npm: free-tex-packer-core, maxrects-packer) and
leave with it. Prints a table for each question, and exits 1 unless fire-atlas

- covers .975 of a page at gap 0 and .94 at gap 2, on the mean of the seeds, in 3 s each;
- needs no more pages of 1024 px than any of the others;
- packs 3,000 sprites in 10 s;
- is denser than all of the others in every row.
"""

import json
import subprocess
import sys
import tempfile
import time
import venv
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from fire_atlas.atlas.pack import pack
from fire_atlas.atlas.page_rules import PageRules, Size
from tools.bench.scene import argument

HERE = Path(__file__).parent
PYPI = ("rectpack==0.2.2", "PyTexturePacker==1.2.1")
NPM = ("free-tex-packer-core@0.3.9", "maxrects-packer@2.7.4")
OURS = "fire-atlas"

Answers = dict[str, dict[str, Any]]


class Question(NamedTuple):
    """Some sprites, and the pages they are to go on."""

    sizes: list[Size]
    max: int
    gap: int
    rotate: bool = False
    slow: bool = False


def sprites(seed: int, count: int = 300) -> list[Size]:
    """Widths and heights log-normal (mean of the logarithm 4.2, σ .55), 8 to 300 px."""
    drawn = np.random.default_rng(seed).lognormal(4.2, 0.55, (count, 2))
    return [(int(w), int(h)) for w, h in np.clip(np.rint(drawn), 8, 300)]


def sprites_about(side: int, seed: int) -> list[Size]:
    """300 sprites of a median width and height, px."""
    drawn = np.random.default_rng(seed).lognormal(np.log(side), 0.55, (300, 2))
    return [(int(w), int(h)) for w, h in np.clip(np.rint(drawn), side / 8, side * 4)]


def few_large_many_small(seed: int) -> list[Size]:
    """The sizes that ask most of a packer that never goes back."""
    chance = np.random.default_rng(seed)
    large, small = chance.integers(200, 500, (12, 2)), chance.integers(6, 40, (250, 2))
    return [(int(w), int(h)) for w, h in np.concatenate([large, small])]


def frames_of_a_fire(seed: int) -> list[Size]:
    """Trimmed frames of one clip: much alike."""
    drawn = np.random.default_rng(seed).normal((180, 290), (14, 12), (48, 2))
    return [(int(w), int(h)) for w, h in drawn]


class Peers:
    """The other packers, installed where they are forgotten again."""

    def __init__(self, folder: Path) -> None:
        venv.create(folder / "venv", with_pip=True)
        self.python = folder / "venv/bin/python"
        self.folder = folder
        install = [str(self.python), "-m", "pip", "install", "--quiet", *PYPI]
        subprocess.run(install, check=True, capture_output=True)
        (folder / "package.json").write_text('{"private": true}')
        npm = ["npm", "install", "--silent", "--no-audit", "--no-fund", "--ignore-scripts", *NPM]
        subprocess.run(npm, check=True, cwd=folder)

    def answers(self, question: Question) -> Answers:
        asked = json.dumps(question._asdict()).encode()
        lines: list[list[str | Path]] = [
            [self.python, HERE / "packing_peers.py"],
            ["node", HERE / "packing_peers.mjs", self.folder / "node_modules"],
        ]
        known: Answers = {}
        for line in lines:
            ran = subprocess.run(line, input=asked, capture_output=True, check=True)
            known |= json.loads(ran.stdout)
        return known


def ours(question: Question) -> Answers:
    rules = PageRules(question.max, padding=question.gap, rotate=question.rotate)
    start = time.perf_counter()
    pages = pack(question.sizes, [range(len(question.sizes))], rules).pages
    return {OURS: {"pages": pages, "seconds": time.perf_counter() - start}}


def occupancy(question: Question, answer: dict[str, Any]) -> float:
    area: int = sum(w * h for w, h in answer["pages"])
    return sum(w * h for w, h in question.sizes) / area


def compare(title: str, questions: list[Question], peers: Peers) -> dict[str, list[float]]:
    """Print who covers how much on how many pages; return (occupancy, pages, seconds) by name."""
    print(f"\n{title}")
    rows: dict[str, list[tuple[float, int, float]]] = {}
    for question in questions:
        for name, answer in (ours(question) | peers.answers(question)).items():
            row = occupancy(question, answer), len(answer["pages"]), answer["seconds"]
            rows.setdefault(name, []).append(row)
    means = {name: list(np.mean(row, axis=0)) for name, row in rows.items()}
    for name, (covered, pages, seconds) in means.items():
        print(f"  {name:24} {covered:.4f} {pages:5.2f} pages {seconds:8.2f} s", flush=True)
    return means


def is_densest(means: dict[str, list[float]]) -> bool:
    """Whether nobody needs fewer pages, or as few and covers more of them."""
    mine = means[OURS]
    return all((mine[1], -mine[0]) <= (pages, -covered) for covered, pages, _ in means.values())


def main() -> int:
    seeds = range(argument(1, 6))
    with tempfile.TemporaryDirectory() as folder:
        peers = Peers(Path(folder))

        def run(
            title: str, make: Callable[[int], list[Size]], most: int, gap: int, **more: bool
        ) -> dict[str, list[float]]:
            questions = [Question(make(seed), most, gap, **more) for seed in seeds]
            return compare(title, questions, peers)

        tight = run("300 sprites, gap 0", sprites, 2048, 0, slow=True)
        spaced = run("300 sprites, gap 2", sprites, 2048, 2, slow=True)
        all_rows = [
            tight,
            spaced,
            run("300 sprites, gap 2, turned where that helps", sprites, 2048, 2, rotate=True),
            run("300 sprites, gap 2, pages of at most 1024 px", sprites, 1024, 2),
            run("12 large and 250 small sprites, gap 2", few_large_many_small, 2048, 2),
            run("48 trimmed frames of a fire, gap 2", frames_of_a_fire, 4096, 2),
        ]
    print("\n300 sprites by their median side, at gaps 0 and 2")
    for side in (16, 32, 64, 128, 256):
        questions = (Question(sprites_about(side, seeds[0]), 8192, gap) for gap in (0, 2))
        bare, apart = (occupancy(question, ours(question)[OURS]) for question in questions)
        print(f"  {side:4} px: {bare:.3f} {apart:.3f}")
    print("\n3,000 sprites, gap 2")
    times = []
    for most in (2048, 8192):
        question = Question(sprites(0, 3000), most, 2)
        answer = ours(question)[OURS]
        times.append(answer["seconds"])
        covered, count = occupancy(question, answer), len(answer["pages"])
        print(f"  at most {most} px: {covered:.4f} {count:5} pages {answer['seconds']:8.2f} s")
    kept = (
        tight[OURS][0] >= 0.975,
        spaced[OURS][0] >= 0.94,
        max(tight[OURS][2], spaced[OURS][2]) < 3,
        max(times) < 10,
        all(map(is_densest, all_rows)),
    )
    print("\nkept" if all(kept) else f"\nnot kept: {kept}")
    return 0 if all(kept) else 1


if __name__ == "__main__":
    sys.exit(main())

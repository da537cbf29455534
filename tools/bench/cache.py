"""How long a shared cache takes to give back 60 builds, whole and with damaged entries.

Run it from the checkout: ``python -m tools.bench.cache [recipes]`` (default: 60, the ready recipes
with other seeds; 13 take about a minute).

Fills a cache by building all recipes, with ``--jobs 2``, then builds them into empty folders:

- from the whole cache, three times; prints the best time. Exits 1 if 60 take more than 4 s, or
  fewer a share of that beside the start of the tool.
- with 5 % of the entries damaged, each in another way, and then again.

Exits 1 too if any byte of any output differs from the one that the first build wrote.
"""

import hashlib
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from fire_atlas.core.shipped import shipped

BOUND, BOUND_RECIPES, START = 4.0, 60, 1.0
"""Seconds that so many recipes may take, of which so many for what a process does only once."""

TOOL = [sys.executable, "-m", "fire_atlas"]


def make_recipes(folder: Path, count: int) -> None:
    """Write ``count`` recipes that extend the ready ones in turn, each with a seed of its own."""
    names = sorted(path.stem for path in shipped("recipes").glob("*.yaml"))
    for i in range(count):
        name = names[i % len(names)]
        text = f"extends: {name}\nname: {name}_{i}\nseed: {i}\n"
        (folder / f"{name}_{i}.yaml").write_text(text, encoding="utf-8")


def built(recipes: Path, out: Path, cache: Path) -> float:
    """Build all recipes into a folder that does not exist yet; return the seconds."""
    line = [
        *TOOL,
        "build",
        str(recipes),
        "-o",
        str(out),
        "--cache",
        str(cache),
        "--jobs",
        "2",
        "-v",
    ]
    start, before = time.perf_counter(), os.times()
    done = subprocess.run(line, capture_output=True, text=True, check=False)
    seconds, after = time.perf_counter() - start, os.times()
    processor = sum(after[2:4]) - sum(before[2:4])  # of children, user and system
    if done.returncode:
        raise SystemExit(done.stderr)
    hits, misses = (done.stderr.count(f"cache: {result}") for result in ("hit", "miss"))
    took = f"{seconds:8.2f} s, {processor:.2f} s of processor time"
    print(f"{took}: {hits} hits, {misses} misses", flush=True)
    return seconds


def digests(out: Path) -> dict[str, str]:
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in out.iterdir()}


def damage(cache: Path, share: float) -> int:
    """Damage some entries: flip a bit, cut off the end, overwrite a block, or empty the file."""
    entries = sorted(cache.glob("*.tar"))
    chance = random.Random(1)
    chosen = chance.sample(entries, max(1, round(share * len(entries))))
    for i, path in enumerate(chosen):
        data = bytearray(path.read_bytes())
        at = chance.randrange(1024, len(data) - 10240)
        match i % 4:
            case 0:
                data[at] ^= 1
            case 1:
                del data[at:]
            case 2:
                data[at : at + 512] = bytes(512)
            case _:
                data.clear()
        path.write_bytes(data)
    return len(chosen)


def main() -> int:
    count = int(sys.argv[1]) if len(sys.argv) > 1 else BOUND_RECIPES
    with tempfile.TemporaryDirectory() as name:
        work = Path(name)
        recipes, cache, out = work / "recipes", work / "cache", work / "out"
        recipes.mkdir()
        make_recipes(recipes, count)
        print(f"{count} recipes: built, and the cache filled")
        built(recipes, out, cache)
        expected = digests(out)
        size = sum(path.stat().st_size for path in cache.iterdir())
        print(f"{len(expected)} files; a cache of {size / 2**20:.0f} MiB gives them back")
        times, same = [], True
        for _ in range(3):
            shutil.rmtree(out)
            times.append(built(recipes, out, cache))
            same &= digests(out) == expected
        print(f"{damage(cache, 0.05)} entries damaged")
        for _ in range(2):
            shutil.rmtree(out)
            built(recipes, out, cache)
            same &= digests(out) == expected
    bound = START + (BOUND - START) * count / BOUND_RECIPES
    print(
        f"best {min(times):.2f} s, bound {bound:.2f} s; {'same bytes' if same else 'OTHER BYTES'}"
    )
    return 0 if same and min(times) <= bound else 1


if __name__ == "__main__":
    sys.exit(main())

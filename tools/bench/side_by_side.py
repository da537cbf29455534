"""How long many recipes take side by side, and one at a time: the ready ones, with varied seeds.

Run it from the checkout: ``python -m tools.bench.side_by_side [recipes] [seconds]``, by default
60 recipes. Given ``seconds``, recipes that take more processor time are left out.

Builds each recipe by a command of its own, with one thread and with all, then all by one command,
then all again, which has nothing to do. Prints seconds and processor time of each, and exits 1
where bytes differ or a bound is missed.
"""

import itertools
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import yaml

from fire_atlas.core.shipped import shipped
from tests.support.repo import command, environment

SINGLE_THREADED, ALL_THREADS, FRESH_SECONDS = 0.6, 0.85, 1.0
"""Most wall time: shares of those of single builds with ``--jobs 1`` and by default, and s."""


@dataclass
class Spent:
    """Wall and processor time, s."""

    wall: float = 0.0
    cpu: float = 0.0


def cpu_seconds() -> float:
    """Return the processor time of all processes that have been waited for."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def run(spent: Spent, *arguments: str | Path) -> None:
    """Run a command, and add what it took."""
    began, before = time.perf_counter(), cpu_seconds()
    line = command(*arguments, "-q")
    subprocess.run(line, check=True, env=environment(), stdout=subprocess.DEVNULL)
    spent.wall += time.perf_counter() - began
    spent.cpu += cpu_seconds() - before


def write_recipes(folder: Path, count: int) -> list[Path]:
    """Copy the ready recipes with their samples, then vary their seeds until there are enough."""
    for preset in shipped("recipes").glob("*.yaml"):
        run(Spent(), "init", preset.stem, folder)
    ready = sorted(folder.glob("*.yaml"))
    recipes = list[Path]()
    for seed in range(-(-count // len(ready))):
        for path in ready[: count - len(recipes)]:
            recipe = folder / "many" / f"{path.stem}_{seed}.yaml"
            values = {"extends": f"../{path.name}", "name": recipe.stem, "seed": seed}
            recipe.parent.mkdir(exist_ok=True)
            recipe.write_text(yaml.safe_dump(values), encoding="utf-8")
            recipes.append(recipe)
    return recipes


def without_long_ones(recipes: list[Path], out: Path, longest: float) -> list[Path]:
    """Remove the recipes that take more than ``longest`` s of processor time."""
    kept = []
    for recipe in recipes:
        spent = Spent()
        run(spent, "build", recipe, "-o", out, "--jobs", "1")
        if spent.cpu <= longest:
            kept.append(recipe)
        else:
            recipe.unlink()
    return kept


def one_at_a_time(recipes: Sequence[Path], out: Path, *options: str) -> Spent:
    spent = Spent()
    for recipe in recipes:
        run(spent, "build", recipe, "-o", out, *options)
    return spent


def differing(a: Path, b: Path) -> list[str]:
    """Return the names of files that are not the same in both folders."""
    names = {path.name for path in itertools.chain(a.iterdir(), b.iterdir())}
    return sorted(
        name
        for name in names
        if not ((a / name).exists() and (b / name).exists())
        or (a / name).read_bytes() != (b / name).read_bytes()
    )


def main() -> int:
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 60
    longest = float(sys.argv[2]) if len(sys.argv) > 2 else 0.0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        recipes = write_recipes(folder, count)
        if longest:
            recipes = without_long_ones(recipes, folder / "trial", longest)
        rows = {
            "one at a time, --jobs 1": one_at_a_time(recipes, folder / "one", "--jobs", "1"),
            "one at a time": one_at_a_time(recipes, folder / "all"),
            "side by side": one_at_a_time([folder / "many"], folder / "many" / "build"),
            "again": one_at_a_time([folder / "many"], folder / "many" / "build"),
        }
        different = differing(folder / "one", folder / "many" / "build")
    return report(len(recipes), rows, different)


def report(count: int, rows: dict[str, Spent], different: list[str]) -> int:
    """Print the figures; return 1 where one misses its bound."""
    print(f"{count} recipes")
    single, default, together, again = rows.values()
    for name, spent in rows.items():
        print(
            f"{name:24}{spent.wall:8.1f} s wall {spent.cpu:8.1f} s cpu"
            f"{spent.wall / single.wall:6.2f} of --jobs 1{spent.wall / default.wall:6.2f} of all"
        )
    print(f"{len(different)} files differ {' '.join(different)}")
    passed = (
        together.wall <= SINGLE_THREADED * single.wall
        and together.wall <= ALL_THREADS * default.wall
        and together.cpu <= single.cpu
        and again.wall <= FRESH_SECONDS
        and not different
    )
    return 0 if passed else 1


if __name__ == "__main__":
    sys.exit(main())

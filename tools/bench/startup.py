"""How long a person waits for nothing: ``--help`` and a build that is up to date.

Run it from the checkout: ``python -m tools.bench.startup [runs]``.

Prints the best of all runs, in ms and as a multiple of an empty Python's start, measured in turns
so that all share the machine's moods. Exits 1 if ``--help`` takes more than 4 times as long as
an empty Python, or a no-op build more than 12 times.
"""

import subprocess
import sys
import tempfile
import time
from pathlib import Path

from fire_atlas.core.shipped import shipped

BOUNDS = {"--help": 4.0, "no-op build": 12.0}


def seconds(line: list[str]) -> float:
    start = time.perf_counter()
    subprocess.run(line, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return time.perf_counter() - start


def measure(runs: int, folder: Path) -> dict[str, float]:
    """Return the best time of each command line, s."""
    recipe = folder / "fire.yaml"
    recipe.write_text(f"source: {{path: '{shipped('samples') / 'campfire'}'}}\n", encoding="utf-8")
    tool = [sys.executable, "-m", "fire_atlas"]
    lines = {
        "python -c pass": [sys.executable, "-c", "pass"],
        "--help": [*tool, "--help"],
        "no-op build": [*tool, "build", str(recipe)],
    }
    seconds(lines["no-op build"])  # the one that does something
    best = dict.fromkeys(lines, float("inf"))
    for _ in range(runs):
        for name, line in lines.items():
            best[name] = min(best[name], seconds(line))
    return best


def main() -> int:
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else 30
    with tempfile.TemporaryDirectory() as folder:
        best = measure(runs, Path(folder))
    empty, passed = best["python -c pass"], True
    for name, took in best.items():
        bound = BOUNDS.get(name)
        passed &= bound is None or took <= bound * empty
        limit = f"  bound {bound:.0f} x" if bound else ""
        print(f"{name:16}{took * 1000:8.1f} ms {took / empty:6.2f} x{limit}")
    return 0 if passed else 1


if __name__ == "__main__":
    sys.exit(main())

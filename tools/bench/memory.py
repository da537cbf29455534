"""Memory of a long build: 299 frames of 640 x 640.

Run it from the checkout: ``python -m tools.bench.memory [frames] [side] [jobs]``.

Prints the peak of resident memory of a build in a process of its own, the bytes of its largest
page and of all its trimmed frames, and what is left without them. Exits 1 if that is more than
400 MB.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

from fire_atlas.core.cpu import default_jobs
from tools.bench.scene import Scene, argument, make_clip, make_recipe

BOUND = 400e6

_BUILD = """
import resource, sys
from fire_atlas.cli import main
code = main(sys.argv[1:])
unit = 1 if sys.platform == "darwin" else 1024
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit)
sys.exit(code)
"""


def peak(recipe: Path, jobs: int) -> int:
    """Return the most memory that building ``recipe`` took, bytes."""
    line = [sys.executable, "-c", _BUILD, "build", str(recipe), "-q", "--jobs", str(jobs)]
    done = subprocess.run(line, check=True, stdout=subprocess.PIPE, text=True)
    return int(done.stdout.split()[-1])


def page_bytes(recipe: Path) -> int:
    """Return the bytes of all pages of a build, uncompressed."""
    manifest = recipe.parent / "build" / f"{recipe.stem}.manifest.json"
    document = json.loads(manifest.read_text(encoding="utf-8"))
    return sum(4 * width * height for width, height in document["statistics"]["pages"])


def main() -> int:
    scene = Scene(1, argument(1, 299), argument(2, 640), 58, 0.42)
    with tempfile.TemporaryDirectory() as folder:
        recipe = make_recipe(make_clip(scene, Path(folder) / "clip"), rate=50)
        most, pages = peak(recipe, argument(3, default_jobs())), page_bytes(recipe)
    rest = most - pages
    print(f"peak {most / 1e6:.0f} MB, pages {pages / 1e6:.0f} MB, rest {rest / 1e6:.0f} MB")
    return 0 if rest <= BOUND else 1


if __name__ == "__main__":
    sys.exit(main())

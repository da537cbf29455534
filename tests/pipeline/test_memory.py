"""Memory does not grow with the length of a clip, but for its pages."""

import json
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.support.repo import Repo, run_alone, script

resource = pytest.importorskip("resource", reason="peaks of memory are known on POSIX only")

_TELL_PEAK = """
import atexit, resource
atexit.register(lambda: print("peak", resource.getrusage(resource.RUSAGE_SELF).ru_maxrss))
"""


def peak_without_pages(repo: Repo, recipe: Path) -> float:
    """Return the most memory a build takes besides its pages, in MB."""
    # By a shell: on Linux, the peak of the process that starts another counts as the other's too.
    by_shell = ["sh", "-c", '"$@"; exit $?', "sh"]
    ran = run_alone([*by_shell, *script(_TELL_PEAK, "build", recipe, "-q", "--jobs", "2")])
    assert ran.code == 0, ran.err
    peak = int(ran.out.split()[-1]) * (1 if sys.platform == "darwin" else 1024)
    manifest = json.loads((repo.build / f"{recipe.stem}.manifest.json").read_bytes())
    pages = manifest["statistics"]["pages"]
    return (peak - sum(4 * int(width) * int(height) for width, height in pages)) / 1e6


@pytest.mark.slow
def test_a_clip_ten_times_as_long_takes_hardly_more(repo: Repo) -> None:
    """Its 200 frames of 320 x 256, kept as floats, would take 260 MB."""
    clip = repo.clip(count=20, height=320)
    for i in range(20, 200):
        (clip / f"{i:04}.png").hardlink_to(clip / f"{i % 20:04}.png")
    keys: dict[str, Any] = {"tracks": [], "flakes": {"rate": 20}}
    short = repo.recipe("short.yaml", source={"path": "clip", "count": 20}, **keys)
    long = repo.recipe("long.yaml", **keys)
    assert peak_without_pages(repo, long) - peak_without_pages(repo, short) < 160

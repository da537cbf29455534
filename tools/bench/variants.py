"""Whether variants look like copies: how far apart the drawings are that two of them show.

``python -m tools.bench.variants ATLAS.json...`` prints of each fire of built atlases, and of each
pair of its variants as they are and with one mirrored, the distance of the two drawings that are
most alike, in median steps from frame to frame. A player may begin at any moment and play at a
speed of its own, so all drawings of both are compared: below ``LEAST`` two would look alike within
half a second of each other.
"""

import sys
from pathlib import Path

from tests.support.variants import pairs_of

LEAST = 0.25
"""Median steps up to which two drawings are the same, as ``timeline.variants`` has it."""


def main() -> int:
    """Print the tables; return 1 if two variants show the same drawing."""
    found = 0
    for path in map(Path, sys.argv[1:]):
        pairs = list(pairs_of(path))
        for pair in pairs:
            how = " mirrored" if pair.mirrored else ""
            print(f"| {path.stem} | {pair.one} | {pair.other}{how} | {pair.distance:.2f} |")
        same = sum(pair.distance <= LEAST for pair in pairs)
        print(f"{path.stem}: {len(pairs)} pairs, {same} of them show the same drawing")
        found += same
    return int(found > 0)


if __name__ == "__main__":
    raise SystemExit(main())

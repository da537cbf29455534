"""How like its clip generated fire is, and what it costs.

Run it from the checkout: ``python -m tests.bench.profile``. FIRE_ATLAS_CLIPS names the folder of
clips. The first table holds 240 frames in still air, at the clip's own rate, against the clip:

- ``ΔE``: largest CIEDE2000 of mean colours over the cells of the colour table;
- ``height``, ``width``: medians, generated over filmed; ``lean``: difference of the medians,
  degrees; ``spread``: standard deviations of the lean, generated over filmed;
- ``step``: 99th percentile of the difference of neighbouring frames, generated over filmed, and the
  largest;
- ``new``: the least difference of a frame from any frame of the clip, as a share of its light.

The second table has the processor time of a frame of 256 x 256 px against the number of slices of
100 particles (the paper's Figure 16). Exits 1 if a bound is missed.
"""

import os
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "profile"))

import numpy as np
from likeness import (
    REAL,
    asked,
    burnt,
    colour_error,
    learnt,
    look_at_clip,
    look_at_fire,
    nearest_input,
    real_clip,
)

from fire_atlas.core.workers import Workers

FRAMES = 240
SLICES = (1, 2, 4, 8, 12, 16, 24, 32)
LEAST_RATE = 30.0


def likeness(folder: Path) -> bool:
    """Print how like the clip of ``folder`` generated fire is; return whether it is enough."""
    clip = real_clip(folder)
    profile = learnt(clip)
    [fire] = burnt(profile, asked(FRAMES, clip.fps))
    seen, made = look_at_clip(clip), look_at_fire(fire, profile.front.threshold)
    colour = colour_error(seen.table, made.table)
    height, width = made.height / seen.height, made.width / seen.width
    lean = float(np.median(made.leans) - np.median(seen.leans))
    spread = float(made.leans.std() / seen.leans.std())
    ceiling = np.quantile(seen.steps, 0.99)
    step, most = np.quantile(made.steps, 0.99) / ceiling, made.steps.max() / ceiling
    new = min(nearest_input(frame, seen.frames) for frame in made.frames[:: FRAMES // 12])
    print(
        f"{folder.name:28} {colour:5.1f} {height:7.2f} {width:6.2f} {lean:6.1f} {spread:7.2f} "
        f"{step:6.2f} {most:6.2f} {new:6.2f}"
    )
    return bool(
        colour <= 10
        and abs(height - 1) <= 0.1
        and abs(width - 1) <= 0.1
        and abs(lean) <= 2
        and abs(spread - 1) <= 0.3
        and step <= 1
        and new > 0.02
    )


def cost(folder: Path) -> bool:
    """Print processor time against slices; return whether 12 slices are fast enough."""
    profile = learnt(real_clip(folder))
    fast = True
    for slices in SLICES:
        [fire] = burnt(profile, asked(48, 24.0, slices=slices), height=256)
        start, cpu = time.perf_counter(), time.process_time()
        with Workers(2) as workers:
            for _ in workers.map(fire.read, range(48)):
                pass
        wall, used = (time.perf_counter() - start) / 48, (time.process_time() - cpu) / 48
        print(f"{slices:6} {100 * slices:9} {1000 * used:9.1f} {1 / used:9.0f} {1 / wall:12.0f}")
        fast &= slices != 12 or max(1 / used, 1 / wall) >= LEAST_RATE
    print(f"(frames of {fire.width} x {fire.height} px)")
    return fast


def main() -> int:
    """Print both tables."""
    clips = Path(os.environ["FIRE_ATLAS_CLIPS"])
    print(f"{'clip':28} {'ΔE':>5} {'height':>7} {'width':>6} {'lean':>6} {'spread':>7} "
          f"{'step99':>6} {'most':>6} {'new':>6}")  # fmt: skip
    good = [likeness(clips / name) for name in REAL]
    print(f"\n{'slices':>6} {'particles':>9} {'ms (cpu)':>9} {'fps (cpu)':>9} {'fps (2 jobs)':>12}")
    good.append(cost(clips / "sim_unity_flame03"))
    return 0 if all(good) else 1


if __name__ == "__main__":
    sys.exit(main())

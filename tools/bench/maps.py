"""How near frames that were held out come, with the motion vectors a build writes.

Run it from the checkout: ``python -m tools.bench.maps [CLIP...] [--json]``. FIRE_ATLAS_CLIPS names
the folder of clips; those that are not there are left out.

Every other frame of a clip is dropped, a flipbook with vectors is built from the rest, and each
dropped frame is predicted from the files by the engine's own formula at blend 0.5. The figure is
the root mean square error against that of plain blending: 20 % means a fifth closer. Beside it,
the best of the three wrong choices of signs; what the build itself says of its vectors, from
frames that it held out of the half it had; and the same for the whole clip. ``seen`` is Unity's
gain where the build has the whole clip and drops every other frame itself, at half the rate
(``timeline.fps``), so that some of the frames that are predicted are those it held out.

Vectors must never be worse than plain blending where the build has the whole clip. Where it has
only half of it, a light that alternates with every frame, as that of the candle does, looks like
one that is steady: what no frame shows cannot be known, so that only the clips of ``LEAST`` are
held to a bound there.

Last, the time: user CPU ms a frame of 512 x 512 with and without ``maps.motion``, one worker.

Exits 1 if a clip misses its bound.
"""

import contextlib
import io
import json
import os
import shutil
import sys
import tempfile
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fire_atlas.atlas.encode import encode_frame
from fire_atlas.cli import main as fire_atlas
from fire_atlas.core.clip import Clip
from tests.support.clips import ALL_CLIPS, real_clip
from tests.support.flipbook import ENGINES, Picture, plain, read_flipbook

LEAST = {
    "sim_unity_flame02": 0.15,
    "sim_unity_flame03": 0.15,
    "cartoon_tauran_flame_sheet": 0.15,
    "cartoon_fluent_fire": 0.15,
}
"""Bounds of the gain; 0 for all others."""

SIGNED = 0.05
"""From this gain on, no other choice of signs may come closer."""

WRONG = (1, -1), (-1, 1), (-1, -1)


@dataclass(frozen=True, slots=True)
class Row:
    """What a clip gains, in parts of plain blending's error.

    Attributes:
        frames: Frames that were predicted.
        gain: By engine.
        wrong: Of the best wrong signs, by engine.
        seen: Of unity, where the build dropped the frames itself.
        measured: What the build said, of the half clip and of the whole one.
        scale: Largest motion, px a frame of the half clip.
    """

    frames: int
    gain: dict[str, float]
    wrong: dict[str, float]
    seen: float
    measured: tuple[float | None, float | None]
    scale: float


def measure(clips: Path, name: str, work: Path) -> Row:
    clip = real_clip(clips, name)
    frames = sorted((clips / name / "frames").iterdir())
    half = work / name / "half"
    half.mkdir(parents=True)
    for frame in frames[::2]:
        shutil.copy(frame, half / frame.name)
    gain, wrong, measured, scale = {}, {}, None, 0.0
    for engine in ENGINES:
        folder = build(half, engine, clip.fps / 2, clip.matte, work / name / engine)
        gain[engine], wrong[engine] = gains(folder, engine, clip)
        measured = reported_by(folder)
        scale = max(read_flipbook(folder, "fire").reading["strength"]["pixels"])
    whole = build(clips / name / "frames", "unity", clip.fps, clip.matte, work / name / "whole")
    dropped = build(
        clips / name / "frames", "unity", clip.fps, clip.matte, work / name / "dropped",
        timeline={"loop": "none", "fps": clip.fps / 2},
    )  # fmt: skip
    seen, _ = gains(dropped, "unity", clip)
    return Row((len(frames) - 1) // 2, gain, wrong, seen, (measured, reported_by(whole)), scale)


def gains(folder: Path, engine: str, clip: Clip) -> tuple[float, float]:
    """By how much of plain blending's error dropped frames are met, and by the best wrong signs."""
    book, play = read_flipbook(folder, "fire"), ENGINES[engine]
    error: dict[Any, float] = dict.fromkeys(["plain", (1, 1), *WRONG], 0.0)
    x, y, width, height = trim_of(folder)
    for middle in range(1, 2 * len(book.places) - 1, 2):
        truth = encode_frame(clip.read(middle), "premultiplied", "srgb").astype(np.float64)
        truth = truth[y : y + height, x : x + width]
        shown: dict[Any, Picture] = {"plain": plain(book, middle // 2, 0.5)}
        shown |= {signs: play(book, middle // 2, 0.5, signs) for signs in ((1, 1), *WRONG)}
        for way, cell in shown.items():
            error[way] += float(np.mean((book.frame_part(cell) - truth) ** 2))
    met = {way: 1 - np.sqrt(each / error["plain"]) for way, each in error.items()}
    return met[(1, 1)], max(met[signs] for signs in WRONG)


def build(
    frames: Path, engine: str, fps: float, matte: str, to: Path, **more: dict[str, Any]
) -> Path:
    to.mkdir(parents=True, exist_ok=True)
    recipe = to / "fire.yaml"
    keys = {
        "source": {"path": str(frames), "fps": fps, "matte": matte},
        "flakes": "none", "motion_blur": "none", "tracks": [], "maps": {"motion": engine},
        "atlas": {"layout": "grid", "alpha": "premultiplied", "max_size": 16384}, **more,
    }  # fmt: skip
    recipe.write_text(json.dumps(keys), encoding="utf-8")
    with (
        contextlib.redirect_stdout(io.StringIO()),
        contextlib.redirect_stderr(io.StringIO()) as err,
    ):
        code = fire_atlas(["build", str(recipe), "--force"])
    assert code == 0, err.getvalue()
    return to / "build"


def trim_of(folder: Path) -> tuple[int, int, int, int]:
    frames = json.loads((folder / "fire.json").read_text(encoding="utf-8"))["frames"]
    box = next(iter(frames.values()))["spriteSourceSize"]
    return box["x"], box["y"], box["w"], box["h"]


def reported_by(folder: Path) -> float | None:
    manifest = json.loads((folder / "fire.manifest.json").read_text(encoding="utf-8"))
    motion = manifest["statistics"]["motion"]
    return None if motion is None else float(motion["gain"])


def milliseconds(work: Path) -> tuple[float, float]:
    """CPU ms a frame at 512², without and with motion vectors."""
    from fire_atlas.core.shipped import shipped

    took = []
    for maps in ({}, {"motion": "unity"}):
        recipe = work / "time.yaml"
        keys = {
            "source": {"path": str(shipped("samples") / "campfire"), "height": 512, "fps": 24},
            "maps": maps, "tracks": [], "atlas": {"layout": "grid", "max_size": 16384},
        }  # fmt: skip
        recipe.write_text(json.dumps(keys), encoding="utf-8")
        best = np.inf
        for _ in range(2):
            start = time.process_time()
            with contextlib.redirect_stdout(io.StringIO()):
                assert fire_atlas(["build", str(recipe), "--force", "--jobs", "1", "-q"]) == 0
            best = min(best, time.process_time() - start)
        manifest = json.loads((work / "build" / "time.manifest.json").read_text(encoding="utf-8"))
        took.append(1000 * best / manifest["statistics"]["frames"])
    return took[0], took[1]


def missed(name: str, row: Row) -> list[str]:
    bound = LEAST.get(name, 0.0)
    return [
        *(
            f"{name}: {e} gains {g:.1%}, bound {bound:.0%}"
            for e, g in row.gain.items()
            if g < bound and name in LEAST
        ),
        *([f"{name}: gains {row.seen:.1%} where frames are seen"] if row.seen < bound else []),
        *(
            f"{name}: wrong signs come closer in {e}"
            for e, g in row.gain.items()
            if g > SIGNED and row.wrong[e] >= g
        ),
    ]


def main() -> int:
    folder = Path(os.environ.get("FIRE_ATLAS_CLIPS", ""))
    asked = [a for a in sys.argv[1:] if not a.startswith("-")] or ALL_CLIPS
    names = [n for n in asked if (folder / n / "meta.json").is_file()]
    if not names:
        print("FIRE_ATLAS_CLIPS does not name a folder of real clips")
        return 2
    with tempfile.TemporaryDirectory() as scratch:
        rows = {name: measure(folder, name, Path(scratch)) for name in names}
        took = milliseconds(Path(scratch))
    misses = [line for name, row in rows.items() for line in missed(name, row)]
    if "--json" in sys.argv[1:]:
        measured = {name: asdict(row) for name, row in rows.items()}
        print(json.dumps({"clips": measured, "milliseconds": took, "missed": misses}, indent=2))
    else:
        print_table(rows, took)
        print("\n".join(["", *(misses or ["all bounds are kept"])]))
    return 1 if misses else 0


def print_table(rows: dict[str, Row], took: tuple[float, float]) -> None:
    heads = "".join(
        f"{head:>10}" for head in (*ENGINES, "wrong", "seen", "measured", "whole", "px")
    )
    print(f"{'clip':34}{'frames':>8}{heads}")
    for name, row in rows.items():
        measured = "".join(f"{'-' if each is None else f'{each:.1%}':>10}" for each in row.measured)
        gains = "".join(f"{row.gain[engine]:10.1%}" for engine in ENGINES)
        wrong = max(row.wrong.values())
        print(
            f"{name:34}{row.frames:8}{gains}{wrong:10.1%}{row.seen:10.1%}{measured}{row.scale:10.1f}"
        )
    print(f"\nms a frame at 512 x 512: {took[0]:.1f} without vectors, {took[1]:.1f} with")


if __name__ == "__main__":
    sys.exit(main())

"""Samples and the ready recipes made from them: what an artist would see at first sight."""

import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from fire_atlas.cli import main
from fire_atlas.core.shipped import shipped
from tests.support.clips import open_clip
from tests.support.repo import run_alone, tracks_of

SAMPLES = Path(__file__).parents[1] / "samples"


def _pixels(path: Path) -> NDArray[np.int16]:
    files = sorted(path.glob("*.png")) if path.is_dir() else [path]
    return np.stack([np.asarray(Image.open(file).convert("RGBA")) for file in files]).astype("i2")


@pytest.mark.parametrize("name", ["candle", "pixel_flame.png", "crate.png"])
def test_a_sample_is_made_again_by_its_script(name: str, tmp_path: Path) -> None:
    """Processors round unlike; all else is the same."""
    made = run_alone([sys.executable, str(SAMPLES / "make_samples.py"), str(tmp_path), name])
    assert made.code == 0, made.err
    assert abs(_pixels(tmp_path / name) - _pixels(SAMPLES / name)).max() <= 1


def _feet(frame: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return the height at which the flame of each column of ``frame`` begins, frame heights."""
    lit = frame[::-1, :, 3] > 0.25
    columns = lit[: len(lit) // 4].any(axis=0)
    return np.asarray(lit[:, columns].argmax(axis=0)[4:-4] / len(lit))


def test_a_campfire_has_ragged_feet() -> None:
    clip, rough = open_clip("campfire"), list[float]()
    for number in range(0, clip.count, 4):
        feet = _feet(clip.read(number))
        places = np.arange(len(feet))
        bowl = np.polyval(np.polyfit(places, feet, 2), places)
        rough.append(float(np.std(feet - bowl)))
    assert np.median(rough) > 0.005


def test_the_flames_of_a_campfire_share_one_bed() -> None:
    """A row of separate flames looks like a comb."""
    clip, lit = open_clip("campfire"), list[float]()
    for number in range(0, clip.count, 4):
        shown = clip.read(number)[..., 3] > 0.25
        bottom = int(np.flatnonzero(shown.sum(axis=1) > 10).max())
        row = shown[bottom - round(0.03 * len(shown))]
        columns = np.flatnonzero(row)
        lit.append(float(row[columns[0] : columns[-1] + 1].mean()))
    assert np.median(lit) > 0.85


def test_sparks_of_the_ready_explosion_fly_out_of_it_and_do_not_hang_in_its_smoke(
    tmp_path: Path,
) -> None:
    recipe = shipped("recipes") / "explosion.yaml"
    small = ["--set", "source.size=draft", "--set", "source.resolution=draft"]
    assert main(["build", str(recipe), "--out", str(tmp_path), "-q", *small]) == 0
    tracks = tracks_of(tmp_path, "explosion")
    column = {name: number for number, name in enumerate(tracks["columns"])}
    lit = [np.array([r for r in f["rows"] if r[column["a"]] > 0.05]) for f in tracks["frames"]]
    counts = [len(rows) for rows in lit]
    assert max(counts) > 60
    assert max(counts[28:]) < 0.1 * max(counts)  # the last fire is out eight frames before
    flights: dict[float, list[np.ndarray]] = {}
    for row in np.concatenate([rows for rows in lit if len(rows)]):
        place = row[[column["x"], column["y"]]] / tracks["size"][1]
        flights.setdefault(row[column["id"]], []).append(place)
    ways = [float(np.hypot(*(flight[-1] - flight[0]))) for flight in flights.values()]
    assert np.median(ways) > 0.07, "carried by the gas, or as slow as those of a campfire, 0.04"

"""Clip → fire profile (Lee et al., III-A and III-B)."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import Pixels
from fire_atlas.core.workers import Workers
from fire_atlas.generators.profile.colours import ColourTable, colour_table
from fire_atlas.generators.profile.face import DRIFT_CELL, Face, learn_face
from fire_atlas.generators.profile.grid import Grid
from fire_atlas.generators.profile.measure import Measures, measure
from fire_atlas.generators.profile.model import Profile, Side, Spread, Statistics
from fire_atlas.generators.profile.pose import pose_of
from fire_atlas.generators.profile.segment import Fire, connected
from fire_atlas.generators.profile.states import leaning_sets
from fire_atlas.generators.profile.temper import tempered

CELLS = 5
"""Cells in a row and a column of the colour table, as in the paper."""

_SLOWEST, _FASTEST = 0.8, 4.0
"""Bounds of the rise, flame heights per second: a calm flame stands, its gases do not."""


@dataclass(frozen=True, slots=True)
class _Study:
    """A clip that has been measured."""

    clip: Clip
    fire: Fire
    measures: Measures


def learn(
    clips: Mapping[str, Clip], workers: Workers, threshold: float | None = None, cells: int = CELLS
) -> Profile:
    """Learn a profile from one clip, or from two whose cameras stood at a right angle.

    Args:
        clips: By what messages call them: the view from the front, then that from the right.
        workers: Who looks at the frames.
        threshold: Brightness (0..255) above which a pixel is flame; None: chosen from each clip.
        cells: Cells in a row and in a column of the colour table.

    Raises:
        SourceError: A clip shows no single, upright, whole flame.
    """
    studies = [_study(name, clip, workers, threshold) for name, clip in clips.items()]
    grid = Grid.around([study.measures for study in studies])
    sides = [_side(study, grid, workers) for study in studies]
    table = _table(studies[0], cells, workers)
    profile = Profile(
        grid=grid,
        rise=_rise(sides[0].face, grid),
        pace=1.0,
        colours=table,
        learnt=table,
        front=sides[0],
        side=sides[1] if len(sides) > 1 else None,
    )
    return tempered(profile, workers)


def _study(name: str, clip: Clip, workers: Workers, threshold: float | None) -> _Study:
    fire = Fire.of(clip, threshold)
    return _Study(clip, fire, measure(clip, fire, workers, name))


def _side(study: _Study, grid: Grid, workers: Workers) -> Side:
    clip, measures = study.clip, study.measures
    pose = pose_of(measures, study.measures.closed)
    points = measures.points
    return Side(
        fps=clip.fps,
        closed=study.measures.closed,
        threshold=study.fire.threshold,
        points=points,
        statistics=Statistics(
            height=Spread.of([each.height for each in points]),
            width=Spread.of([each.width for each in points]),
            lean=Spread.of(measures.leans),
            brightness=Spread.of(measures.light),
            step=round(measures.step, 4),
        ),
        sets=leaning_sets(measures.leans),
        face=learn_face(clip, study.fire, measures, pose, grid, workers),
    )


def _table(study: _Study, cells: int, workers: Workers) -> ColourTable:
    def seen(i: int) -> tuple[Pixels, np.typing.NDArray[np.bool_]]:
        pixels = study.clip.read(i)
        lit = study.fire.lit(pixels)
        return study.fire.content(pixels, lit), connected(lit)

    return colour_table(workers.map(seen, range(study.clip.count)), cells)


def _rise(face: Face, grid: Grid) -> float:
    """Speed of what rises in the intermittent zone, weighted by how much is seen to change."""
    heights = grid.heights[DRIFT_CELL // 2 :: DRIFT_CELL][: face.drift.shape[1]]
    zone = (heights > 0.2) & (heights < 1.0)
    up = -face.drift[:, : len(heights)][:, zone, :, 1] / grid.per_height
    rises = up[up > 0.05]
    if rises.size < 10:
        return _SLOWEST
    return float(np.clip(np.quantile(rises, 0.75), _SLOWEST, _FASTEST))

"""The commands that campaigns disturb, by name, each with a folder to try it in."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from tests.campaign.errands import ERRANDS, ErrandStage
from tests.campaign.stage import Stage

AnyStage = Stage | ErrandStage

_BUILDS: dict[str, dict[str, Any]] = {
    "build": {},
    "movies": {"movies": ["webm", "webp", "apng", "gif", "mp4"]},
    "gpu": {"atlas": {"gpu": ["bc7.ktx2", "astc-4x4.ktx2", "bc3.dds"]}},
    "exr": {"maps": {"emission": "exr"}},
}
"""Builds of different files: more keys of the recipe."""


@contextmanager
def stage_of(kind: str, folder: Path) -> Iterator[AnyStage]:
    """Yield a folder in which a command of this kind can be tried."""
    if kind == "cluster":
        from tests.campaign.cluster import cluster_stage  # imports all of Dask

        with cluster_stage(folder) as stage:
            yield stage
    elif kind in _BUILDS:
        yield Stage(folder, **_BUILDS[kind])
    else:
        yield ErrandStage(folder, ERRANDS[kind])

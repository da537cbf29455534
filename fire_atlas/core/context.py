"""The context of a build, shared by all its steps: workers, progress, timer and limits."""

from dataclasses import dataclass, field
from typing import Self

from fire_atlas.core.cpu import default_jobs
from fire_atlas.core.progress import Progress, SilentProgress, StageTimer
from fire_atlas.core.workers import Workers
from fire_atlas.core.workload import MAX_PIXELS


@dataclass(frozen=True, slots=True)
class BuildOptions:
    """Options of a build that are not in the recipe.

    Attributes:
        jobs: Number of worker threads.
        max_pixels: Maximum pixels of an input image.
        overwrite: Whether files that no build wrote may be replaced.
        force: Whether to build even if the outputs are up to date.
    """

    jobs: int = field(default_factory=default_jobs)
    max_pixels: int = MAX_PIXELS
    overwrite: bool = False
    force: bool = False

    @classmethod
    def of(
        cls, jobs: int | None, max_pixels: int, overwrite: bool = False, force: bool = False
    ) -> Self:
        """Return options; ``jobs`` defaults to the number of processors."""
        return cls(jobs or default_jobs(), max_pixels, overwrite, force)


@dataclass(frozen=True, slots=True)
class BuildContext:
    """Services and limits that all steps of a build share; no result depends on them.

    Attributes:
        workers: The pool of threads.
        progress: Receives stages, steps and notes.
        timer: Measures how long each stage takes.
        max_pixels: Maximum pixels of an input image.
    """

    workers: Workers
    progress: Progress
    timer: StageTimer
    max_pixels: int = MAX_PIXELS

    @classmethod
    def silent(cls, workers: Workers, max_pixels: int = MAX_PIXELS) -> Self:
        """Return a context that reports no progress, for a step that runs on its own."""
        return cls(workers, SilentProgress(), StageTimer(), max_pixels)

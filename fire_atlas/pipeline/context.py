"""What every step of a build shares besides its data."""

from dataclasses import dataclass, field
from typing import Self

from fire_atlas.core.progress import Progress, SilentProgress, StageTimer
from fire_atlas.core.workers import Workers, default_jobs
from fire_atlas.sources.listing import MAX_PIXELS


@dataclass(frozen=True, slots=True)
class BuildOptions:
    """What whoever starts a build decides besides the recipe.

    Attributes:
        jobs: Threads.
        most_pixels: Larger pictures of a source are refused.
        overwrite: Files that no manifest vouches for may be replaced.
    """

    jobs: int = field(default_factory=default_jobs)
    most_pixels: int = MAX_PIXELS
    overwrite: bool = False

    @classmethod
    def of(cls, jobs: int | None, most_pixels: int, overwrite: bool = False) -> Self:
        """Return options; without a number of ``jobs``, as many as there are processors."""
        return cls(jobs or default_jobs(), most_pixels, overwrite)


@dataclass(frozen=True, slots=True)
class BuildContext:
    """Who works, who hears of the progress, and who takes the time. No result depends on it.

    Attributes:
        workers: The pool of threads.
        progress: Hears of stages, steps and notes.
        timer: Measures how long each stage takes.
        most_pixels: Larger pictures of a source are refused.
    """

    workers: Workers
    progress: Progress
    timer: StageTimer
    most_pixels: int = MAX_PIXELS

    @classmethod
    def silent(cls, workers: Workers, most_pixels: int = MAX_PIXELS) -> Self:
        """Return the context of a step that is run on its own: nobody hears of it."""
        return cls(workers, SilentProgress(), StageTimer(), most_pixels)

"""Settings that all fire generators share, read from a recipe."""

from dataclasses import dataclass
from typing import Self

from fire_atlas.recipe.models import Recipe
from fire_atlas.recipe.source import Views
from fire_atlas.recipe.wind import Wind

_FRAMES, _FPS = 48, 24.0
"""Default length and frame rate: two seconds."""


@dataclass(frozen=True, slots=True)
class GenerationSettings:
    """Seed, wind, timing and views of a fire to generate.

    Attributes:
        seed: Seed of all random numbers.
        wind: The recipe's wind.
        frames: Number of frames.
        fps: Frames per second.
        loop: Whether frame 0 follows the last frame.
        views: The directions it is seen from.
    """

    seed: int
    wind: Wind
    frames: int
    fps: float
    loop: bool
    views: Views

    @classmethod
    def of(cls, recipe: Recipe) -> Self:
        """Read the settings from a recipe; length and frame rate have defaults."""
        timeline = recipe.timeline
        return cls(
            seed=recipe.seed,
            wind=recipe.wind,
            frames=timeline.frames or _FRAMES,
            fps=timeline.fps or _FPS,
            loop=timeline.loop != "none",
            views=recipe.views,
        )

    def azimuths(self) -> list[float]:
        """Return the direction of each view, degrees counter-clockwise seen from above."""
        return [360.0 * k / self.views.count for k in range(self.views.count)]

"""Settings that all fire generators share, read from a recipe."""

from dataclasses import dataclass, replace
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
        wind: The recipe's wind; the gusts of a loop close with it.
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
        from fire_atlas.effect.field.wind import fit_gusts  # numpy, which a listing does without

        timeline = recipe.timeline
        frames, fps = timeline.frames or _FRAMES, timeline.fps or _FPS
        loop = timeline.loop != "none"
        wind = fit_gusts(recipe.wind, frames / fps) if loop else recipe.wind
        return cls(recipe.seed, wind, frames, fps, loop, recipe.views)

    def in_each_wind(self) -> list[Self]:
        """Return the settings in each of the steady winds to change between."""
        return [replace(self, wind=wind) for wind in self.wind.steady()]

    def azimuths(self) -> list[float]:
        """Return the direction of each view, degrees counter-clockwise seen from above."""
        return [360.0 * k / self.views.count for k in range(self.views.count)]

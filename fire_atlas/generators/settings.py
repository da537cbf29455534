"""What a recipe asks of fire that is generated, whatever makes it."""

from dataclasses import dataclass
from typing import Self

from fire_atlas.recipe.models import Recipe
from fire_atlas.recipe.source import Views
from fire_atlas.recipe.wind import Wind

_FRAMES, _FPS = 48, 24.0
"""Length and rate of fire whose recipe does not say: two seconds."""


@dataclass(frozen=True, slots=True)
class GenerationSettings:
    """What every generator reads of a recipe beside its own source.

    Attributes:
        seed: Of all chance.
        wind: What blows.
        frames: Length of the clip.
        fps: Frames per second.
        loop: Whether frame 0 follows the last frame.
        views: The directions the fire is seen from.
    """

    seed: int
    wind: Wind
    frames: int
    fps: float
    loop: bool
    views: Views

    @classmethod
    def of(cls, recipe: Recipe) -> Self:
        """Take them from a recipe, with the defaults of generated fire."""
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

"""What the manifest of a build says of its atlas, in sentences."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, Self

from fire_atlas.core.statistics import by_animation, read_figures
from fire_atlas.heat.encode import HeatError
from fire_atlas.maps.vectors.cross_validation import ValidationReport, read_reports
from fire_atlas.preview.budget import Budget
from fire_atlas.preview.memory import ImageErrors

_VISIBLE_HUE = 6.0
"""Hues further than this, ΔE, outside of the clip's own are noticed."""


@dataclass(frozen=True, slots=True)
class BuildSentences:
    """What the statistics in a manifest say of a build.

    Attributes:
        pages: Of the colours of lossy pages and of heat; they follow the table of pages.
        blends: Of frames of cross-fades; they follow the table of loops.
        motion: Of motion vectors; they follow the table of maps.
        flakes: Of flakes; they follow it too.
        budget: What a budget was spent on; None without one.
        images: How far lossy pages and compressed textures are from what was drawn.
    """

    pages: tuple[str, ...] = ()
    blends: tuple[str, ...] = ()
    motion: tuple[str, ...] = ()
    flakes: tuple[str, ...] = ()
    budget: Budget | None = None
    images: ImageErrors = field(default_factory=lambda: ImageErrors({}, {}))

    def all(self) -> Iterator[str]:
        """Yield all sentences."""
        yield from (*self.pages, *self.blends, *self.motion, *self.flakes)

    @classmethod
    def of(cls, statistics: dict[str, Any]) -> Self:
        """Return the sentences on all animations.

        Raises:
            ValueError: The statistics are invalid.
        """
        motion = (_motion_sentence(*report) for report in read_reports(statistics).items())
        images = ImageErrors.of(statistics)
        heat = read_figures(statistics, "heat_error", HeatError)
        return cls(
            pages=(
                *(f"{file}: {error.sentence()}" for file, error in images.pages.items()),
                *(f"{name}: {error.sentence()}" for name, error in heat.items()),
            ),
            blends=tuple(_blend_sentences(statistics)),
            motion=tuple(motion),
            flakes=tuple(_flake_sentences(statistics)),
            budget=Budget.read(statistics),
            images=images,
        )


def _flake_sentences(statistics: dict[str, Any]) -> Iterator[str]:
    """Yield a sentence on the flakes of each animation."""
    for animation, figures in by_animation(statistics):
        match figures:
            case {"flakes": {"born": int(born), "alive_mean": float() | int() as alive} as flakes}:
                of = f" of {animation}" if animation else ""
                kind = (
                    f"; class: {flakes['class']}, style: {flakes['style']}"
                    if "class" in flakes
                    else ""
                )
                sets = f" {flakes['sets']} sets" if "sets" in flakes else " all"
                yield f"flakes{of}: {born} in{sets}, {alive:.3g} at a time{kind}"


def _blend_sentences(statistics: dict[str, Any]) -> Iterator[str]:
    """Yield a sentence on the hues of each animation with cross-fades."""
    for animation, figures in by_animation(statistics):
        if "blended" in figures:
            yield _blend_sentence(animation, figures["blended"])


def _blend_sentence(animation: str, figures: Any) -> str:
    match figures:
        case {"hue_error": float(error) | int(error)}:
            frames = (
                f"frames of cross-fades in {animation}" if animation else "frames of cross-fades"
            )
            limit = "unseen" if error <= _VISIBLE_HUE else "TO BE SEEN"
            return f"{frames}: hues at most ΔE {error:.1f} outside of the clip's own, {limit}"
    raise ValueError(f"{figures!r} are no figures of cross-fades")


_VISIBLE_GAIN = 0.01
"""Gain of motion vectors below which they make no difference to be seen."""


def _motion_sentence(animation: str, report: ValidationReport | None) -> str:
    """Return how much motion vectors improve blending; ``animation`` is empty if it is the only."""
    vectors = f"motion vectors of {animation}" if animation else "motion vectors"
    if report is None:
        return f"{vectors}: none, the animation is too short to test them"
    if report.still:
        return f"{vectors}: none, nothing moves: frames that were held out are as their neighbours"
    if not report.helps:
        return f"{vectors}: none, plain blending is as close to frames that were held out"
    if report.gain < _VISIBLE_GAIN:
        small = "less than 1 % closer than plain blending"
        return f"{vectors}: {small}; little of what changes between frames is motion"
    return f"{vectors}: {100 * report.gain:.0f} % closer than plain blending"

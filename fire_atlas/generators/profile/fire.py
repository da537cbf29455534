"""The two entry points of this package: learn a profile from clips, and generate clips of new fire
from a profile."""

from collections.abc import Mapping
from pathlib import Path

from fire_atlas.core.clip import Clip
from fire_atlas.core.workers import Workers
from fire_atlas.generators.profile.calibration import calibrate
from fire_atlas.generators.profile.generate.generated_fire import ProfileFireSettings
from fire_atlas.generators.profile.generate.rendering import renderings
from fire_atlas.generators.profile.learn.learn import learn
from fire_atlas.generators.profile.model import Profile
from fire_atlas.generators.rendering import rendered_clip


def learn_profile(
    clips: Mapping[str, Clip], workers: Workers, threshold: float | None = None, cells: int = 5
) -> Profile:
    """Learn a profile from clips; arguments and errors are those of ``learn``."""
    return learn(clips, workers, threshold, cells)


def generate_clips(
    profile: Profile,
    settings: ProfileFireSettings,
    height: int | None,
    blend_space: str,
    inputs: tuple[Path, ...],
    workers: Workers,
) -> list[Clip]:
    """Generate a fire and return one clip of it for each view of ``settings``.

    Args:
        profile: The profile to generate from.
        settings: Length, frame rate, wind, views and number of particles.
        height: Height of the frames, px; None keeps the scale of the learnt clip.
        blend_space: ``srgb`` or ``linear``: colour space in which the engine blends.
        inputs: Files the profile was made from.
        workers: Pool that measures the fire.
    """
    generation = settings.generation
    fire = calibrate(profile, settings, workers)
    views = renderings(fire, generation.azimuths(), generation.views.elevation, height)
    return [rendered_clip(view, generation, blend_space, inputs) for view in views]

"""Learn a fire from clips, and generate new fire from what was learnt (Lee et al.): the whole room
in two functions."""

from collections.abc import Mapping
from pathlib import Path

from fire_atlas.core.clip import Clip
from fire_atlas.core.workers import Workers
from fire_atlas.generators.profile.calibration import calibrate, calibrate_profile
from fire_atlas.generators.profile.generate.generated_fire import ProfileFireSettings
from fire_atlas.generators.profile.generate.rendering import renderings
from fire_atlas.generators.profile.learn.learn import learn
from fire_atlas.generators.profile.model import Profile
from fire_atlas.generators.rendering import rendered_clip


def learn_profile(
    clips: Mapping[str, Clip], workers: Workers, threshold: float | None = None, cells: int = 5
) -> Profile:
    """Learn a calibrated profile from clips; arguments and errors are those of ``learn``."""
    return calibrate_profile(learn(clips, workers, threshold, cells), workers)


def generate_clips(
    profile: Profile,
    settings: ProfileFireSettings,
    height: int | None,
    blend_space: str,
    inputs: tuple[Path, ...],
    workers: Workers,
) -> list[Clip]:
    """Generate a fire and return a clip of it from each view of ``settings``.

    Args:
        profile: What was learnt.
        settings: Length, frame rate, wind, views and grain of the fire.
        height: Of the frames, px; None keeps the scale of the clip.
        blend_space: ``srgb`` or ``linear``: where the client blends.
        inputs: The files the profile comes from.
        workers: Pool that measures the fire.
    """
    generation = settings.generation
    fire = calibrate(profile, settings, workers)
    views = renderings(fire, generation.azimuths(), generation.views.elevation, height)
    return [rendered_clip(view, generation, blend_space, inputs) for view in views]

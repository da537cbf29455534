"""The entry points of this package: learn a profile from clips, and generate clips of new fire from
a profile, in one wind or in several."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip, ProxiedClip
from fire_atlas.core.fire_in_wind import (
    FireInWind,
    WindChange,
    change_shares,
    even_progress,
)
from fire_atlas.core.workers import Workers
from fire_atlas.generators.profile.calibration import calibrate
from fire_atlas.generators.profile.generate.generated_fire import (
    GeneratedFire,
    ProfileFireSettings,
)
from fire_atlas.generators.profile.generate.rendering import (
    ProfileRendering,
    renderings,
    renderings_in_wind,
)
from fire_atlas.generators.profile.learn.learn import learn
from fire_atlas.generators.profile.model import Profile
from fire_atlas.generators.rendering import rendered_clip

_SLOWING = 0.5
"""Fraction by which the fire's own time goes slower where its wind changes fastest: steps would be
larger than before and after, because the fire moves and leans at once."""


def learn_profile(
    clips: Mapping[str, ProxiedClip],
    workers: Workers,
    threshold: float | None = None,
    cells: int = 5,
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
    longer_side: int | None = None,
) -> list[Clip]:
    """Generate a fire and return one clip of it for each view of ``settings``.

    Args:
        profile: The profile to generate from.
        settings: Length, frame rate, wind, views and number of particles.
        height: Height of the frames, px; None keeps the scale of the learnt clip.
        blend_space: ``srgb`` or ``linear``: colour space in which the engine blends.
        inputs: Files the profile was made from.
        workers: Pool that measures the fire.
        longer_side: The longer side of the frames, px, in place of ``height``.
    """
    generation = settings.generation
    timed = calibrate(profile, settings, workers)
    elevation = generation.views.elevation
    views = renderings(timed.fire, generation.azimuths(), elevation, height, longer_side)
    clips = [rendered_clip(view, generation, blend_space, inputs) for view in views]
    return [
        replace(clip, picture=timed.picture(view)) for clip, view in zip(clips, views, strict=True)
    ]


def generate_in_wind(
    profile: Profile,
    settings: ProfileFireSettings,
    height: int | None,
    blend_space: str,
    inputs: tuple[Path, ...],
    workers: Workers,
    longer_side: int | None = None,
) -> FireInWind:
    """Generate a fire in each of the winds that it changes between; see ``generate_clips``."""
    shared = settings.generation
    generations = shared.in_each_wind()
    fires = [calibrate(profile, replace(settings, generation=g), workers).fire for g in generations]
    views = renderings_in_wind(fires, shared.views.elevation, height, longer_side)
    loops = tuple(
        rendered_clip(view, generation, blend_space, inputs)
        for view, generation in zip(views, generations, strict=True)
    )

    def change(before: int, after: int, start: int, progress: NDArray[np.float64]) -> WindChange:
        return _change(loops[before], views[before], fires[after], start, progress)

    return FireInWind(loops, change)


def _change(
    loop: Clip, view: ProfileRendering, after: GeneratedFire, start: int,
    progress: NDArray[np.float64],
) -> WindChange:  # fmt: skip
    """Return the change from ``loop``, seen in ``view``, as ``FireInWind.change`` does."""
    before, shares = view.fire, change_shares(progress)
    times, entry = _times_of_change(before, after, start, progress)
    shown = [
        view.showing(before.changing(after, float(share), float(time)))
        for share, time in zip(shares, times, strict=True)
    ]
    clip = replace(
        loop, count=len(shown), picture=lambda k: shown[k].frame(0), loop=False, flow=None
    )
    return WindChange(clip, shares, entry)


def _times_of_change(
    before: GeneratedFire, after: GeneratedFire, start: int, progress: NDArray[np.float64]
) -> tuple[NDArray[np.float64], int]:
    """Return the fire's own time at each ``progress`` (count,) of a change, and the frame of
    ``after`` that follows. Each loop may have its own frame times, but all have one period."""
    begin, period = float(before.frame_times[start]), after.period
    even = np.concatenate([[0.0], even_progress(len(progress)), [1.0]])
    faded = np.diff(change_shares(even))
    passed = np.concatenate([[0.0], np.cumsum(1 - _SLOWING * faded / faded.max())])
    # By how much each frame of the new wind is later than the end of the change.
    late = np.mod(after.frame_times - begin - passed[-1] + period / 2, period) - period / 2
    entry = int(np.argmin(np.abs(late)))
    times = np.interp(progress, even, passed) * (1 + float(late[entry]) / passed[-1])
    return begin + times, entry

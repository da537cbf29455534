"""Source ``profile``: new fire, generated from clips or from a profile file."""

from collections.abc import Sequence
from pathlib import Path

from fire_atlas.core.clip import Clip
from fire_atlas.core.errors import SourceError
from fire_atlas.core.file_kinds import misnamed
from fire_atlas.core.files import MAX_JSON_BYTES, read_file
from fire_atlas.core.fire_in_wind import FireInWind
from fire_atlas.generators.profile.file import read_profile
from fire_atlas.generators.profile.fire import (
    generate_clips,
    generate_in_wind,
    learn_profile,
)
from fire_atlas.generators.profile.generate.generated_fire import ProfileFireSettings
from fire_atlas.generators.profile.learn.fitness import PROXY_SIDE, refuse_length
from fire_atlas.generators.profile.model import Profile
from fire_atlas.generators.settings import GenerationSettings
from fire_atlas.recipe.frame_size import LONGER_SIDE
from fire_atlas.recipe.source import PROFILE_SUFFIX, ClipInput, FramesSource, ProfileSource
from fire_atlas.sources.frames import Footage, examine_frames, open_with_proxy
from fire_atlas.sources.reader import OpeningContext


def open_profile(
    source: ProfileSource,
    paths: Sequence[Path],
    generation: GenerationSettings,
    context: OpeningContext,
) -> list[Clip]:
    """Generate new fire, as a clip for each view.

    Args:
        source: The recipe's ``source``.
        paths: The clip and perhaps the clip from the side, or a profile file. Absolute.
        generation: Seed, wind, timing and views.
        context: Workers, limits, and the encoding in which the client blends.

    Raises:
        SourceError: A file is missing or damaged, or a clip shows no fire to learn from.
    """
    profile, inputs = _profile_of(source, paths, context)
    settings = ProfileFireSettings(generation, source.slices, source.particles, source.detail)
    return generate_clips(
        profile, settings, source.height, context.blend_space, inputs, context.workers,
        _longer_side(source),
    )  # fmt: skip


def open_profile_in_wind(
    source: ProfileSource,
    paths: Sequence[Path],
    generation: GenerationSettings,
    context: OpeningContext,
) -> FireInWind:
    """Generate fire in each of the winds that it changes between; see ``open_profile``."""
    profile, inputs = _profile_of(source, paths, context)
    settings = ProfileFireSettings(generation, source.slices, source.particles, source.detail)
    return generate_in_wind(
        profile, settings, source.height, context.blend_space, inputs, context.workers,
        _longer_side(source),
    )  # fmt: skip


def _longer_side(source: ProfileSource) -> int | None:
    """Return the longer side of a frame, px, if the recipe states it by ``size``."""
    return None if source.size is None else LONGER_SIDE[source.size]


def _profile_of(
    source: ProfileSource, paths: Sequence[Path], context: OpeningContext
) -> tuple[Profile, tuple[Path, ...]]:
    """Read the profile, or learn it from clips; return it and the files it came from."""
    if paths[0].suffix.lower() == PROFILE_SUFFIX:
        return _read(paths), tuple(paths)
    profile, clips = learn_from_files(source, paths, context)
    return profile, tuple(file for clip in clips for file in clip.inputs)


def learn_from_files(
    source: ProfileSource, paths: Sequence[Path], context: OpeningContext
) -> tuple[Profile, tuple[Clip, ...]]:
    """Learn a profile from the clips at ``paths``; return it and the clips.

    Raises:
        SourceError: As in ``open_profile``.
    """
    _refuse_same_clip(paths)
    frames = _frames_of(source)
    clips = {str(path): open_with_proxy(frames, path, context, PROXY_SIDE) for path in paths}
    profile = learn_profile(clips, context.workers, source.threshold, source.cells)
    return profile, tuple(proxied.clip for proxied in clips.values())


def examine_profile(
    source: ProfileSource,
    paths: Sequence[Path],
    generation: GenerationSettings,
    context: OpeningContext,
) -> Footage:
    """Return what is known of new fire before a frame of what it is learnt from is decoded.

    Raises:
        SourceError: A profile is damaged; or a clip is missing, or has too few or too many frames.
    """
    if paths[0].suffix.lower() == PROFILE_SUFFIX:
        _read(paths)
        return Footage(generation.frames, None, generation.fps, True, ())
    _refuse_same_clip(paths)
    clips = {path: examine_frames(_frames_of(source), path, context) for path in paths}
    for path, clip in clips.items():
        if clip.exact:
            refuse_length(str(path), clip.count)
    notes = dict.fromkeys(note for clip in clips.values() for note in clip.notes)
    return Footage(generation.frames, None, generation.fps, True, tuple(notes))


def _refuse_same_clip(paths: Sequence[Path]) -> None:
    """Refuse a clip that is named as seen from the front and from the side."""
    if len({path.resolve() for path in paths}) < len(paths):
        raise SourceError(
            f"is {paths[0]}, the clip itself; name one of the same fire, filmed from its right "
            f"side, or leave it out",
            key=("source", "side_path"),
        )


def _frames_of(source: ProfileSource) -> FramesSource:
    """Return how the clips to learn from are read."""
    return FramesSource(**{key: getattr(source, key) for key in ClipInput.model_fields})


def _read(paths: Sequence[Path]) -> Profile:
    """Read a profile file, which must be the only path."""
    path = paths[0]
    if len(paths) > 1:
        raise SourceError(
            f"is in {path} already, which is a profile file; remove it, or give the clip as "
            f"source.path",
            key=("source", "side_path"),
        )
    try:
        data = read_file(path, MAX_JSON_BYTES)
    except OSError as error:
        raise SourceError(f"{path}: cannot be read ({error.strerror})") from error
    if data and (what := misnamed(data[:64], may_be_json=True)):
        raise SourceError(f"{path}: is {what}")
    return read_profile(data, str(path))

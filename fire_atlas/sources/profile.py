"""Source ``profile``: fire learnt from a clip, or from a file that tells what was learnt."""

from collections.abc import Sequence
from pathlib import Path

from fire_atlas.core.clip import Clip
from fire_atlas.core.errors import SourceError
from fire_atlas.core.files import MAX_JSON_BYTES, read_file
from fire_atlas.core.workers import Workers
from fire_atlas.generators.profile.blaze import Burning
from fire_atlas.generators.profile.file import SUFFIX, read_profile
from fire_atlas.generators.profile.fire import burn
from fire_atlas.generators.profile.learn import learn
from fire_atlas.generators.profile.model import Profile
from fire_atlas.generators.settings import GenerationSettings
from fire_atlas.recipe.source import Footage, FramesSource, ProfileSource
from fire_atlas.sources.frames import open_frames


def open_profile(
    source: ProfileSource,
    paths: Sequence[Path],
    generation: GenerationSettings,
    blend_space: str,
    workers: Workers,
    most_pixels: int,
) -> list[Clip]:
    """Return new fire as a recipe wants it, a clip for each view.

    Args:
        source: The recipe's section.
        paths: The clip and, if there is one, that from the side; or a profile file. Absolute.
        generation: What is asked of the new fire.
        blend_space: ``srgb`` or ``linear``: where the client blends.
        workers: Who looks at the frames of a clip.
        most_pixels: Larger pictures of a clip are refused.

    Raises:
        SourceError: A file is missing or damaged, or a clip shows no fire to learn from.
    """
    profile, inputs = known(source, paths, blend_space, workers, most_pixels)
    asked = Burning(
        seed=generation.seed,
        frames=generation.frames,
        fps=generation.fps,
        loop=generation.loop,
        slices=source.slices,
        particles=source.particles,
        wind=generation.wind,
    )
    return burn(
        profile, asked, generation.azimuths(), source.height, generation.views.elevation,
        blend_space, inputs, workers,
    )  # fmt: skip


def known(
    settings: ProfileSource,
    paths: Sequence[Path],
    blend_space: str,
    workers: Workers,
    most_pixels: int,
) -> tuple[Profile, tuple[Path, ...]]:
    """Return the profile that ``settings`` mean, and the files it comes from.

    Raises:
        SourceError: As of ``open_profile``.
    """
    if paths[0].suffix == SUFFIX:
        if len(paths) > 1:
            raise SourceError(
                f"{paths[0]}: a profile file knows its side view already; remove source.side_path, "
                f"or name the clip as source.path"
            )
        return read_profile(_read(paths[0]), str(paths[0])), (paths[0],)
    profile, clips = learnt(settings, paths, blend_space, workers, most_pixels)
    return profile, tuple(file for clip in clips for file in clip.inputs)


def learnt(
    settings: ProfileSource,
    paths: Sequence[Path],
    blend_space: str,
    workers: Workers,
    most_pixels: int,
) -> tuple[Profile, tuple[Clip, ...]]:
    """Return what is learnt of the clips at ``paths``, and the clips.

    Raises:
        SourceError: As of ``open_profile``.
    """
    footage = FramesSource(**{key: getattr(settings, key) for key in Footage.model_fields})
    clips = {str(path): open_frames(footage, path, blend_space, most_pixels) for path in paths}
    return learn(clips, workers, settings.threshold, settings.cells), tuple(clips.values())


def _read(path: Path) -> bytes:
    try:
        return read_file(path, MAX_JSON_BYTES)
    except OSError as error:
        raise SourceError(f"{path}: cannot be read ({error.strerror})") from error

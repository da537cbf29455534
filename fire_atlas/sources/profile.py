"""Source ``profile``: fire learnt from a clip, or from a file that tells what was learnt."""

from collections.abc import Sequence
from pathlib import Path

from fire_atlas.core.clip import Clip
from fire_atlas.core.errors import SourceError
from fire_atlas.core.workers import Workers
from fire_atlas.generators.profile.blaze import Burning
from fire_atlas.generators.profile.file import MOST_BYTES, SUFFIX, read_profile
from fire_atlas.generators.profile.fire import burn
from fire_atlas.generators.profile.learn import learn
from fire_atlas.generators.profile.model import Profile
from fire_atlas.recipe.models import Recipe
from fire_atlas.recipe.source import Footage, FramesSource, ProfileSource
from fire_atlas.sources.frames import DEFAULT_FPS, open_frames

FRAMES = 48
"""Length of generated fire where the recipe does not say."""


def open_profile(
    recipe: Recipe, settings: ProfileSource, paths: Sequence[Path], workers: Workers
) -> dict[str, Clip]:
    """Return new fire as the recipe wants it: one clip, or one for each direction.

    Args:
        recipe: What is wanted.
        settings: Its source.
        paths: The clip and, if there is one, that from the side; or a profile file. Absolute.
        workers: Who looks at the frames of a clip.

    Raises:
        SourceError: A file is missing or damaged, or a clip shows no fire to learn from.
    """
    profile, inputs = known(settings, paths, recipe.atlas.blend_space, workers)
    timeline, views = recipe.timeline, recipe.views
    asked = Burning(
        seed=recipe.seed,
        frames=timeline.frames or FRAMES,
        fps=timeline.fps or DEFAULT_FPS,
        loop=timeline.loop != "none",
        slices=settings.slices,
        particles=settings.particles,
        wind=recipe.wind,
    )
    count = views.count
    azimuths = [360.0 * k / count for k in range(count)]
    clips = burn(
        profile, asked, azimuths, settings.height, views.elevation, recipe.atlas.blend_space,
        inputs, workers,
    )  # fmt: skip
    names = [f"view_{k}" for k in range(count)] if count > 1 else [recipe.name]
    return dict(zip(names, clips, strict=True))


def known(
    settings: ProfileSource, paths: Sequence[Path], blend_space: str, workers: Workers
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
    profile, clips = learnt(settings, paths, blend_space, workers)
    return profile, tuple(file for clip in clips for file in clip.inputs)


def learnt(
    settings: ProfileSource, paths: Sequence[Path], blend_space: str, workers: Workers
) -> tuple[Profile, tuple[Clip, ...]]:
    """Return what is learnt of the clips at ``paths``, and the clips.

    Raises:
        SourceError: As of ``open_profile``.
    """
    footage = FramesSource(**{key: getattr(settings, key) for key in Footage.model_fields})
    clips = {str(path): open_frames(footage, path, blend_space) for path in paths}
    return learn(clips, workers, settings.threshold, settings.cells), tuple(clips.values())


def _read(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            return file.read(MOST_BYTES + 1)
    except OSError as error:
        raise SourceError(f"{path}: cannot be read ({error.strerror})") from error

"""Open images of different sizes as sprites in named animations, for recipes that only pack."""

import re
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from fire_atlas.core.errors import SourceError
from fire_atlas.core.output_file import as_file_name
from fire_atlas.core.picture import Picture
from fire_atlas.core.workload import MAX_PIXELS
from fire_atlas.recipe.source import FramesSource
from fire_atlas.sources import matte
from fire_atlas.sources.frames import DEFAULT_FPS
from fire_atlas.sources.header import Header
from fire_atlas.sources.images import decode, read_header, shared_notes
from fire_atlas.sources.listing import frame_range, locate, sample_numbers, with_samples

_NUMBER = re.compile(r"[ _.\-(]*[0-9]+\)?$")
_NOT_IN_NAMES = re.compile(r"[\x00-\x1f\x7f-\x9f\ud800-\udfff\"'\\;:/]+")
"""Characters that names in engines' files must not contain: control characters, undecodable bytes,
and the punctuation of these file formats."""


@dataclass(frozen=True, slots=True)
class Sprites:
    """Images of different sizes in named animations, read on demand.

    Attributes:
        animations: By name of the animation, the numbers of its images in playing order.
        fps: Frames per second of all animations.
        picture: ``picture(i)`` returns image i, like ``Clip.picture``.
        inputs: The files that are read, in order: the images, and those that decided the matte.
        matte, matte_reason: Where the coverage comes from, and why, for the user.
        notes: What else was decided about the images, and why, for the user.
    """

    animations: dict[str, tuple[int, ...]]
    fps: float
    picture: Callable[[int], Picture]
    inputs: tuple[Path, ...]
    matte: str
    matte_reason: str
    notes: tuple[str, ...]


def open_sprites(
    settings: FramesSource, path: Path, blend_space: str, name: str, max_pixels: int = MAX_PIXELS
) -> Sprites | None:
    """Open the images at ``path`` as sprites; None if it is a single file or one clip.

    Args:
        settings: The recipe's ``source``.
        path: Absolute path or glob.
        blend_space: Encoding in which the client blends, for the luminance matte.
        name: Name of the animation of files that have only a number as name.
        max_pixels: Limit on the pixels of a picture.

    Raises:
        SourceError: An image is broken or too large, or a setting does not apply to sprites.
    """
    found = examine_sprites(settings, path, name, max_pixels)
    if found is None:
        return None
    everything, chosen = found.everything, found.chosen
    files, headers = list(found.headers), list(found.headers.values())
    samples = [everything[i] for i in sample_numbers(len(everything))]
    pictures = (decode(file, read_header(file, max_pixels, settings.layer)) for file in samples)
    choice = matte.choose(settings.matte, settings.black, pictures, str(path))
    return Sprites(
        animations=found.animations,
        fps=settings.fps or DEFAULT_FPS,
        picture=lambda i: matte.apply(
            choice.matte, decode(files[i], headers[i]), blend_space, choice.black
        ),
        inputs=tuple(everything[i] for i in with_samples(chosen, len(everything))),
        matte=choice.matte,
        matte_reason=choice.reason,
        notes=found.notes,
    )


@dataclass(frozen=True, slots=True)
class SpriteFiles:
    """Images that are packed as sprites, none of which is decoded yet.

    Attributes:
        everything: All files at the path, in order.
        chosen: Numbers of those that the recipe uses.
        headers: These files, with their headers.
        animations: By name of the animation, the numbers of its images among these.
        notes: What was decided about them, and why, for the user.
    """

    everything: Sequence[Path]
    chosen: range
    headers: dict[Path, Header]
    animations: dict[str, tuple[int, ...]]
    notes: tuple[str, ...]


def examine_sprites(
    settings: FramesSource, path: Path, name: str, max_pixels: int
) -> SpriteFiles | None:
    """Return the images that ``open_sprites`` would open; None if they are a single file or clip.

    Raises:
        SourceError: All that ``open_sprites`` refuses before it decodes an image.
    """
    located = locate(path)
    if located.single or settings.grid is not None or settings.animation is not None:
        return None
    chosen = frame_range(settings, len(located.files), path)
    files = [located.files[i] for i in chosen]
    animations = group_by_name(files, name)
    headers = {file: read_header(file, max_pixels, settings.layer) for file in files}
    if len(animations) == 1 and len({(h.width, h.height) for h in headers.values()}) == 1:
        return None
    if settings.crop != "none" or isinstance(settings.height, int):
        key = "height" if settings.crop == "none" else "crop"
        raise SourceError(
            f"is for the frames of one clip, but {path} holds several animations or sizes; leave "
            f"it out, or use atlas.scales for smaller pages",
            key=("source", key),
        )
    notes = (*located.notes(settings), *shared_notes(headers))
    return SpriteFiles(located.files, chosen, headers, animations, notes)


def group_by_name(files: Sequence[Path], default: str) -> dict[str, tuple[int, ...]]:
    """Group files to animations by their names: ``walk_0001.png`` belongs to ``walk``.

    So does ``walk/0001.png`` if there are several folders. Single files whose names differ only in
    numbers, such as ``a1_x`` and ``a2_x``, are one animation; and so are those whose names are one
    on Windows or macOS, which ignore case.

    Raises:
        SourceError: Two files would be one there.
    """
    taken: dict[str, Path] = {}
    for file in files:
        other = taken.setdefault(as_file_name(str(file)), file)
        if other != file:
            raise SourceError(
                f"{file}: would be the same file as {other} on Windows or macOS; give one of them "
                f"another name"
            )
    stems = [_NUMBER.sub("", file.stem) for file in files]
    alone = {stem for stem, count in Counter(stems).items() if count == 1}
    shapes = Counter(_shape(stem) for stem in alone)
    folders = len({file.parent for file in files}) > 1
    animations: dict[str, tuple[int, ...]] = {}
    spelt: dict[str, str] = {}
    for i, (file, stem) in enumerate(zip(files, stems, strict=True)):
        if stem in alone and shapes[_shape(stem)] > 1:
            stem = _NUMBER.sub("", re.split(r"[0-9]", stem)[0]).rstrip(" _.-(")
        word = stem or (file.parent.name if folders else default)
        animation = _NOT_IN_NAMES.sub("_", word)
        animation = spelt.setdefault(as_file_name(animation), animation)
        animations[animation] = (*animations.get(animation, ()), i)
    return animations


def _shape(stem: str) -> str:
    """Return a name with ``#`` for each number."""
    return re.sub(r"[0-9]+", "#", stem)

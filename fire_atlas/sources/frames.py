"""Source ``frames``: open images, a sprite sheet, an animation or a video as a clip."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from fire_atlas.core.clip import Clip, ProxiedClip, Window
from fire_atlas.core.errors import SourceError, about
from fire_atlas.core.picture import Picture, as_light, to_light
from fire_atlas.core.pixels import Pixels
from fire_atlas.core.workers import Workers
from fire_atlas.core.workload import check_workload
from fire_atlas.recipe.source import FramesSource
from fire_atlas.sources import matte
from fire_atlas.sources.framing import (
    FlameExtent,
    describe_crop,
    small_copy,
    stated_box,
)
from fire_atlas.sources.images import (
    ANIMATIONS,
    check_layer,
    check_size,
    decode,
    detect_format,
    read_header,
    shared_notes,
)
from fire_atlas.sources.json_atlas import is_atlas
from fire_atlas.sources.listing import Located, frame_range, locate, sample_numbers, with_samples
from fire_atlas.sources.reader import FrameReader, OpeningContext, cached, check_frame_size
from fire_atlas.sources.resize import nearest, reduce, resize, width_for
from fire_atlas.vision.thumbnails import shrunk

DEFAULT_FPS = 24.0
"""Frames per second of files that state no rate."""


def open_frames(settings: FramesSource, path: Path, context: OpeningContext) -> Clip:
    """Open the frames at ``path``: those of a video are decoded, of others a few samples.

    Args:
        settings: The recipe's ``source``.
        path: Absolute path or glob.
        context: Workers, limits, and how frames will be used.

    Raises:
        SourceError: The input is missing, broken, too large, or does not fit the settings.
    """
    return _open(settings, path, context)[0]


@dataclass(frozen=True, slots=True)
class Footage:
    """What the headers of a clip's files tell of it.

    Attributes:
        count: Number of frames that the recipe uses.
        size: Their (width, height) on the pages, px; None if that depends on their pixels.
        fps: Frames per second.
        exact: Whether these hold: the decoder of a video may contradict its headers.
        notes: What was decided about the frames, and why, for the user.
    """

    count: int
    size: tuple[int, int] | None
    fps: float
    exact: bool
    notes: tuple[str, ...]


def examine_frames(settings: FramesSource, path: Path, context: OpeningContext) -> Footage:
    """Return what is known of the frames at ``path`` before the first of them is decoded.

    For the arguments see ``open_frames``.

    Raises:
        SourceError: All that ``open_frames`` refuses before it decodes a frame.
    """
    located, kind = _located(settings, path)
    if kind == "video":
        from fire_atlas.sources.video import examine_video

        reader, chosen = examine_video(located.files[0], settings, context)
    else:
        reader, chosen = _open_images(settings, path, located, kind, context)
        box = stated_box(settings, (reader.width, reader.height), path)
        reader = replace(reader, width=box.right - box.left, height=box.bottom - box.top)
    size = None if settings.crop == "auto" else _size(settings, reader, path, context)
    fps = settings.fps or reader.fps or DEFAULT_FPS
    return Footage(len(chosen), size, fps, kind != "video", reader.notes)


def open_with_proxy(
    settings: FramesSource, path: Path, context: OpeningContext, side: int
) -> ProxiedClip:
    """Open frames as ``open_frames`` does, and a copy whose sides are no longer than ``side`` px.

    Of large files the copy is several times as fast to read: its frames are reduced before their
    matte is computed.
    """
    clip, reader, chosen, choice = _open(settings, path, context)
    scale = side / max(clip.width, clip.height)
    if scale >= 1:
        return ProxiedClip(clip, clip)
    width, height = (max(1, round(scale * length)) for length in (clip.width, clip.height))

    def small(i: int) -> Picture:
        if width >= reader.width or height >= reader.height:
            return shrunk(clip.read(i), side)
        picture = reader.read(chosen[i])
        check_frame_size(path, chosen[i], picture, (reader.width, reader.height))
        light = reduce(picture, width, height)
        return matte.apply(choice.matte, light, clip.blend_space, choice.black)

    return ProxiedClip(clip, replace(clip, width=width, height=height, picture=small))


def _open(
    settings: FramesSource, path: Path, context: OpeningContext
) -> tuple[Clip, FrameReader, range, matte.MatteChoice]:
    """Return the clip at ``path``, the reader of its frames, which of them it has, and the matte
    that they get."""
    reader, chosen = _open_reader(settings, path, context)
    choice = reader.matte or matte.choose(
        settings.matte, settings.black, map(reader.read, sample_numbers(reader.count)), str(path)
    )
    width, height = _size(settings, reader, path, context)
    keeps_pixels, space = settings.sampling == "nearest", context.blend_space

    def shown(i: int) -> Picture:
        picture = matted(i)
        return picture if reader.fade is None else reader.fade.apply(as_light(picture))

    def matted(i: int) -> Picture:
        picture = reader.read(chosen[i])
        check_frame_size(path, chosen[i], picture, (reader.width, reader.height))
        if (width, height) == (reader.width, reader.height):
            return matte.apply(choice.matte, picture, space, choice.black)
        if keeps_pixels:
            whole = matte.apply(choice.matte, picture, space, choice.black)
            return nearest(whole, width, height)
        return _resized(choice, picture, (width, height), space)

    clip = Clip(
        width=width,
        height=height,
        fps=settings.fps or reader.fps or DEFAULT_FPS,
        count=len(chosen),
        picture=shown,
        inputs=reader.inputs,
        blend_space=space,
        matte=choice.matte,
        matte_reason=choice.reason,
        notes=(*reader.notes, *_note_on_enlarging(height, reader, settings)),
    )
    return clip, reader, chosen, choice


def _size(
    settings: FramesSource, reader: FrameReader, path: Path, context: OpeningContext
) -> tuple[int, int]:
    """Return the width and height, px, at which frames are used: as ``source.height`` says."""
    height = reader.height if isinstance(settings.height, str) else settings.height
    width = width_for(height, (reader.width, reader.height))
    with about(("source", "height")):
        check_size(f"{path} at height {height}", width, height, context.max_pixels)
    return width, height


def _note_on_enlarging(height: int, reader: FrameReader, settings: FramesSource) -> Iterator[str]:
    """Yield a note if frames get higher than they are; pixel art may, in whole steps."""
    if height <= reader.height or (settings.sampling == "nearest" and height % reader.height == 0):
        return
    yield (
        f"source.height: {height} enlarges frames that are {reader.height} px high, which shows no "
        f"more of them and takes more of the pages; leave it out to keep their size"
    )


def _resized(
    choice: matte.MatteChoice, picture: Picture, size: tuple[int, int], blend_space: str
) -> Pixels:
    """Resize in linear light, then apply the matte: so it is exact for the resized pixels."""
    pixels = resize(to_light(picture), *size)
    if choice.matte == "luminance":
        return matte.luminance_of_light(pixels, blend_space, choice.black)
    return matte.over_black(pixels) if choice.matte == "none" else pixels


def _open_reader(
    settings: FramesSource, path: Path, context: OpeningContext
) -> tuple[FrameReader, range]:
    """Return a reader of the cropped frames at ``path``, and the numbers of those to use."""
    located, kind = _located(settings, path)
    if kind == "video":
        from fire_atlas.sources.video import open_video

        reader = open_video(located.files[0], settings, context)
        return reader, frame_range(settings, reader.count, path)
    reader, chosen = _open_images(settings, path, located, kind, context)
    return _cropped(reader, chosen, settings, path, context.workers), chosen


def _located(settings: FramesSource, path: Path) -> tuple[Located, str]:
    """Return the files at ``path``, and what they are: ``images``, or the format of the only one.

    Raises:
        SourceError: There are none, or settings are for files of another kind.
    """
    located = locate(path)
    is_json = located.single and is_atlas(located.files[0])
    if settings.animation is not None and not is_json:
        raise SourceError(
            f"picks one of those that the JSON of an atlas names, but {path} is no JSON; give that "
            f"as path, or leave animation out",
            key=("source", "animation"),
        )
    if located.single:
        file = located.files[0]
        kind = "json" if is_json else detect_format(file)
        check_layer(file, kind, settings.layer)
        if settings.grid is not None and kind in ("video", "gif", "json"):
            raise SourceError(
                f"cuts one still image into cells, which {file} is not; leave it out",
                key=("source", "grid"),
            )
        return located, kind
    if settings.grid is not None:
        raise SourceError(
            f"cuts one image into cells, but {path} is {len(located.files)} images; leave grid "
            f"out, or give one sheet as path",
            key=("source", "grid"),
        )
    return located, "images"


def _open_images(
    settings: FramesSource, path: Path, located: Located, kind: str, context: OpeningContext
) -> tuple[FrameReader, range]:
    """Return a reader of the frames at ``path``, none of which is decoded yet, and the numbers of
    those to use."""
    if located.single:
        reader = _open_file(settings, located.files[0], kind, context.max_pixels)
        chosen = frame_range(settings, reader.count, path)
    else:
        chosen = frame_range(settings, len(located.files), path)
        reader = cached(_open_stills(located.files, chosen, settings.layer, context.max_pixels))
    # A file of many frames is decoded up to the last one that is used, or shows the matte.
    used = with_samples(chosen, reader.count)
    taken = used[-1] + 1 if located.single else len(used)
    size = reader.width, reader.height
    check_workload(taken, size, context.max_pixels, "source.start and count", path=path)
    return replace(reader, notes=(*located.notes(settings), *reader.notes)), chosen


def _open_file(settings: FramesSource, path: Path, kind: str, max_pixels: int) -> FrameReader:
    if settings.grid is not None:
        from fire_atlas.sources.sheet import open_sheet

        return cached(open_sheet(path, settings.grid, max_pixels, settings.layer))
    if kind == "json":
        from fire_atlas.sources.json_atlas_frames import open_atlas

        return open_atlas(path, settings.animation, settings.fps, max_pixels)
    if kind in ANIMATIONS:
        from fire_atlas.sources.animated import open_animation

        return open_animation(path, kind, settings.fps, max_pixels)
    return cached(_open_stills((path,), range(1), settings.layer, max_pixels))


def _cropped(
    reader: FrameReader, chosen: range, settings: FramesSource, path: Path, workers: Workers
) -> FrameReader:
    """Return a reader of the part of the frames that ``source.crop`` states, or of the flame's."""
    size = reader.width, reader.height
    box = stated_box(settings, size, path)
    if settings.crop == "auto":
        extent = FlameExtent()
        copies = workers.map(lambda i: small_copy(reader.read(i)), chosen)
        for i, small in zip(chosen, copies, strict=True):
            extent.add(i, small)
        samples = (small_copy(reader.read(i)) for i in sample_numbers(reader.count))
        choice = matte.choose(settings.matte, settings.black, samples, str(path))
        crop = extent.crop(size, choice)
        box, notes = crop.box, (*reader.notes, describe_crop(crop, size))
        reader = replace(reader, matte=choice, fade=crop.fade, notes=notes)
    if box == Window(0, 0, *size):
        return reader

    def part(i: int) -> Picture:
        picture = reader.read(i)
        check_frame_size(path, i, picture, size)
        return picture[box.slices]

    width, height = box.right - box.left, box.bottom - box.top
    return replace(reader, width=width, height=height, read=part)


def _open_stills(
    files: Sequence[Path], chosen: range, layer: str | None, max_pixels: int
) -> FrameReader:
    """Return a reader with one frame per file; the chosen ones must have the same size.

    Its inputs are the chosen files, and the samples by which the matte is chosen.
    """
    headers = {i: read_header(files[i], max_pixels, layer) for i in chosen}
    first = headers[chosen[0]]
    for i, header in headers.items():
        if (header.width, header.height) != (first.width, first.height):
            raise SourceError(
                f"{files[i]}: is {header.width}x{header.height}, but {files[chosen[0]].name} is "
                f"{first.width}x{first.height}; all frames must have one size "
                "(to pack images of different sizes: source: {kind: sprites, path: ...})"
            )
    return FrameReader(
        width=first.width,
        height=first.height,
        fps=None,
        count=len(files),
        read=lambda i: decode(files[i], headers.get(i) or read_header(files[i], max_pixels, layer)),
        inputs=tuple(files[i] for i in with_samples(chosen, len(files))),
        notes=shared_notes({files[i]: header for i, header in headers.items()}),
    )

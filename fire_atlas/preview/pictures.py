"""Animated images and contact sheets of an atlas."""

import io
import struct
from collections.abc import Iterable
from pathlib import Path
from typing import Literal

import cv2
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from fire_atlas.atlas.encode import as_straight, encode_frame
from fire_atlas.core.clip import Clip
from fire_atlas.core.files import open_file
from fire_atlas.core.picture import with_alpha
from fire_atlas.core.pixels import Bytes, encode_bytes, expose
from fire_atlas.effect.flakes.drawing import draw_frame
from fire_atlas.effect.flakes.texture import TextureCells
from fire_atlas.effect.flakes.tracks import Tracks
from fire_atlas.formats.atlas.texture_packer import AtlasFile
from fire_atlas.formats.movies.movie import Movie
from fire_atlas.formats.movies.write import write_movie
from fire_atlas.formats.pages import png
from fire_atlas.preview.blend import blend
from fire_atlas.preview.cut_frames import aligned_frames, cut_frames, shown_alpha, texture_of

Color = tuple[int, int, int]
"""sRGB, 0..255."""

AnimationKind = Literal["gif", "webp", "apng"]

_COLUMNS = 12
_MAX_SIDE = 192
"""Maximum side of a picture in a contact sheet, px."""
_GAP = 4
_LABEL = 16
_LABEL_COLOR = (170, 170, 180)


def animated_image(atlas: AtlasFile, kind: AnimationKind, background: Color | None) -> bytes:
    """Return a GIF, WebP or APNG file of an atlas that plays over ``background``, signed.

    Without one it is transparent, in a GIF by a pattern of dots.
    """
    how = shown_alpha(atlas.sheet), atlas.sheet.blend_space
    pictures = [
        as_straight(frame, *how)
        if background is None
        else with_alpha(blend(frame, background, *how))
        for frame in aligned_frames(atlas)
    ]
    height, width = pictures[0].shape[:2]
    durations = tuple(frame.duration for frame in atlas.frames)
    return _signed(write_movie(kind, Movie(width, height, durations, True, pictures.__getitem__)))


def contact_sheet(
    atlas: AtlasFile, tracks: Tracks | None, clip: Clip | None, background: Color
) -> bytes:
    """Return a PNG with up to 12 frames of an atlas: rows of the input, the flakes and the result;
    signed.

    The frames are evenly spread. Without ``clip`` or ``tracks`` their rows are left out. If all
    animations have the same length, like the views of a fire, each has a row.
    """
    lengths = [len(animation.frames) for animation in atlas.sheet.animations]
    count = lengths[0] if len(set(lengths)) == 1 else len(atlas.frames)
    chosen = [i * count // min(count, _COLUMNS) for i in range(min(count, _COLUMNS))]
    rows = []
    if clip is not None and clip.count == count:
        rows.append([_input(clip, i, background) for i in chosen])
    if tracks is not None and tracks.round_frames == count:
        texture = texture_of(atlas, tracks)
        rows.append([_flakes(tracks, texture, i) for i in chosen])
    pictures = [
        _fit(blend(frame, background, shown_alpha(atlas.sheet), atlas.sheet.blend_space))
        for i, frame in enumerate(cut_frames(atlas))
        if i % count in chosen
    ]
    rows += [pictures[i : i + len(chosen)] for i in range(0, len(pictures), len(chosen))]
    file = io.BytesIO()
    _sheet(chosen, rows, background).save(file, "PNG")
    return _signed(file.getvalue())


_SIGNATURE = b"fire-atlas preview"
"""Identifies a picture that was made here, at its end, where every format may have a remark."""


def is_preview_picture(path: Path) -> bool:
    """Return whether a file is a picture that was made here, in this version or a later one."""
    try:
        with open_file(path) as file:
            file.seek(0, io.SEEK_END)
            file.seek(max(0, file.tell() - 64))
            return _SIGNATURE in file.read()
    except OSError:
        return False


def _signed(picture: bytes) -> bytes:
    """Return a GIF, PNG or WebP with the signature: a comment extension, a chunk ``tEXt``, or a
    chunk that readers of WebP have to ignore."""
    if picture.startswith(b"GIF8"):
        return picture[:-1] + b"\x21\xfe" + bytes([len(_SIGNATURE)]) + _SIGNATURE + b"\0;"
    if picture.startswith(png.SIGNATURE):
        remark = io.BytesIO()
        png.write_chunk(remark, b"tEXt", b"Software\0" + _SIGNATURE)
        end = len(picture) - 12  # the chunk IEND
        return picture[:end] + remark.getvalue() + picture[end:]
    chunk = b"NOTE" + struct.pack("<I", len(_SIGNATURE)) + _SIGNATURE  # of an even length
    size = struct.pack("<I", len(picture) + len(chunk) - 8)
    return picture[:4] + size + picture[8:] + chunk


def _flakes(tracks: Tracks, texture: TextureCells | None, i: int) -> Bytes:
    cells = tracks.texture.cells[i] if tracks.texture is not None else None
    rows, tiles = tracks.frames[i], tracks.tiles
    light = draw_frame(rows, tracks.height, tracks.width, False, texture, cells, tiles=tiles)
    return _fit(encode_bytes(expose(light.rgb())))


def _input(clip: Clip, i: int, background: Color) -> Bytes:
    image = encode_frame(clip.read(i), "straight", "srgb")
    return _fit(blend(image, background, "straight", "srgb"))


def _fit(picture: Bytes) -> Bytes:
    """Return a picture, shrunk to ``_MAX_SIDE`` if it is larger."""
    height, width = picture.shape[:2]
    scale = min(1.0, _MAX_SIDE / max(height, width))
    size = max(1, round(width * scale)), max(1, round(height * scale))
    return np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), np.uint8)


def _sheet(numbers: Iterable[int], rows: list[list[Bytes]], background: Color) -> Image.Image:
    """Return rows of pictures of one size, with frame numbers on top."""
    height = max(picture.shape[0] for row in rows for picture in row) + _GAP
    width = max(picture.shape[1] for row in rows for picture in row) + _GAP
    size = len(rows[0]) * width + _GAP, len(rows) * height + _LABEL + _GAP
    sheet = Image.new("RGB", size, background)
    draw, font = ImageDraw.Draw(sheet), ImageFont.load_default()
    for column, number in enumerate(numbers):
        left = _GAP + column * width
        draw.text((left, 2), str(number), fill=_LABEL_COLOR, font=font)
        for row, pictures in enumerate(rows):
            sheet.paste(Image.fromarray(pictures[column]), (left, _LABEL + _GAP + row * height))
    return sheet

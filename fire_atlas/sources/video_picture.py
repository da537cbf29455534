"""Turn a decoded video frame into a picture: square pixels, upright, in sRGB."""

import struct
import threading
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from av.sidedata.sidedata import Type as SideData
from av.video.reformatter import (
    ColorRange,
    ColorTrc,
    Interpolation,
    VideoReformatter,
)
from av.video.reformatter import Colorspace as Matrix
from numpy.typing import NDArray

from fire_atlas.core.errors import SourceError
from fire_atlas.core.picture import Picture
from fire_atlas.core.pixels import srgb_to_linear
from fire_atlas.sources.colours import IDENTITY, PRIMARIES, ToneAndMatrix, matrix_to_srgb
from fire_atlas.sources.orientation import IN_WORDS, UPRIGHT, turned, turned_size

_SCALING = (
    Interpolation.BICUBIC
    | Interpolation.ACCURATE_RND
    | Interpolation.FULL_CHR_H_INT
    | Interpolation.FULL_CHR_H_INP
)
"""Without the last three, swscale repeats chroma instead of interpolating it, and its colours are
off by 2 of 255 on average, and by 6 for one pixel in a hundred."""

_HD = 720
"""Lines from which on a video that does not say so has the colours of BT.709; below, of BT.601."""

_MATRICES = {1: Matrix.ITU709, 4: Matrix.FCC, 5: Matrix.ITU601, 6: Matrix.ITU601,
             7: Matrix.SMPTE240M, 9: Matrix.BT2020}  # fmt: skip
"""Of FFmpeg's numbers of a matrix from YCbCr (``AVColorSpace``), swscale's."""

_RGB, _UNSTATED = 0, 2

_BEYOND_WHITE = {
    ColorTrc.LINEAR: "linear light", ColorTrc.LOG: "logarithmic", ColorTrc.LOG_SQRT: "logarithmic",
    ColorTrc.SMPTE2084: "PQ (HDR10, Dolby Vision)", ColorTrc.SMPTE428: "that of digital cinema",
}  # fmt: skip
"""Tone curves for which there is no one right picture in sRGB."""

_WIDE_GAMUT = (9, 11, 12)
"""Of the primaries' numbers in ITU-T H.273, those beyond sRGB: BT.2020 and both P3. All others are
shown as sRGB, as players do."""

_SHARED_WHITE = 0.203
"""Display light of HLG's reference white, of its peak: that of the signal 0.75 (ITU-R BT.2408)."""

_SHOULDER = 0.6
"""Light, of sRGB's white, up to which that of HLG is kept; above, it is compressed."""

_of_thread = threading.local()


@dataclass(frozen=True, slots=True)
class VideoLook:
    """How frames are stored, and what must be done to show them.

    Attributes:
        stored: Width and height of the decoded frames, px.
        squared: Width, px, at which their pixels are square.
        orientation: How they are stored, 1..8 as in EXIF; None if the file states a turn that is no
            quarter turn, and is not honoured.
        matrix: swscale's number of the matrix from YCbCr to R'G'B'.
        full_range: Whether the file says that black is 0 and white is the largest value.
        is_hlg: Whether the tone curve is HLG's.
        primaries: Colours of R, G and B, by their number in ITU-T H.273.
        deinterlaced: Whether frames consist of two fields, of different times.
    """

    stored: tuple[int, int]
    squared: int
    orientation: int | None
    matrix: int
    full_range: bool
    is_hlg: bool
    primaries: int
    deinterlaced: bool

    @classmethod
    def of(cls, path: Path, frame: Any, pixel_aspect: Fraction | None) -> "VideoLook":
        """Return the look of a video by its first frame.

        Args:
            path: The file, for messages.
            frame: The ``av.VideoFrame``.
            pixel_aspect: Width of a pixel by its height; None if the file states none.

        Raises:
            SourceError: Its colours cannot be shown in sRGB without a choice of the user's.
        """
        _check_colours(path, frame)
        hd = Matrix.ITU709 if frame.height >= _HD else Matrix.ITU601
        return cls(
            stored=(frame.width, frame.height),
            squared=max(1, round(frame.width * (pixel_aspect or 1))),
            orientation=_orientation(frame),
            matrix=_MATRICES.get(frame.colorspace, hd),
            full_range=frame.color_range == ColorRange.JPEG,
            is_hlg=frame.color_trc == ColorTrc.ARIB_STD_B67,
            primaries=frame.color_primaries,
            deinterlaced=frame.interlaced_frame,
        )

    def notes_on(self, path: Path) -> list[str]:
        """Return what is unusual about the file, and what is done about it, for the user."""
        notes, (width, height) = list[str](), self.stored
        if self.deinterlaced:
            notes.append("it is interlaced: the two fields of each frame are made one by bwdif")
        if self.squared != width:
            notes.append(
                f"its pixels are not square: frames of {width}x{height} become "
                f"{self.squared}x{height}"
            )
        if turn := IN_WORDS.get(self.orientation or UPRIGHT):
            notes.append(f"its frames are shown {turn}, as it states")
        if self.orientation is None:
            notes.append("it states a turn that is no quarter turn: its frames are not turned")
        if self.is_hlg:
            notes.append("its tone curve is HLG: what is brighter than white is compressed")
        elif self.primaries in _WIDE_GAMUT:
            notes.append("its colours have a wide gamut: those beyond sRGB are clipped")
        return [f"{path.name}: {note}" for note in notes]

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the pictures, px."""
        return turned_size(self.squared, self.stored[1], self.orientation or UPRIGHT)

    def picture(self, frame: Any) -> Picture:
        """Return a decoded frame (``av.VideoFrame``) as R, G, B(, A), with 16 bits if it has more
        than 8. Several threads may call this at once."""
        parts = frame.format.components
        has_alpha = frame.format.has_palette or any(part.is_alpha for part in parts)
        is_deep = self.is_hlg or max(part.bits for part in parts) > 8
        if not hasattr(_of_thread, "reformatter"):
            _of_thread.reformatter = VideoReformatter()
        # Into planes: swscale's code for these rounds alike, in a quarter of the time.
        planar = _of_thread.reformatter.reformat(
            frame,
            self.squared,
            frame.height,
            ("gbrap" if has_alpha else "gbrp") + ("16le" if is_deep else ""),
            src_colorspace=self.matrix,
            src_color_range=ColorRange.JPEG if self.full_range else None,
            dst_color_range=ColorRange.JPEG,
            interpolation=_SCALING,
            threads=1,
        )
        green, blue, red, *alpha = (_samples(plane, is_deep) for plane in planar.planes)
        picture = cv2.merge([red, green, blue, *alpha])
        if conversion := _conversion(self.is_hlg, self.primaries):
            picture = conversion.apply(picture)
        return turned(picture, self.orientation or UPRIGHT)


@cache
def _conversion(is_hlg: bool, primaries: int) -> ToneAndMatrix | None:
    """Return what turns the colours of a video into sRGB; None if nothing must be done."""
    if not is_hlg and primaries not in _WIDE_GAMUT:
        return None
    curve = _light_of_hlg if is_hlg else _light_of_srgb
    matrix = matrix_to_srgb(PRIMARIES[primaries]) if primaries in _WIDE_GAMUT else None
    return ToneAndMatrix((curve, curve, curve), matrix or IDENTITY)


def _light_of_srgb(value: NDArray[np.float64]) -> NDArray[np.float64]:
    return srgb_to_linear(value).astype(np.float64)


def _check_colours(path: Path, frame: Any) -> None:
    if curve := _BEYOND_WHITE.get(frame.color_trc):
        raise SourceError(
            f"{path}: its tone curve is {curve}, for which sRGB has no one right picture; map it "
            f"first: ffmpeg -i {path.name} -vf zscale=transfer=linear:npl=203,tonemap=hable,"
            f"zscale=primaries=bt709:transfer=bt709:matrix=bt709:range=tv,format=yuv420p "
            f"{path.stem}_sdr.mp4"
        )
    if frame.colorspace not in (_RGB, _UNSTATED, *_MATRICES):
        raise SourceError(
            f"{path}: its colours are stored in a way that is not known (number {frame.colorspace} "
            f"in FFmpeg's list of colour spaces); export it again, as H.264 in MP4"
        )


def _orientation(frame: Any) -> int | None:
    """Return how ``frame`` is stored, 1..8 as in EXIF; None if no quarter turn makes it upright.

    A display matrix (a, b, u, c, d, v, x, y, w), 16.16 fixed point, shows the pixel at (x, y) at
    (a x + c y, b x + d y).
    """
    entries = (frame.side_data[i] for i in range(len(frame.side_data)))
    stored = next((bytes(entry) for entry in entries if entry.type == SideData.DISPLAYMATRIX), b"")
    if len(stored) < 36:
        return UPRIGHT
    a, b, _, c, d, *_ = struct.unpack("<9i", stored[:36])
    if a and d and not b and not c:
        turns = {(True, True): 1, (False, True): 2, (False, False): 3, (True, False): 4}
        return turns[a > 0, d > 0]
    if b and c and not a and not d:
        turns = {(True, True): 5, (False, True): 6, (False, False): 7, (True, False): 8}
        return turns[c > 0, b > 0]
    return None


def _samples(plane: Any, is_deep: bool) -> NDArray[Any]:
    """Return a plane of a frame, (H, W) uint8 or uint16; valid as long as the frame is."""
    dtype = np.dtype(np.uint16 if is_deep else np.uint8)
    rows = np.frombuffer(plane, dtype).reshape(plane.height, plane.line_size // dtype.itemsize)
    return rows[:, : plane.width]


def _light_of_hlg(signal: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the linear light, of sRGB's white, of HLG values 0..1.

    The inverse OETF (ITU-R BT.2100, table 5), and the system gamma of a display of 1000 cd/m². The
    light is relative to reference white; above ``_SHOULDER`` a hyperbola, of slope 1 where it
    begins, leads to 1 for the peak.
    """
    a, b, c = 0.17883277, 0.28466892, 0.55991073
    scene = np.where(signal <= 0.5, signal**2 / 3, (np.exp((signal - c) / a) + b) / 12)
    shown = scene**1.2 / _SHARED_WHITE
    beyond, room = np.maximum(shown - _SHOULDER, 0), 1 - _SHOULDER
    peak = 1 / _SHARED_WHITE - _SHOULDER
    # x / (1 + x / s) tends to s: chosen so that the peak reaches ``room``.
    compressed = beyond / (1 + beyond * (1 / room - 1 / peak))
    return np.where(shown <= _SHOULDER, shown, _SHOULDER + compressed)

"""Encode images as blocks of a texture, the ones that are worth it with more effort.

Most blocks of a page are empty or the same as another, so each is encoded once. A draft is encoded
fast. Of a final texture those that hold most of the error, as it is seen, are encoded once more and
better, where that takes less time than to encode all of them well.

The encoders are packages of the extra ``gpu``; they release the interpreter's lock, so blocks of
all formats are encoded side by side in the pool.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple, TypeAlias, cast

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import Bytes
from fire_atlas.core.workers import Workers
from fire_atlas.formats.textures.astc import encode_astc
from fire_atlas.formats.textures.blocks import BlockFormat, decode_whole
from fire_atlas.recipe.gpu import GpuQuality

Content: TypeAlias = Literal["straight", "premultiplied", "data"]
"""What pixels hold: colours, by how alpha is stored, or vectors and other values."""

_BAND_ROWS = 32
"""Rows of blocks that are cut out at a time."""

_BAND_BLOCKS = 8192
"""Blocks that are encoded at a time, of which the worst get more effort."""

_EVEN_ROWS = 128
"""Rows of an image whose colours are made even at a time."""

_AROUND = (5, 5)
"""Size of the neighbourhood, px, whose mean straight colours move to: about that of a block."""

_NO_COVER = 1e-2
"""Mean alpha, of 255, up to which a neighbourhood is empty: sums in float32 may not be 0 there."""

_OPAQUE = 128
"""Alpha from which a step of a straight colour is more than half a step of what is seen."""


class _Pass(NamedTuple):
    """A pass over all blocks, or over those that hold most of the error which the pass before has
    left."""

    effort: float
    """How hard the encoder searches: of BC7 0 to 4, of ASTC a quality of 0 to 100."""
    share: float = 1.0
    """Part of the squared error that these blocks hold."""


_FAST = (_Pass(0),)
"""The only pass of a draft, and of encoders that take no effort."""

_PASSES: dict[tuple[str, Content], tuple[_Pass, ...]] = {
    ("bc7", "straight"): (_Pass(0), _Pass(2, 0.95)),
    ("bc7", "premultiplied"): (_Pass(0), _Pass(2, 0.97), _Pass(4, 0.3)),
    ("bc7", "data"): (_Pass(0), _Pass(2, 0.97)),
    ("astc", "straight"): (_Pass(0), _Pass(70, 0.96), _Pass(98, 0.4)),
    ("astc", "premultiplied"): (_Pass(80),),
    ("astc", "data"): (_Pass(80),),
}
"""The passes of encoders that can take more effort, of a final texture. Shares were chosen on
samples of the blocks of six clips, so that BC7 loses about as little as with an effort of 2 for
all; straight colours, whose errors encoders weigh less well, gain. ASTC's encoder itself spends
little on blocks that are easy: to leave these out saves nothing."""


@dataclass(frozen=True, slots=True)
class _Cut:
    """The blocks of images, each different one once.

    Attributes:
        blocks: The pixels of each, (blocks, side, side, 4).
        places: For every block of the images, row by row, which of these it is.
    """

    blocks: Bytes
    places: NDArray[np.intp]


def encode_images(
    images: Sequence[Bytes],
    formats: Sequence[BlockFormat],
    srgb: bool,
    workers: Workers,
    *,
    quality: GpuQuality = "final",
    content: Content = "premultiplied",
) -> list[list[bytes]]:
    """Return the blocks of each image in each format, row by row; beyond it its edge is repeated.

    Args:
        images: Pixels (H, W, 4) uint8. Of a format of fewer channels, the first ones are encoded.
        formats: How blocks are encoded.
        srgb: Whether a GPU decodes colours from sRGB as it samples them.
        workers: Encode bands of blocks.
        quality: ``draft`` encodes fast, and loses more.
        content: What the pixels hold. Alpha says how much is seen of a straight colour: less is
            spent on what hardly shows.
    """
    if content == "straight" and all(image[..., 3].min() == 255 for image in images):
        content = "premultiplied"  # it is both
    if content == "straight":
        images = [_with_even_colour(image, workers) for image in images]
    cuts = {
        side: _cut(images, side, workers)
        for side in dict.fromkeys(format_.side for format_ in formats)
    }
    found = [
        np.empty((len(cuts[format_.side].blocks), format_.block_bytes), np.uint8)
        for format_ in formats
    ]
    # Every so many blocks of all, not neighbours: each band is then a fair sample of them.
    bands = [
        (format_, cuts[format_.side].blocks[band], target[band])
        for format_, target in zip(formats, found, strict=True)
        for band in _bands(len(target))
    ]

    def encode(band: tuple[BlockFormat, Bytes, Bytes]) -> None:
        format_, blocks, target = band
        target[:] = _encode(format_, srgb, quality, content, blocks)

    for _ in workers.map(encode, bands):
        pass
    return [
        _laid_out(encoded, cuts[format_.side].places, images, format_)
        for format_, encoded in zip(formats, found, strict=True)
    ]


def _bands(count: int) -> list[slice]:
    """Return which of so many blocks are encoded at a time."""
    bands = -(-count // _BAND_BLOCKS)
    return [slice(first, None, bands) for first in range(bands)]


def _laid_out(
    encoded: Bytes, places: NDArray[np.intp], images: Sequence[Bytes], format_: BlockFormat
) -> list[bytes]:
    """Return the blocks of each image, of those that were ``encoded`` once each."""
    sizes = [format_.level_bytes(image.shape[1], image.shape[0]) for image in images]
    ends = np.cumsum(sizes) // format_.block_bytes
    return [encoded[part].tobytes() for part in np.split(places, ends[:-1])]


def _cut(images: Sequence[Bytes], side: int, workers: Workers) -> _Cut:
    """Return the blocks of images."""
    rows = _BAND_ROWS * side
    bands = [image[top : top + rows] for image in images for top in range(0, len(image), rows)]

    def cut(band: Bytes) -> _Cut:
        height, width = band.shape[:2]
        whole = np.pad(band, ((0, -height % side), (0, -width % side), (0, 0)), mode="edge")
        blocks = whole.reshape(len(whole) // side, side, -1, side, 4).swapaxes(1, 2)
        return _different(blocks.reshape(-1, side, side, 4))

    parts = list(workers.map(cut, bands))
    starts = np.cumsum([0] + [len(part.blocks) for part in parts])
    places = [start + part.places for start, part in zip(starts, parts, strict=False)]
    blocks = np.concatenate([part.blocks for part in parts])
    del parts  # as large as these
    merged = workers.start(lambda: _different(blocks)).result()
    return _Cut(merged.blocks, merged.places[np.concatenate(places)])


def _different(blocks: Bytes) -> _Cut:
    """Return each different one of blocks (n, side, side, 4) once."""
    whole = np.ascontiguousarray(blocks).reshape(len(blocks), -1)
    values = whole.view(np.dtype((np.void, whole.shape[1])))[:, 0]
    _, first, places = np.unique(values, return_index=True, return_inverse=True)
    return _Cut(blocks[first], places)


def _with_even_colour(image: Bytes, workers: Workers) -> Bytes:
    """Return pixels (H, W, 4) whose straight colours vary less where they hardly show.

    Each colour moves towards the mean of those around it, weighted by their alpha, as far as its
    premultiplied value allows that stays the same but for rounding. Where alpha is low, straight
    colours are mostly such rounding, and blocks would spend their bits on it.
    """

    def even(top: int) -> Bytes:
        return _even_band(image[top : top + _EVEN_ROWS])

    return np.concatenate(list(workers.map(even, range(0, len(image), _EVEN_ROWS))))


def _even_band(image: Bytes) -> Bytes:
    alpha = cv2.extractChannel(image, 3)
    if not alpha.any():
        return image
    weights = cv2.merge([alpha, alpha, alpha, np.ones_like(alpha)])
    sums = cv2.multiply(image, weights, dtype=cv2.CV_32F)
    sums = cv2.blur(sums, _AROUND, borderType=cv2.BORDER_REPLICATE)
    moves = (alpha < _OPAQUE) & (cv2.extractChannel(sums, 3) > _NO_COVER)
    even, mean = image.copy(), sums[moves]
    colour = image[moves].astype(np.float32)
    reach = np.floor(127.5 / np.maximum(colour[:, 3:], 0.5))
    near = np.clip(mean[:, :3] / mean[:, 3:], colour[:, :3] - reach, colour[:, :3] + reach)
    colour[:, :3] = np.rint(near).clip(0, 255)
    even[moves] = colour.astype(np.uint8)
    return even


def _encode(
    format_: BlockFormat, srgb: bool, quality: GpuQuality, content: Content, blocks: Bytes
) -> Bytes:
    """Return the encoded blocks (n, bytes) of pixels (n, side, side, 4)."""
    encoder, is_straight = format_.name.partition("-")[0], content == "straight"
    first, *further = _PASSES.get((encoder, content), _FAST) if quality == "final" else _FAST
    encoded = _encode_once(blocks, format_, srgb, first.effort, is_straight)
    if not further:
        return encoded
    seen = _seen(blocks, is_straight)
    errors = _errors(encoded, seen, format_, srgb, is_straight)
    for step in further:
        worst = _holding(errors, step.share)
        again = _encode_once(blocks[worst], format_, srgb, step.effort, is_straight)
        others = _errors(again, seen[worst], format_, srgb, is_straight)
        is_better = others < errors[worst]
        encoded[worst[is_better]] = again[is_better]
        errors[worst[is_better]] = others[is_better]
    return encoded


def _holding(errors: NDArray[np.float64], share: float) -> NDArray[np.intp]:
    """Return the fewest blocks, the worst first, that hold a share of all errors."""
    order = np.argsort(-errors, kind="stable")
    sums = np.cumsum(errors[order])
    return order[: np.searchsorted(sums, share * sums[-1]) + 1]


def _errors(
    encoded: Bytes,
    seen: NDArray[np.int32],
    format_: BlockFormat,
    srgb: bool,
    is_straight: bool,
) -> NDArray[np.float64]:
    """Return the sum of squared differences of each encoded block from what is to be seen."""
    side = format_.side
    strip = decode_whole(encoded.tobytes(), side * len(encoded), side, format_, srgb)
    blocks = strip.reshape(side, -1, side, 4).swapaxes(0, 1)
    difference = (_seen(blocks, is_straight) - seen).astype(np.float64)
    return cast("NDArray[np.float64]", np.einsum("nxyc,nxyc->n", difference, difference))


def _seen(blocks: Bytes, is_straight: bool) -> NDArray[np.int32]:
    """Return pixels (..., 4) with premultiplied colours, of which a step is 255 if straight."""
    values = blocks.astype(np.int32)
    if is_straight:
        values[..., :3] *= values[..., 3:]
        values[..., 3] *= 255
    return values


def _encode_once(
    blocks: Bytes, format_: BlockFormat, srgb: bool, effort: float, is_straight: bool
) -> Bytes:
    """Return the encoded blocks (n, bytes), all with the same effort: as an image of one row."""
    side = format_.side
    strip = np.ascontiguousarray(blocks.swapaxes(0, 1)).reshape(side, -1, 4)
    if format_.name.startswith("astc"):
        data = encode_astc(strip, side, srgb, effort, is_straight)
    else:
        data = _by_etcpak(strip, format_, int(effort))
    return np.frombuffer(data, np.uint8).reshape(len(blocks), -1).copy()


_ETCPAK = {"etc2": "etc2_rgba", "eac-r11": "eac_r", "eac-rg11": "eac_rg"}
"""What etcpak calls a format, if by another name."""


def _by_etcpak(image: Bytes, format_: BlockFormat, effort: int) -> bytes:
    """Encode whole blocks by etcpak; BC7 with equal weights, not for the eye: alpha counts too."""
    import etcpak

    height, width = image.shape[:2]
    if format_.name == "bc7":
        settings = etcpak.BC7CompressBlockParams()
        settings.init_linear_weights()
        settings.m_uber_level = effort
        settings.m_mode17_partition_estimation_filterbank = False
        if not effort:
            settings.m_max_partitions = 0
        return etcpak.compress_bc7(image.tobytes(), width, height, settings)
    encode = getattr(etcpak, f"compress_{_ETCPAK.get(format_.name, format_.name)}")
    # Of EAC R11 it returns twice as many bytes; those of the second half mean nothing.
    return bytes(encode(image.tobytes(), width, height)[: format_.level_bytes(width, height)])

"""Compressed textures: what other decoders and readers find in the files that we write."""

import io
import json
import math
import os
import struct
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
import texture2ddecoder
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image
from zstandard import ZstdDecompressor

from fire_atlas.atlas.encode import encode_frame
from fire_atlas.core.errors import SourceError
from fire_atlas.core.pixels import Bytes
from fire_atlas.core.workers import Workers
from fire_atlas.formats.textures.astc import encode_astc
from fire_atlas.formats.textures.blocks import FORMATS, BlockFormat, decode_blocks
from fire_atlas.formats.textures.dds import read_dds, write_dds
from fire_atlas.formats.textures.encode import Content, _Pass, encode_images
from fire_atlas.formats.textures.error import colour_texture_error, data_error
from fire_atlas.formats.textures.gpu_texture import AlphaMode, TextureHeader, level_sizes
from fire_atlas.formats.textures.ktx2 import read_ktx2, supercompressed, write_ktx2
from fire_atlas.formats.textures.texture_file import read_texture, write_texture
from fire_atlas.recipe.gpu import GpuQuality
from tests.support.clips import campfire
from tests.support.requirements import node_modules

PARSE = Path(__file__).parent / "web" / "parse_ktx2.mjs"
SAMPLE = PARSE.with_name("sample_textures.mjs")
DDS = [name for name in FORMATS if name.startswith("bc")]
OLD_DDS = ["bc1", "bc3"]
"""Formats that readers know which have not learnt Direct3D 10's header."""


@pytest.fixture(scope="module")
def workers() -> Iterator[Workers]:
    with Workers(2) as pool:
        yield pool


@pytest.fixture(scope="module")
def fire() -> Bytes:
    """A frame of the sample campfire as a premultiplied page has it, cut to whole blocks, those of
    its half too."""
    image = encode_frame(campfire(height=144, count=4).read(2), "premultiplied", "srgb")
    return np.ascontiguousarray(image[: len(image) // 24 * 24, : image.shape[1] // 24 * 24])


def encode_blocks(
    image: Bytes, format_: BlockFormat, srgb: bool, workers: Workers,
    content: Content = "premultiplied", quality: GpuQuality = "final",
) -> bytes:  # fmt: skip
    """The blocks of one image in one format."""
    ((data,),) = encode_images([image], [format_], srgb, workers, quality=quality, content=content)
    return data


OTHERS = {"etc2": "etc2a8", "eac-r11": "eacr", "eac-rg11": "eacrg"}
"""What texture2ddecoder calls a format, if by another name."""

MOST_OFF = {"bc1": 6, "bc3": 5, "astc-6x6": 4, "astc-8x8": 6, "etc2": 5}
"""Mean error, of 255, on the sample campfire of formats that lose more than 2."""

FEW = [name for name, format_ in FORMATS.items() if format_.channels < 3]


def other_decoder(name: str, data: bytes, width: int, height: int) -> Bytes:
    """The pixels that texture2ddecoder, which gives BGRA, finds in blocks."""
    if name.startswith("astc"):
        side = FORMATS[name].side
        decoded = texture2ddecoder.decode_astc(data, width, height, side, side)
    else:
        decode = getattr(texture2ddecoder, f"decode_{OTHERS.get(name, name)}")
        decoded = decode(data, width, height)
    return np.frombuffer(decoded, np.uint8).reshape(height, width, 4)[..., [2, 1, 0, 3]]


def header_of(name: str, image: Bytes, levels: int = 1, **changes: Any) -> TextureHeader:
    height, width = image.shape[:2]
    sizes = level_sizes(FORMATS[name], width, height, levels)
    alpha = "straight" if FORMATS[name].channels == 4 else "opaque"
    return TextureHeader(FORMATS[name], width, height, **{"srgb": False, "alpha": alpha, **changes,
                                                          "sizes": sizes})  # fmt: skip


@pytest.mark.parametrize("name", FORMATS)
@pytest.mark.parametrize("srgb", [False, True])
def test_another_decoder_finds_the_same_pixels(
    name: str, srgb: bool, fire: Bytes, workers: Workers
) -> None:
    height, width = fire.shape[:2]
    data = encode_blocks(fire, FORMATS[name], srgb, workers)
    ours = decode_blocks(data, width, height, FORMATS[name], srgb, workers)
    theirs = other_decoder(name, data, width, height)
    channels = FORMATS[name].channels
    # ASTC interpolates in 16 bits, of which an sRGB format keeps the upper 8: decoders that ignore
    # that are off by one. Of the 11 bits of EAC they cut off what we round.
    most = 1 if name.startswith(("astc", "eac")) else 0
    difference = np.abs(ours.astype(int) - theirs)[..., :channels]
    assert difference.max() <= most
    seen = np.abs(ours.astype(int) - fire)[..., :channels]
    assert seen.mean() < MOST_OFF.get(name, 2)


@pytest.mark.parametrize("name", OTHERS)
def test_any_blocks_of_etc_are_decoded_as_another_decoder_does(name: str) -> None:
    """Blocks of chance have all modes, which an encoder may never choose."""
    format_ = FORMATS[name]
    size = format_.level_bytes(256, 256)
    data = np.random.default_rng(5).integers(0, 256, size, np.uint8).tobytes()
    with Workers(1) as workers:
        ours = decode_blocks(data, 256, 256, format_, False, workers)
    theirs = other_decoder(name, data, 256, 256)
    difference = np.abs(ours.astype(int) - theirs)[..., : format_.channels]
    assert difference.max() <= (0 if name == "etc2" else 1)


@pytest.mark.parametrize("name", FORMATS)
def test_sizes_that_are_no_whole_blocks_repeat_their_edge(name: str, workers: Workers) -> None:
    image = np.full((7, 13, 4), (200, 90, 20, 255), np.uint8)
    format_ = FORMATS[name]
    data = encode_blocks(image, format_, False, workers)
    assert len(data) == format_.level_bytes(13, 7)
    decoded = decode_blocks(data, 13, 7, format_, False, workers)
    assert decoded.shape == (7, 13, 4)
    difference = np.abs(decoded.astype(int) - image)[..., : format_.channels]
    assert difference.max() <= (8 if name in {"bc1", "bc3", "etc2"} else 2)


@pytest.mark.parametrize("name", FORMATS)
def test_the_same_bytes_by_one_worker_and_by_two(name: str, fire: Bytes) -> None:
    tall = np.concatenate([fire, fire[::-1], fire])
    made = set()
    for jobs in (1, 2, 2):
        with Workers(jobs) as pool:
            made.add(encode_blocks(tall, FORMATS[name], True, pool))
    assert len(made) == 1


@pytest.mark.parametrize("name", DDS)
def test_pillow_opens_our_dds_and_sees_its_pixels(name: str, fire: Bytes, workers: Workers) -> None:
    header = header_of(name, fire)
    data = encode_blocks(fire, header.format, False, workers)
    file = io.BytesIO()
    write_dds(file, header, [data])
    with Image.open(file) as opened:
        assert opened.format == "DDS"
        theirs = np.asarray(opened).reshape(*fire.shape[:2], -1)
    ours = decode_blocks(data, header.width, header.height, header.format, False, workers)
    channels = header.format.channels
    assert np.array_equal(theirs[..., :channels], ours[..., :channels])


@pytest.mark.parametrize("alpha", ["straight", "premultiplied"])
@pytest.mark.parametrize("name", OLD_DDS)
def test_imagemagick_opens_dds_of_direct3d_9(
    name: str, alpha: AlphaMode, imagemagick: str, fire: Bytes, workers: Workers, tmp_path: Path
) -> None:
    header = header_of(name, fire, alpha=alpha)
    data = encode_blocks(fire, header.format, False, workers)
    with (tmp_path / "fire.dds").open("wb") as file:
        write_dds(file, header, [data])
    done = subprocess.run(
        [imagemagick, tmp_path / "fire.dds", "-depth", "8", "rgba:-"],
        capture_output=True, check=True,
    )  # fmt: skip
    assert not done.stderr
    theirs = np.frombuffer(done.stdout, np.uint8).reshape(fire.shape)
    ours = decode_blocks(data, header.width, header.height, header.format, False, workers)
    channels = header.format.channels
    assert np.abs(ours.astype(int) - theirs)[..., :channels].max() <= 2


NAMES = st.sampled_from(list(FORMATS))


@given(NAMES, st.integers(1, 70), st.integers(1, 70), st.integers(1, 7), st.booleans(),
       st.booleans())  # fmt: skip
def test_headers_come_back_and_levels_are_where_they_should_be(
    name: str, width: int, height: int, levels: int, srgb: bool, premultiplied: bool
) -> None:
    format_ = FORMATS[name]
    srgb &= name not in FEW
    alpha: Literal["straight", "premultiplied", "opaque"] = "opaque"
    if format_.channels == 4:
        alpha = "premultiplied" if premultiplied else "straight"
    sizes = level_sizes(format_, width, height, levels)
    header = TextureHeader(format_, width, height, srgb, alpha, sizes)
    data = [bytes([level + 1]) * size for level, size in enumerate(sizes)]
    ktx2, dds = io.BytesIO(), io.BytesIO()
    write_ktx2(ktx2, header, data)
    assert read_ktx2(ktx2.getvalue()) == header
    for level, (place, size) in enumerate(level_index(ktx2.getvalue())):
        assert ktx2.getvalue()[place : place + size] == data[level]
        assert place % math.lcm(format_.block_bytes, 4) == 0
    if name in DDS:
        write_dds(dds, header, data)
        has_old_header = name in OLD_DDS and not srgb
        read = read_dds(dds.getvalue())
        assert read == (replace(header, alpha="unstated") if has_old_header else header)
        assert dds.getvalue()[128 if has_old_header else 148 :] == b"".join(data)


def level_index(data: bytes) -> list[tuple[int, int]]:
    """Where the levels of a KTX2 file are, and how long."""
    (count,) = struct.unpack_from("<I", data, 40)
    return [struct.unpack_from("<2Q", data, 80 + 24 * level) for level in range(count)]


@pytest.mark.parametrize("ending", [".dds", ".ktx2"])
@pytest.mark.parametrize("kept", [0, 60, 150, -1])
def test_files_that_are_cut_off_are_refused_with_advice(
    ending: str, kept: int, fire: Bytes, workers: Workers, tmp_path: Path
) -> None:
    header = header_of("bc7", fire)
    file = io.BytesIO()
    levels = [encode_blocks(fire, header.format, False, workers)]
    (write_dds if ending == ".dds" else write_ktx2)(file, header, levels)
    path = tmp_path / f"fire{ending}"
    path.write_bytes(file.getvalue()[:kept])
    with pytest.raises(SourceError, match=r"build the recipe again"):
        read_texture(path)
    path.write_bytes(b"x" * 4000)
    with pytest.raises(SourceError, match="that fire-atlas wrote"):
        read_texture(path)


@pytest.mark.parametrize("alpha", ["straight", "premultiplied", "additive"])
def test_the_error_is_that_of_a_recount(alpha: str, fire: Bytes, workers: Workers) -> None:
    chance = np.random.default_rng(3)
    image = fire.copy()
    if alpha == "additive":
        image[..., 3] = 0
    moved = chance.integers(-6, 7, image.shape)
    decoded = np.clip(image + moved, 0, 255).astype(np.uint8)
    error = colour_texture_error(decoded, image, alpha, "srgb", workers)
    one, other = (each.astype(np.float64) for each in (decoded, image))
    if alpha == "straight":
        for each in (one, other):
            each[..., :3] *= each[..., 3:] / 255
    visible = (image[..., 3] > 2) | (other[..., :3].max(axis=2) > 2)
    shown = (one - other)[visible][:, : 3 if alpha == "additive" else 4]
    assert error.psnr == pytest.approx(10 * math.log10(255**2 / np.mean(shown**2)), abs=0.006)
    assert error.hue is not None and error.hue > 1
    assert colour_texture_error(image, image, alpha, "srgb", workers).psnr == 99


def test_vectors_are_compared_in_their_channels_alone(workers: Workers) -> None:
    image = np.full((20, 30, 4), 128, np.uint8)
    other = image.copy()
    other[..., 2:] = 0
    assert data_error(other, image, 2, workers).psnr == 99
    other[..., 1] += 3
    expected = 10 * math.log10(255**2 / (9 / 2))
    assert data_error(other, image, 2, workers).psnr == pytest.approx(expected, abs=0.006)


def packed(header: TextureHeader, levels: list[bytes], workers: Workers) -> io.BytesIO:
    """A KTX2 file whose levels are supercompressed."""
    file = io.BytesIO()
    levels = supercompressed(levels, True, workers)
    write_ktx2(file, replace(header, supercompression="zstd"), levels)
    return file


@pytest.mark.parametrize("name", ["bc7", "astc-6x6", "eac-r11"])
def test_supercompressed_levels_come_back_from_fewer_bytes(
    name: str, fire: Bytes, workers: Workers
) -> None:
    header = header_of(name, fire, 2)
    levels = [encode_blocks(each, header.format, False, workers) for each in (fire, fire[::2, ::2])]
    plain = io.BytesIO()
    write_ktx2(plain, header, levels)
    data = packed(header, levels, workers).getvalue()
    assert len(data) < 0.8 * len(plain.getvalue())
    assert read_ktx2(data) == replace(header, supercompression="zstd")
    assert read_ktx2(data).memory == read_ktx2(plain.getvalue()).memory
    for (place, size), level in zip(level_index(data), levels, strict=True):
        unpacked = ZstdDecompressor().decompress(data[place : place + size])
        assert unpacked == level
    for cut in (data[:-1], data.replace(struct.pack("<Q", len(levels[0])), bytes(8))):
        with pytest.raises(ValueError, match="level"):
            read_ktx2(cut)


@pytest.mark.parametrize("name", ["bc7", "astc-6x6"])
def test_ktx_parse_reads_supercompressed_ktx2(
    name: str, node: str, fire: Bytes, workers: Workers, tmp_path: Path
) -> None:
    header = header_of(name, fire, 2)
    levels = [encode_blocks(each, header.format, False, workers) for each in (fire, fire[::2, ::2])]
    file = tmp_path / "fire.ktx2"
    file.write_bytes(packed(header, levels, workers).getvalue())
    done = subprocess.run(
        [node, PARSE, node_modules(), file], capture_output=True, text=True, check=True
    )
    said = json.loads(done.stdout)
    assert said["scheme"] == 2 and said["unpacked"] == [len(level) for level in levels]
    assert said["levels"] == [size for _, size in level_index(file.read_bytes())]
    assert said["same"], "its writer gives the same descriptor and levels"


@pytest.mark.parametrize("name", ["bc7", "astc-6x6"])
@pytest.mark.parametrize("content", ["straight", "premultiplied"])
def test_passes_lose_no_more_than_one_of_full_effort(
    name: str, content: Literal["straight", "premultiplied"], workers: Workers,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    frames = campfire(height=240, count=4)
    images = [encode_frame(frames.read(i), content, "srgb") for i in range(4)]
    image = np.concatenate(images, axis=1)

    def psnr(quality: GpuQuality = "final") -> float:
        data = encode_blocks(image, FORMATS[name], False, workers, content, quality)
        decoded = decode_blocks(data, image.shape[1], image.shape[0], FORMATS[name], False, workers)
        return colour_texture_error(decoded, image, content, "srgb", workers).psnr

    final, draft = psnr(), psnr("draft")
    once = {("bc7", content): (_Pass(2),), ("astc", content): (_Pass(80),)}
    monkeypatch.setattr("fire_atlas.formats.textures.encode._PASSES", once)
    assert final >= psnr() + (0.05 if content == "straight" else -0.05)
    assert draft < final - 0.3


def test_equal_blocks_are_encoded_once(
    fire: Bytes, workers: Workers, monkeypatch: pytest.MonkeyPatch
) -> None:
    given = list[int]()

    def counted(image: Bytes, side: int, *rest: Any) -> bytes:
        given.append(image.shape[1] // side)
        return encode_astc(image, side, *rest)

    monkeypatch.setattr("fire_atlas.formats.textures.encode.encode_astc", counted)
    one = encode_blocks(fire, FORMATS["astc-6x6"], False, workers, quality="draft")
    blocks = fire.reshape(-1, 6, fire.shape[1] // 6, 6, 4).swapaxes(1, 2).reshape(-1, 144)
    different = len(np.unique(blocks, axis=0))
    assert sum(given) == different < len(blocks)
    tall = np.concatenate([fire, fire])
    assert encode_blocks(tall, FORMATS["astc-6x6"], False, workers, quality="draft") == one + one
    assert sum(given) == 2 * different


def test_formats_side_by_side_are_those_of_each_alone(fire: Bytes, workers: Workers) -> None:
    images = [fire, np.ascontiguousarray(fire[::2, ::2])]
    formats = [FORMATS[name] for name in ("bc7", "astc-6x6", "bc3", "astc-4x4", "bc5")]
    together = encode_images(images, formats, False, workers, content="straight")
    for format_, found in zip(formats, together, strict=True):
        assert encode_images(images, [format_], False, workers, content="straight") == [found]


@pytest.mark.parametrize("name", FORMATS)
@pytest.mark.parametrize("srgb", [False, True])
def test_ktx_parse_reads_our_ktx2(
    name: str, srgb: bool, node: str, fire: Bytes, workers: Workers, tmp_path: Path
) -> None:
    srgb &= name not in FEW
    alpha = "premultiplied" if FORMATS[name].channels == 4 else "opaque"
    header = header_of(name, fire, 2, srgb=srgb, alpha=alpha)
    levels = [encode_blocks(each, header.format, srgb, workers) for each in (fire, fire[::2, ::2])]
    file = tmp_path / "fire.ktx2"
    with file.open("wb") as target:
        write_ktx2(target, header, levels)
    done = subprocess.run(
        [node, PARSE, node_modules(), file], capture_output=True, text=True, check=True
    )
    said = json.loads(done.stdout)
    assert said["levels"] == [len(level) for level in levels]
    assert said["same"], "its writer gives the same descriptor and levels"
    assert (said["width"], said["height"]) == (header.width, header.height)
    assert said["transfer"] == (2 if srgb else 1)
    assert said["flags"] == (1 if alpha == "premultiplied" else 0)
    assert said["block"] == [FORMATS[name].side - 1] * 2
    assert said["keys"] == {"KTXorientation": "rd", "KTXwriter": said["keys"]["KTXwriter"]}


BC = ["bc1", "bc3", "bc4", "bc5", "bc7"]
ZSTD = "+zstd"
"""What the name of a format that is supercompressed ends in."""

SAMPLED = [
    # three's KTX2Loader knows no others, and ETC2 with alpha as sRGB alone.
    *((name, "ktx2", "three") for name in (*BC, "astc-4x4", "astc-6x6", "eac-r11", "eac-rg11")),
    *((name + ZSTD, "ktx2", "three") for name in ("bc7", "bc5", "astc-4x4", "astc-6x6")),
    *((name, "dds", "three") for name in OLD_DDS),
    *((name, "dds", "pixi") for name in BC),
]
"""Format, file and web client."""


@dataclass(frozen=True)
class Sampled:
    """A texture of two levels, and what a web client found in it."""

    header: TextureHeader
    images: list[Bytes]
    levels: list[bytes]
    file: Path
    found: dict[str, Any]


@pytest.fixture(scope="module")
def sampled(
    node: str, chromium: Path, fire: Bytes, workers: Workers,
    tmp_path_factory: pytest.TempPathFactory,
) -> dict[tuple[str, str, str], Sampled]:  # fmt: skip
    """What web clients found in every texture: one browser for all."""
    folder = tmp_path_factory.mktemp("textures")
    images = [fire, np.ascontiguousarray(fire[::2, ::2])]
    written = []
    for name, ending, client in SAMPLED:
        header = header_of(name.removesuffix(ZSTD), fire, 2)
        levels = [encode_blocks(each, header.format, False, workers) for each in images]
        file = folder / f"{name}.{client}.{ending}"
        if name.endswith(ZSTD):
            file.write_bytes(packed(header, levels, workers).getvalue())
        else:
            with file.open("wb") as target:
                write_texture(target, file.name, header, levels)
        written.append((header, levels, file))
    done = subprocess.run(
        [node, SAMPLE, node_modules(), *(file.name for *_, file in written)],
        cwd=folder,
        capture_output=True, text=True, check=False, timeout=240,
        env={**os.environ, "CHROMIUM": str(chromium)},
    )  # fmt: skip
    assert done.returncode == 0 and not done.stderr, done.stderr
    found = json.loads(done.stdout)
    return {
        key: Sampled(header, images, levels, file, each)
        for key, (header, levels, file), each in zip(SAMPLED, written, found, strict=True)
    }


@pytest.mark.parametrize("key", SAMPLED)
def test_web_clients_sample_the_pixels_of_our_textures_at_every_level(
    key: tuple[str, str, str], sampled: dict[tuple[str, str, str], Sampled], workers: Workers
) -> None:
    texture = sampled[key]
    assert texture.found == {"sizes": [[each.shape[1], each.shape[0]] for each in texture.images]}
    seen, at = np.fromfile(f"{texture.file}.rgba", np.uint8), 0
    for image, data in zip(texture.images, texture.levels, strict=True):
        height, width = image.shape[:2]
        theirs = seen[at : at + 4 * width * height].reshape(image.shape)
        at += theirs.size
        format_ = texture.header.format
        ours = decode_blocks(data, width, height, format_, False, workers)
        difference = np.abs(ours.astype(int) - theirs)[..., : format_.channels]
        # GPUs interpolate BC1, BC3, BC4 and BC5 each with a rounding of its own.
        assert difference.max() <= 2


@pytest.mark.parametrize(("name", "most_lost"), [("bc7", 1.1), ("astc-6x6", 0.5)])
def test_straight_colours_that_hardly_show_cost_others_little(
    name: str, most_lost: float, workers: Workers
) -> None:
    """Of the premultiplied image, to which bits go where they are seen, little is lost more."""
    light = campfire(height=288, count=4).read(2)
    found = dict[str, float]()
    alphas: tuple[Literal["straight", "premultiplied"], ...] = ("straight", "premultiplied")
    for alpha in alphas:
        image = encode_frame(light, alpha, "srgb")
        height, width = image.shape[:2]
        data = encode_blocks(image, FORMATS[name], False, workers, alpha)
        decoded = decode_blocks(data, width, height, FORMATS[name], False, workers)
        found[alpha] = colour_texture_error(decoded, image, alpha, "srgb", workers).psnr
    assert found["premultiplied"] - found["straight"] < most_lost


@pytest.mark.parametrize("name", ["bc7", "astc-6x6"])
def test_opaque_colours_are_encoded_as_they_are(name: str, fire: Bytes, workers: Workers) -> None:
    opaque = fire.copy()
    opaque[..., 3] = 255
    plain, straight = (
        encode_blocks(opaque, FORMATS[name], False, workers, each)
        for each in ("premultiplied", "straight")
    )
    assert plain == straight

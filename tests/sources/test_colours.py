"""Pictures in other colours than sRGB: profiles, and what PNG says in chunks of its own."""

import io
import struct
import time
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from PIL import Image, ImageCms

from fire_atlas.core.pixels import srgb_of, srgb_to_linear
from fire_atlas.sources.images import decode, read_header
from fire_atlas.sources.png import write_chunk
from tests.support import icc_files as icc
from tests.support import synthetic_fire as fire

NOISE = np.random.default_rng(5).integers(0, 256, (19, 17, 4), np.uint8)
RGB = np.ascontiguousarray(NOISE[..., :3])
GREY = np.ascontiguousarray(NOISE[..., 0])
DEEP = np.random.default_rng(6).integers(0, 65536, (9, 7, 3), np.uint16)

WIDE = icc.matrix_profile(icc.P3, icc.SRGB_CURVE, "Display P3")


def shown(path: Path) -> Any:
    return decode(path, read_header(path))


def notes(path: Path) -> tuple[str, ...]:
    return read_header(path).notes


def by_littlecms(image: Image.Image, profile: bytes) -> Any:
    """The picture in sRGB, by LittleCMS without shortcuts."""
    source = ImageCms.ImageCmsProfile(io.BytesIO(profile))
    transform = ImageCms.buildTransform(
        source, ImageCms.createProfile("sRGB"), image.mode, "RGB",
        ImageCms.Intent.RELATIVE_COLORIMETRIC,
        ImageCms.Flags.NOOPTIMIZE | ImageCms.Flags.HIGHRESPRECALC,
    )  # fmt: skip
    return np.asarray(transform.apply(image))


def save(path: Path, pixels: Any, profile: bytes) -> Path:
    lossless: dict[str, Any] = {"lossless": True, "exact": True} if path.suffix == ".webp" else {}
    Image.fromarray(pixels).save(path, icc_profile=profile, **lossless)
    return path


PROFILES = {
    "Display P3": WIDE,
    "Adobe RGB": icc.matrix_profile(
        ((0.60974, 0.31111, 0.01947), (0.20528, 0.62567, 0.06087), (0.14919, 0.06322, 0.74457)),
        icc.power(2.19921875), "Adobe RGB",
    ),
    "a sampled curve": icc.matrix_profile(
        icc.SRGB, icc.sampled([(i / 63) ** 1.8 for i in range(64)]), "sampled"
    ),
    "linear": icc.matrix_profile(icc.SRGB, b"curv" + bytes(8), "linear"),
    **{
        f"parametric {kind}": icc.matrix_profile(icc.P3, icc.parametric(kind, *numbers))
        for kind, numbers in enumerate([
            (1.8,), (1.8, 0.95, 0.05), (1.8, 0.85, 0.05, 0.1),
            (2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045),
            (2.4, 0.9, 0.05, 0.08, 0.05, 0.02, 0.01),
        ])
    },
}  # fmt: skip


@pytest.mark.parametrize("profile", PROFILES.values(), ids=PROFILES)
@pytest.mark.parametrize("ending", ["png", "webp", "tif"])
def test_a_profile_is_applied_as_littlecms_does(
    profile: bytes, ending: str, tmp_path: Path
) -> None:
    path = save(tmp_path / f"a.{ending}", NOISE, profile)
    wanted = by_littlecms(Image.fromarray(RGB), profile).astype(int)
    np.testing.assert_allclose(shown(path)[..., :3].astype(int), wanted, atol=1)
    np.testing.assert_array_equal(shown(path)[..., 3], NOISE[..., 3])
    assert "to sRGB; those beyond sRGB are clipped" in notes(path)[0]


def test_a_jpeg_is_converted(tmp_path: Path) -> None:
    plain = save(tmp_path / "plain.jpg", RGB, b"")
    path = save(tmp_path / "a.jpg", RGB, WIDE)
    wanted = by_littlecms(Image.fromarray(shown(plain)), WIDE).astype(int)
    np.testing.assert_allclose(shown(path).astype(int), wanted, atol=1)
    assert notes(path) == (
        "its colours are converted from 'Display P3' to sRGB; those beyond sRGB are clipped",
    )


P3_TO_SRGB = np.array([[1.2249, -0.2249, 0], [-0.0420, 1.0420, 0], [-0.0197, -0.0786, 1.0979]])


def converted(colours: Any, matrix: Any, curve: Callable[[Any], Any] = srgb_to_linear) -> Any:
    """Colours 0..1 in sRGB, by the formulas."""
    light = curve(np.asarray(colours, np.float64)) @ np.asarray(matrix).T
    return srgb_of(np.clip(light, 0, 1))


def test_sixteen_bits_are_converted_in_sixteen_bits(tmp_path: Path) -> None:
    assert cv2.imwrite(str(tmp_path / "plain.png"), DEEP[..., ::-1])
    data = (tmp_path / "plain.png").read_bytes()
    path = tmp_path / "a.png"
    path.write_bytes(with_chunk(data, b"iCCP", b"x\0\0" + zlib.compress(WIDE)))
    wanted = converted(DEEP / 65535, P3_TO_SRGB) * 65535
    assert shown(path).dtype == np.uint16
    # The matrix above has four digits, which the steep curve near black makes as many as 3.
    np.testing.assert_allclose(shown(path), wanted, atol=60)
    assert len(np.unique(shown(path))) > 100


@pytest.mark.parametrize("ending", ["png", "webp", "tif", "jpg"])
def test_profiles_of_srgb_change_no_byte(ending: str, tmp_path: Path) -> None:
    pixels = NOISE if ending != "jpg" else RGB
    plain = shown(save(tmp_path / f"plain.{ending}", pixels, b""))
    sampled = icc.sampled(srgb_to_linear(np.linspace(0, 1, 1024)).tolist())
    alike = [
        ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes(),
        icc.matrix_profile(icc.SRGB, icc.SRGB_CURVE),
        icc.matrix_profile(icc.SRGB, sampled),
        icc.matrix_profile([(x + 1e-4, y, z) for x, y, z in icc.SRGB], icc.SRGB_CURVE),
    ]
    for profile in alike:
        path = save(tmp_path / f"a.{ending}", pixels, profile)
        np.testing.assert_array_equal(shown(path), plain)
        assert notes(path) == ()


@pytest.mark.parametrize("ending", ["png", "jpg", "tif"])
def test_profiles_of_greys_are_applied_to_greys(ending: str, tmp_path: Path) -> None:
    path = save(tmp_path / f"a.{ending}", GREY, icc.grey_profile(icc.power(1.8), "Dot gain"))
    plain = shown(save(tmp_path / f"plain.{ending}", GREY, b""))
    wanted = converted(plain / 255, np.eye(3), lambda value: value**1.8) * 255
    np.testing.assert_allclose(shown(path), wanted, atol=1)
    assert "'Dot gain'" in notes(path)[0]


def test_a_profile_for_other_pictures_is_named(tmp_path: Path) -> None:
    path = save(tmp_path / "a.webp", RGB, icc.grey_profile(icc.power(1.8), "Dot gain"))
    np.testing.assert_array_equal(shown(path), RGB)
    assert notes(path) == (
        "its colour profile 'Dot gain' is for grey pictures, not for RGB: its colours are taken as "
        "sRGB",
    )


def lab_of_corners(channels: int, lightness: Callable[[Any], Any]) -> Any:
    """Lab, 0..255, of the corners of a cube: grey, and somewhat coloured by the first channel."""
    corners = np.stack(np.meshgrid(*channels * [[0, 1]], indexing="ij"), axis=-1)
    return np.stack(
        [lightness(corners), 128 + 40 * corners[..., 0], np.full(corners.shape[:-1], 128)], axis=-1
    )


TABLES = icc.table_profile("RGB ", lab_of_corners(3, lambda c: 255 * c.mean(axis=-1)), "scanner")


def test_a_profile_of_tables_is_applied_by_littlecms(tmp_path: Path) -> None:
    path = save(tmp_path / "a.png", NOISE, TABLES)
    source = ImageCms.ImageCmsProfile(io.BytesIO(TABLES))
    wanted = ImageCms.profileToProfile(
        Image.fromarray(RGB), source, ImageCms.createProfile("sRGB"), ImageCms.Intent.PERCEPTUAL
    )
    assert wanted is not None
    np.testing.assert_array_equal(shown(path)[..., :3], np.asarray(wanted))
    np.testing.assert_array_equal(shown(path)[..., 3], NOISE[..., 3])
    assert "'scanner'" in notes(path)[0]


def test_tables_are_not_applied_to_sixteen_bits_and_a_note_says_so(tmp_path: Path) -> None:
    assert cv2.imwrite(str(tmp_path / "plain.png"), DEEP[..., ::-1])
    data = (tmp_path / "plain.png").read_bytes()
    path = tmp_path / "a.png"
    path.write_bytes(with_chunk(data, b"iCCP", b"x\0\0" + zlib.compress(TABLES)))
    np.testing.assert_array_equal(shown(path), DEEP)
    assert "'scanner' consists of tables, which need 8 bits" in notes(path)[0]


@pytest.mark.parametrize("ending", ["jpg", "tif"])
def test_inks_are_converted_by_their_profile(ending: str, tmp_path: Path) -> None:
    inks = icc.table_profile(
        "CMYK", lab_of_corners(4, lambda c: 255 * (1 - c.mean(axis=-1))), "press"
    )
    image = Image.fromarray(NOISE, "CMYK")
    image.save(tmp_path / f"a.{ending}", icc_profile=inks)
    with Image.open(tmp_path / f"a.{ending}") as stored:
        source = ImageCms.ImageCmsProfile(io.BytesIO(inks))
        wanted = ImageCms.profileToProfile(
            stored, source, ImageCms.createProfile("sRGB"), outputMode="RGB"
        )
    assert wanted is not None
    np.testing.assert_array_equal(shown(tmp_path / f"a.{ending}"), np.asarray(wanted))
    assert "(CMYK) are converted to sRGB" in notes(tmp_path / f"a.{ending}")[0]


def test_inks_without_a_profile_are_a_guess_with_a_note(tmp_path: Path) -> None:
    Image.fromarray(NOISE, "CMYK").save(tmp_path / "a.tif")
    Image.fromarray(NOISE, "CMYK").save(tmp_path / "b.tif", icc_profile=b"nothing of the kind")
    cyan, magenta, yellow, black = (NOISE[..., i].astype(float) for i in range(4))
    wanted = np.dstack([(255 - ink) * (255 - black) / 255 for ink in (cyan, magenta, yellow)])
    for name, has in (("a", "no colour profile"), ("b", "a broken colour profile")):
        np.testing.assert_allclose(shown(tmp_path / f"{name}.tif"), wanted, atol=1)
        assert (
            f"it is CMYK with {has}: its colours are a guess" in notes(tmp_path / f"{name}.tif")[0]
        )


@pytest.mark.parametrize("ending", ["png", "webp", "jpg", "tif"])
def test_a_broken_profile_is_a_note(
    ending: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    plain = shown(save(tmp_path / f"plain.{ending}", RGB, b""))
    for stop in [*range(1, len(WIDE) - 40, 29)]:
        path = save(tmp_path / f"a.{ending}", RGB, WIDE[:stop])
        np.testing.assert_array_equal(shown(path), plain)
        assert "its colour profile is broken" in notes(path)[0]
        assert notes(path)[0].endswith("its colours are taken as sRGB")
    assert capfd.readouterr().err == ""


def test_any_damage_to_a_profile_is_harmless(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    for whole in (WIDE, TABLES, icc.grey_profile(icc.power(1.8))):
        for _ in range(60):
            damaged = bytearray(whole)
            for place in rng.integers(0, len(whole), 3):
                damaged[place] = rng.integers(256)
            path = save(tmp_path / "a.png", RGB, bytes(damaged))
            assert shown(path).shape == RGB.shape


def with_chunk(data: bytes, name: bytes, body: bytes) -> bytes:
    """The PNG with a chunk after its header."""
    return data[:33] + write_chunk(name, body) + data[33:]


def png_with(path: Path, *chunks: tuple[bytes, bytes], pixels: Any = NOISE) -> Path:
    Image.fromarray(pixels).save(path)
    data = path.read_bytes()
    for name, body in reversed(chunks):
        data = with_chunk(data, name, body)
    path.write_bytes(data)
    return path


def gama(gamma: float) -> tuple[bytes, bytes]:
    return b"gAMA", struct.pack(">I", round(gamma * 1e5))


def chrm(*chromaticities: float) -> tuple[bytes, bytes]:
    return b"cHRM", struct.pack(">8I", *(round(place * 1e5) for place in chromaticities))


D65 = (0.3127, 0.3290)
OF_SRGB = (*D65, 0.64, 0.33, 0.30, 0.60, 0.15, 0.06)
OF_P3 = (*D65, 0.680, 0.320, 0.265, 0.690, 0.150, 0.060)
OF_BT2020 = (*D65, 0.708, 0.292, 0.170, 0.797, 0.131, 0.046)
BT2020_TO_SRGB = np.array(
    [
        [1.660491, -0.587641, -0.07285],
        [-0.12455, 1.1329, -0.008349],
        [-0.018151, -0.100579, 1.11873],
    ]
)
SRGB_CHUNK = (b"sRGB", b"\0")
PROFILE_CHUNK = (b"iCCP", b"x\0\0" + zlib.compress(WIDE))
NO_CURVE = np.eye(3)


@pytest.mark.parametrize(
    "chunks",
    [
        [], [gama(0.45)], [gama(0.45455)],
        [gama(0.45455), chrm(*OF_SRGB)], [chrm(*OF_SRGB)], [SRGB_CHUNK],
        [SRGB_CHUNK, gama(0.3), chrm(*OF_P3)], [(b"cICP", bytes([1, 13, 0, 1]))],
        [(b"cICP", bytes([1, 1, 0, 1]))], [(b"cICP", bytes([1, 13, 0, 1])), PROFILE_CHUNK],
    ],
)  # fmt: skip
def test_a_png_that_says_srgb_keeps_every_byte(
    chunks: list[tuple[bytes, bytes]], tmp_path: Path
) -> None:
    path = png_with(tmp_path / "a.png", *chunks)
    np.testing.assert_array_equal(shown(path), NOISE)
    assert notes(path) == ()


@pytest.mark.parametrize(
    ("chunks", "matrix", "curve"),
    [
        ([gama(1.0)], NO_CURVE, lambda v: v),
        ([gama(1 / 1.8)], NO_CURVE, lambda v: v**1.8),
        ([gama(0.45455), chrm(*OF_P3)], P3_TO_SRGB, srgb_to_linear),
        ([chrm(*OF_BT2020)], BT2020_TO_SRGB, srgb_to_linear),
        ([gama(1 / 2.6), chrm(*OF_P3)], P3_TO_SRGB, lambda v: v**2.6),
        ([PROFILE_CHUNK, gama(0.3)], P3_TO_SRGB, srgb_to_linear),
        ([(b"cICP", bytes([12, 13, 0, 1]))], P3_TO_SRGB, srgb_to_linear),
        ([(b"cICP", bytes([9, 13, 0, 1])), PROFILE_CHUNK], BT2020_TO_SRGB, srgb_to_linear),
        ([(b"cICP", bytes([1, 8, 0, 1]))], NO_CURVE, lambda v: v),
        ([(b"cICP", bytes([1, 4, 0, 1]))], NO_CURVE, lambda v: v**2.2),
    ],
)
def test_a_png_that_says_otherwise_is_converted_by_the_formula(
    chunks: list[tuple[bytes, bytes]], matrix: Any, curve: Callable[[Any], Any], tmp_path: Path
) -> None:
    path = png_with(tmp_path / "a.png", *chunks)
    wanted = converted(RGB / 255, matrix, curve) * 255
    np.testing.assert_allclose(shown(path)[..., :3], wanted, atol=1.01)
    np.testing.assert_array_equal(shown(path)[..., 3], NOISE[..., 3])
    assert "converted from" in notes(path)[0]


@pytest.mark.parametrize(
    ("chunk", "message"),
    [
        (
            (b"cICP", bytes([9, 16, 0, 1])),
            "it is HDR (PQ), for which sRGB has no one right picture",
        ),
        ((b"cICP", bytes([9, 18, 0, 1])), "it is HDR (HLG)"),
        ((b"cICP", bytes([200, 13, 0, 1])), "states colours that are not known ([200, 13, 0, 1])"),
        ((b"cICP", b"\1"), "its cICP chunk is broken"),
        ((b"gAMA", b"\1"), "its gAMA or cHRM chunk is broken"),
        ((b"gAMA", bytes(4)), "it states a gamma of 0"),
        (chrm(*8 * [0.3]), "its gAMA and cHRM chunks make no sense (they are no primaries)"),
        (chrm(*8 * [0.0]), "make no sense (its white, (0, 0), is none)"),
        ((b"iCCP", b"no end of the name"), "its colour profile is broken"),
        ((b"iCCP", b"x\0\0" + zlib.compress(bytes(99))), "its colour profile is broken"),
        ((b"iCCP", b"x\0\0" + zlib.compress(bytes(1 << 25))), "it ends early, or is too large"),
    ],
)
def test_what_is_not_honoured_is_said(
    chunk: tuple[bytes, bytes], message: str, tmp_path: Path
) -> None:
    path = png_with(tmp_path / "a.png", chunk)
    np.testing.assert_array_equal(shown(path), NOISE)
    assert message in notes(path)[0]
    assert notes(path)[0].endswith("its colours are taken as sRGB")


def test_a_palette_is_converted(tmp_path: Path) -> None:
    Image.fromarray(RGB).quantize(32).save(tmp_path / "a.png", icc_profile=WIDE)
    plain = np.asarray(Image.open(tmp_path / "a.png").convert("RGB"))
    wanted = by_littlecms(Image.fromarray(plain), WIDE).astype(int)
    np.testing.assert_allclose(shown(tmp_path / "a.png").astype(int), wanted, atol=1)


@pytest.mark.parametrize("ending", ["png", "webp"])
def test_every_frame_of_an_animation_is_converted(ending: str, tmp_path: Path) -> None:
    options: dict[str, Any] = {"lossless": True, "exact": True} if ending == "webp" else {}
    path = fire.write_animation(
        tmp_path / f"a.{ending}", fire.fires(4, hard=True), duration=50, icc_profile=WIDE, **options
    )
    clip = fire.open_clip(path)
    assert any("'Display P3'" in note for note in clip.notes)
    for frame, pixels in zip(fire.fires(4, hard=True), fire.all_frames(clip), strict=True):
        wanted = frame.copy()
        wanted[..., :3] = by_littlecms(Image.fromarray(frame[..., :3]), WIDE)
        np.testing.assert_allclose(pixels, fire.light(wanted), atol=0.01)


def test_floats_are_light_whatever_their_profile_says(tmp_path: Path) -> None:
    light = np.random.default_rng(3).random((9, 7, 3)).astype(np.float32)
    image = Image.fromarray(light[..., 0])
    image.save(tmp_path / "a.tif", icc_profile=icc.grey_profile(icc.power(1.8)))
    np.testing.assert_array_equal(shown(tmp_path / "a.tif"), np.dstack([light[..., 0]] * 3))
    assert "taken as linear light of sRGB" in notes(tmp_path / "a.tif")[0]


def test_a_folder_of_one_profile_is_converted_with_one_note(tmp_path: Path) -> None:
    for i in range(3):
        save(tmp_path / f"{i}.png", RGB, WIDE)
    clip = fire.open_clip(tmp_path, matte="none")
    assert clip.notes == (
        "its colours are converted from 'Display P3' to sRGB; those beyond sRGB are clipped",
    )


def test_the_profile_of_srgb_costs_a_folder_next_to_nothing(tmp_path: Path) -> None:
    profile = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    paths = [save(tmp_path / "plain.png", NOISE, b""), save(tmp_path / "a.png", NOISE, profile)]
    medians = []
    for path in paths:
        seconds = []
        for _ in range(200):
            start = time.perf_counter()
            read_header(path)
            seconds.append(time.perf_counter() - start)
        medians.append(np.median(seconds))
    assert medians[1] < medians[0] + 0.0003

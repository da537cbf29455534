"""Movies, decoded by other programs: FFmpeg and Pillow see the frames, times and alpha of the
pages."""

import io
import itertools
import json
import re
import shutil
import struct
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image, ImageSequence

from fire_atlas.atlas.encode import as_straight, encode_frame
from fire_atlas.cli import main
from fire_atlas.core.errors import OutputError
from fire_atlas.core.pixels import Bytes
from fire_atlas.core.shipped import shipped
from fire_atlas.formats.atlas.texture_packer import read_atlas
from fire_atlas.formats.movies.movie import Movie
from fire_atlas.formats.movies.write import write_movie
from fire_atlas.preview.blend import blend
from fire_atlas.preview.cut_frames import aligned_frames
from fire_atlas.recipe.output import MovieName
from tests.support.requirements import missing

NAMES: tuple[MovieName, ...] = ("webm", "webp", "apng", "gif", "mp4")
COUNT = 8
SOURCE = {"path": str(shipped("samples") / "campfire"), "fps": 24, "count": COUNT, "height": 64}
RECIPE = {"source": SOURCE, "timeline": {"loop": "none"}, "flakes": {"rate": 100}}

Decoded = list[tuple[NDArray[np.float64], float]]
"""Each frame, (H, W, 4) RGBA in 0..255, and when it begins, ms."""


def by_pillow(data: bytes) -> Decoded:
    with Image.open(io.BytesIO(data)) as image:
        frames = [
            (np.array(each.convert("RGBA"), np.float64), float(each.info["duration"]))
            for each in ImageSequence.Iterator(image)
        ]
    starts = itertools.accumulate((length for _, length in frames[:-1]), initial=0.0)
    return [(pixels, start) for (pixels, _), start in zip(frames, starts, strict=True)]


def by_ffmpeg(data: bytes) -> Decoded:
    """Decode by FFmpeg; videos without alpha, as its conversion to RGBA spoils their last columns
    of some widths."""
    with av.open(io.BytesIO(data), "r") as file:
        return [
            (
                frame.to_ndarray(
                    format="rgb24" if frame.format.name.startswith("yuv") else "rgba"
                ).astype(np.float64),
                1000 * frame.time,
            )
            for frame in file.decode(video=0)
        ]


def alpha_of_webm(data: bytes) -> Decoded:
    """Decode by libvpx, as FFmpeg's own decoder of VP9 ignores alpha; without colours."""
    decoder: Any = av.CodecContext.create("libvpx-vp9", "r")
    found = []
    with av.open(io.BytesIO(data), "r") as file:
        for packet in file.demux(video=0):
            for frame in decoder.decode(packet) if packet.size else []:
                plane = frame.planes[3]
                alpha = np.frombuffer(plane, np.uint8).reshape(-1, plane.line_size)
                pixels = np.zeros((frame.height, frame.width, 4))
                pixels[..., 3] = alpha[: frame.height, : frame.width]
                found.append((pixels, 1000 * float(frame.pts * packet.time_base)))
    return found


def halves(pixels: NDArray[np.float64], width: int, height: int) -> NDArray[np.float64]:
    """Return the frame of an MP4: its left half, with the right one's green as alpha."""
    middle = pixels.shape[1] // 2
    return np.dstack([pixels[:, :middle], pixels[:, middle:, 1]])[:height, :width]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build a short fire with all movies; return the folder with the recipe."""
    folder = tmp_path_factory.mktemp("movies")
    (folder / "fire.yaml").write_text(json.dumps({**RECIPE, "movies": NAMES}))
    assert main(["build", str(folder / "fire.yaml"), "-q", "--jobs", "2"]) == 0
    return folder


@pytest.fixture(scope="module")
def frames(folder: Path) -> list[Bytes]:
    return list(aligned_frames(read_atlas(folder / "build" / "fire.json")))


@pytest.mark.parametrize("decode", [by_pillow, by_ffmpeg])
def test_an_apng_is_the_pages_frames(
    decode: Callable[[bytes], Decoded], folder: Path, frames: list[Bytes]
) -> None:
    check_lossless(decode((folder / "build" / "fire.apng").read_bytes()), frames)


def test_a_webp_is_the_pages_frames(folder: Path, frames: list[Bytes]) -> None:
    check_lossless(by_pillow((folder / "build" / "fire.webp").read_bytes()), frames)


def check_lossless(decoded: Decoded, frames: list[Bytes]) -> None:
    assert len(decoded) == len(frames)
    for i, ((pixels, start), frame) in enumerate(zip(decoded, frames, strict=True)):
        assert np.array_equal(pixels[frame[..., 3] > 0], frame[frame[..., 3] > 0])
        assert not pixels[frame[..., 3] == 0][:, 3].any()
        assert start == pytest.approx(i * 1000 / 24, abs=0.5)


@pytest.mark.parametrize("decode", [by_pillow, by_ffmpeg])
def test_a_gif_has_the_frames_in_one_palette_and_dots_for_alpha(
    decode: Callable[[bytes], Decoded], folder: Path, frames: list[Bytes]
) -> None:
    data = (folder / "build" / "fire.gif").read_bytes()
    decoded, colours = decode(data), set[tuple[int, ...]]()
    assert len(decoded) == COUNT
    for i, ((pixels, start), frame) in enumerate(zip(decoded, frames, strict=True)):
        opaque = pixels[..., 3] == 255
        assert start == pytest.approx(i * 1000 / 24, abs=5)
        assert set(np.unique(pixels[..., 3])) <= {0, 255}
        assert opaque[frame[..., 3] >= 254].all() and not opaque[frame[..., 3] <= 1].any()
        # In blocks of the pattern's size, the mean of the dots is that of alpha.
        assert np.abs(block_means(pixels[..., 3]) - block_means(frame[..., 3])).mean() < 4
        errors = np.abs(pixels - frame)[opaque][:, :3]
        assert errors.mean() < 6
        colours |= set(map(tuple, pixels[opaque].astype(int)))
    assert len(colours) <= 255


def block_means(plane: NDArray[Any]) -> NDArray[np.float64]:
    height, width = (side // 8 * 8 for side in plane.shape)
    blocks = plane[:height, :width].astype(float).reshape(height // 8, 8, width // 8, 8)
    return np.asarray(blocks.mean(axis=(1, 3)))


def test_a_webm_has_the_frames_with_their_alpha(folder: Path, frames: list[Bytes]) -> None:
    data = (folder / "build" / "fire.webm").read_bytes()
    decoded, coloured = alpha_of_webm(data), by_ffmpeg(data)
    assert len(decoded) == len(coloured) == COUNT
    for i, (frame, (alpha, start), (colour, _)) in enumerate(
        zip(frames, decoded, coloured, strict=True)
    ):
        assert start == pytest.approx(i * 1000 / 24, abs=0.5)
        error = np.abs(alpha[..., 3] - frame[..., 3])
        assert error.mean() < 2 and error.max() < 48
        cover = frame[..., 3:] / 255
        assert np.abs(colour - frame[..., :3])[cover[..., 0] > 0.5].mean() < 8


def test_an_mp4_has_the_picture_over_black_beside_its_alpha(
    folder: Path, frames: list[Bytes]
) -> None:
    decoded = by_ffmpeg((folder / "build" / "fire.mp4").read_bytes())
    assert len(decoded) == COUNT
    height, width = frames[0].shape[:2]
    for i, (frame, (both, start)) in enumerate(zip(frames, decoded, strict=True)):
        assert start == pytest.approx(i * 1000 / 24, abs=0.02)
        pixels = halves(both, width, height)
        black = blend(frame, (0, 0, 0), "straight", "srgb")
        assert np.abs(pixels[..., :3] - black).mean() < 3
        assert np.abs(pixels[..., 3] - frame[..., 3]).mean() < 2


def test_an_mp4_plays_while_it_loads(folder: Path) -> None:
    """Its index stands before its frames, so FFmpeg decodes them from a stream it cannot seek."""
    data = (folder / "build" / "fire.mp4").read_bytes()
    at, boxes = 0, list[bytes]()
    while at < len(data):
        (size,) = struct.unpack_from(">I", data, at)
        boxes.append(data[at + 4 : at + 8])
        at += size
    assert [box for box in boxes if box in {b"moov", b"mdat"}] == [b"moov", b"mdat"]
    probe = shutil.which("ffprobe") or missing("needs ffmpeg (Debian: apt-get install ffmpeg)")
    asked = "-v", "error", "-count_frames", "-show_entries", "stream=nb_read_frames,codec_name"
    line = [probe, *asked, "-of", "csv=p=0", "pipe:0"]
    ran = subprocess.run(line, input=data, capture_output=True, check=False)
    assert (ran.stdout.decode().strip(), ran.stderr) == (f"h264,{COUNT}", b"")


def test_additive_pages_say_that_no_movie_adds_light(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    keys = {**RECIPE, "source": {**SOURCE, "count": 2}, "movies": ["apng"], "flakes": "none"}
    for alpha, is_noted in ("additive", True), ("premultiplied", True), ("straight", False):
        (tmp_path / "fire.yaml").write_text(json.dumps({**keys, "atlas": {"alpha": alpha}}))
        assert main(["build", str(tmp_path / "fire.yaml")]) == 0
        assert ("no player adds the light of a movie" in capsys.readouterr().err) is is_noted


def test_movies_are_the_same_bytes_again_with_another_number_of_workers(folder: Path) -> None:
    again = ["build", str(folder / "fire.yaml"), "-q", "--jobs", "1", "-o", str(folder / "again")]
    assert main(again) == 0
    for name in NAMES:
        one, other = (folder / each / f"fire.{name}" for each in ("build", "again"))
        assert one.read_bytes() == other.read_bytes(), name


DURATIONS = (100.0, 60.0, 250.0)


def squares(loop: bool) -> Movie:
    """Return frames of an odd size: a square of another colour and alpha in each."""

    colours = ((255, 0, 0, 255), (0, 255, 0, 128), (0, 0, 255, 64))

    def frame(i: int) -> Bytes:
        pixels = np.zeros((47, 65, 4), np.uint8)
        pixels[8:40, 8 + 8 * i : 40 + 8 * i] = colours[i]
        return pixels

    return Movie(65, 47, DURATIONS, loop, frame)


@pytest.mark.parametrize("name", NAMES)
def test_frames_have_durations_of_their_own_and_any_size(name: MovieName) -> None:
    data = write_movie(name, squares(loop=True))
    decoded = {"webp": by_pillow, "webm": alpha_of_webm}.get(name, by_ffmpeg)(data)
    assert [round(start) for _, start in decoded] == [0, 100, 160]
    if name in ("webm", "mp4"):
        with av.open(io.BytesIO(data), "r") as file:
            assert file.duration == pytest.approx(410_000, abs=1000)
    for i, (pixels, _) in enumerate(decoded):
        shown = halves(pixels, 65, 47) if name == "mp4" else pixels
        assert shown.shape == (47, 65, 4)
        expected = (255, 128, 64)[i]
        # The mean over a multiple of the dots' pattern.
        assert shown[16:32, 24:40, 3].mean() == pytest.approx(expected, abs=2)
        assert shown[:4, :, 3].max() <= 5  # beside the edge in an MP4


@pytest.mark.parametrize("name", NAMES)
def test_encoders_print_nothing(name: MovieName, capfd: pytest.CaptureFixture[str]) -> None:
    write_movie(name, squares(loop=True))
    assert capfd.readouterr() == ("", "")


def test_equal_neighbours_are_one_longer_frame_and_time_goes_on() -> None:
    pictures = [squares(True).frame(i) for i in (0, 0, 1)]
    movie = Movie(65, 47, DURATIONS, True, pictures.__getitem__)
    starts: dict[MovieName, list[int]] = {"webp": [0, 160], "gif": [0, 160], "apng": [0, 100, 160]}
    for name, expected in starts.items():
        assert [start for _, start in by_pillow(write_movie(name, movie))] == expected, name


def test_images_state_whether_they_loop() -> None:
    for name in ("webp", "apng", "gif"):
        for loop in (True, False):
            with Image.open(io.BytesIO(write_movie(name, squares(loop)))) as image:
                # 0 is for ever; a GIF that plays once says nothing.
                once = None if name == "gif" else 1
                assert image.info.get("loop") == (0 if loop else once), name


@pytest.mark.parametrize("name", [name for name in NAMES if name != "apng"])
def test_frames_that_a_format_cannot_hold_are_refused(name: MovieName) -> None:
    movie = Movie(70_000, 1, (40.0,), True, lambda i: np.zeros((1, 70_000, 4), np.uint8))
    with pytest.raises(OutputError, match=f"movies: {name}: frames have at most"):
        write_movie(name, movie)


@pytest.mark.parametrize("blend_space", ["srgb", "linear"])
@pytest.mark.parametrize("alpha", ["straight", "premultiplied", "additive"])
def test_pages_of_any_encoding_look_the_same_over_black(alpha: Any, blend_space: Any) -> None:
    light = np.random.default_rng(0).random((40, 40, 4), np.float32)
    light[..., :3] *= light[..., 3:]
    page = encode_frame(light, alpha, blend_space)
    seen = blend(as_straight(page, alpha, blend_space), (0, 0, 0), "straight", "srgb")
    stated = blend(page, (0, 0, 0), alpha, blend_space)
    assert np.abs(seen.astype(int) - stated).max() <= 1


@pytest.mark.parametrize(
    ("keys", "advice"),
    [
        ({"movies": ["webp"], "atlas": {"format": "webp"}}, r"movies.0: .*atlas.format to png"),
        ({"movies": ["gif", "gif"]}, "gif is listed twice"),
        ({"movies": ["avi"]}, "must be one of"),
    ],
)
def test_movies_that_cannot_be_written_are_refused_before_any_work(
    keys: dict[str, Any],
    advice: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr("fire_atlas.formats.problems.find_spec", lambda name: None)
    (tmp_path / "fire.yaml").write_text(json.dumps({**RECIPE, **keys}))
    assert main(["build", str(tmp_path / "fire.yaml")]) != 0
    said = capsys.readouterr().err
    assert re.search(advice, said), said
    assert not (tmp_path / "build").exists()

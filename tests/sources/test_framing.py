"""Large videos are reduced, and frames are cropped, before anything is kept."""

import errno
import io
import tempfile
from collections.abc import Generator
from pathlib import Path
from typing import Any

import av
import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip, Window
from fire_atlas.core.errors import SourceError
from fire_atlas.core.picture import to_light
from fire_atlas.core.workers import Workers
from fire_atlas.recipe.source import FramesSource
from fire_atlas.recipe.timeline import Timeline
from fire_atlas.sources import frame_store, listing, video
from fire_atlas.sources.frame_store import FrameStore
from fire_atlas.sources.frames import open_frames
from fire_atlas.sources.framing import FlameExtent, PageLimit, frame_video, small_copy
from fire_atlas.sources.reader import OpeningContext
from fire_atlas.sources.resize import reduce, resize, width_for
from fire_atlas.sources.video_stream import DecodedFrame, VideoScan, decode_video
from tests.support import synthetic_fire as fire

TALL = (720, 1280)
"""Height and width of a video that is reduced by default."""


def flames(count: int, size: tuple[int, int] = TALL) -> list[fire.Rgba]:
    """A bright blob that wanders over black near the middle of opaque frames (H, W, 4)."""
    frames = []
    for i in range(count):
        frame = np.zeros((*size, 4), np.uint8)
        frame[..., 3] = 255
        centre = size[1] // 2 + 3 * i, size[0] // 2 + 2 * i
        cv2.circle(frame, centre, size[0] // 6, (255, 140, 30, 255), -1)
        frames.append(frame)
    return frames


def film(path: Path, count: int = 6, size: tuple[int, int] = TALL, codec: str = "libx264") -> Path:
    options = {"crf": "12", "preset": "ultrafast"} if codec == "libx264" else {}
    return fire.write_video(path, flames(count, size), codec, "yuv420p", options, rate=24)


def opened(path: Path, page: PageLimit | None = None, **keys: Any) -> Clip:
    with Workers(2) as workers:
        context = OpeningContext("srgb", workers, page)
        return open_frames(FramesSource(path=str(path), **keys), path, context)


def framed_height(count: int, max_size: int = 4096, **timeline: Any) -> int:
    """Height, px, of ``count`` frames of 1920 x 1080 by default."""
    source, page = FramesSource(path="a.mp4"), PageLimit(max_size, Timeline(**timeline))
    return frame_video(source, Window(0, 0, 1920, 1080), count, 25, page).height


def test_a_tall_video_is_reduced_to_512_and_says_so(tmp_path: Path) -> None:
    clip = opened(film(tmp_path / "a.mp4"), PageLimit(4096, Timeline()))
    assert (clip.width, clip.height) == (width_for(512, (1280, 720)), 512)
    assert clip.read(3).shape == (512, clip.width, 4)
    (note,) = clip.notes
    assert "1280x720 are reduced to 910x512" in note
    assert "source.height: source" in note


def test_the_largest_height_that_fits_one_page_is_chosen() -> None:
    for count in (20, 40, 60, 100, 128):
        height = framed_height(count)
        area = count * height * width_for(height, (1920, 1080))
        larger = count * (height + 1) * width_for(height + 1, (1920, 1080))
        assert area <= 0.9 * 4096**2
        assert height == 512 or larger > 0.9 * 4096**2


@pytest.mark.parametrize(
    ("like", "count", "timeline"),
    [
        (framed_height(60), 300, {"frames": 60}),
        (framed_height(60), 120, {"fps": 12.5}),
        (framed_height(60), 31, {"loop": "pingpong"}),
    ],
)
def test_the_frames_that_are_shown_count(like: int, count: int, timeline: dict[str, Any]) -> None:
    assert framed_height(count, **timeline) == like < 512


def test_below_256_pages_are_added(tmp_path: Path) -> None:
    assert framed_height(1000) == framed_height(300) == 256
    clip = opened(film(tmp_path / "a.mp4", 12), PageLimit(1024, Timeline()))
    assert clip.height == 256
    assert "reduced to 455x256; source.height: source keeps" in clip.notes[0]


def test_height_source_keeps_a_tall_video(tmp_path: Path) -> None:
    path = film(tmp_path / "a.mp4", 2)
    whole = opened(path, height="source", matte="none")
    assert (whole.height, whole.notes) == (720, ())
    wanted = resize(whole.read(1), 640, 360)
    np.testing.assert_allclose(opened(path, height=360, matte="none").read(1), wanted, atol=1e-5)


def test_what_is_not_a_tall_video_keeps_its_size(tmp_path: Path) -> None:
    page = PageLimit(256, Timeline())
    small = film(tmp_path / "a.mp4", 8, (512, 640))
    tall = fire.write_folder(tmp_path / "f", flames(2))
    sheet = fire.write_sheet(tmp_path / "sheet.png", flames(2), 2)
    gif = fire.write_animation(tmp_path / "a.gif", flames(2), duration=40)
    assert opened(small, page).height == 512
    assert opened(tall, page).height == opened(gif, page).height == 720
    assert opened(sheet, page, grid={"columns": 2, "rows": 1}).height == 720


@pytest.mark.parametrize("form", ["mp4", "mov", "folder", "sheet", "gif"])
def test_a_crop_is_that_part_of_every_frame(form: str, tmp_path: Path) -> None:
    keys: dict[str, Any] = {"matte": "none"}
    frames = flames(3, (120, 200))
    match form:
        case "mp4":
            path = film(tmp_path / "a.mp4", 3, (120, 200))
        case "mov":
            path = fire.write_video(tmp_path / "a.mov", frames, "qtrle", "argb", rate=12)
        case "folder":
            path = fire.write_folder(tmp_path / "f", frames)
        case "sheet":
            path = fire.write_sheet(tmp_path / "s.png", frames, 3)
            keys["grid"] = {"columns": 3, "rows": 1}
        case _:
            path = fire.write_animation(tmp_path / "a.gif", frames, duration=40)
    whole, part = opened(path, **keys), opened(path, **keys, crop=(40, 30, 90, 61))
    assert (part.width, part.height) == (90, 61)
    for i in range(3):
        np.testing.assert_array_equal(part.read(i), whole.read(i)[30:91, 40:130])


def test_a_crop_of_a_tall_video_is_not_reduced_if_it_is_small(tmp_path: Path) -> None:
    path = film(tmp_path / "a.mp4", 2)
    part = opened(path, crop=(300, 100, 600, 500), matte="none")
    whole = opened(path, height="source", matte="none")
    np.testing.assert_array_equal(part.read(1), whole.read(1)[100:600, 300:900])


@pytest.mark.parametrize("crop", [(0, 0, 201, 10), (195, 0, 6, 10), (0, 120, 5, 1)])
def test_a_crop_beyond_the_frames_is_refused(crop: tuple[int, ...], tmp_path: Path) -> None:
    for path in (
        film(tmp_path / "a.mp4", 3, (120, 200)),
        fire.write_folder(tmp_path / "f", flames(2, (120, 200))),
    ):
        with pytest.raises(
            SourceError, match=r"reaches beyond the frames of .*, which are 200x120"
        ):
            opened(path, crop=crop)


@pytest.mark.parametrize("form", ["mp4", "folder"])
def test_crop_auto_holds_the_flame_of_every_frame(form: str, tmp_path: Path) -> None:
    frames = flames(12, (600, 900))
    frames[7][20:26, 850:856] = 255, 200, 90, 255  # a spark, once, far from the rest
    if form == "folder":
        path = fire.write_folder(tmp_path / "f", frames)
    else:
        options = {"crf": "5"}
        path = fire.write_video(tmp_path / "a.mp4", frames, "libx264", "yuv420p", options)
    clip = opened(path, crop="auto", height="source", matte="none")
    left, top, width, height = stated(clip.notes[0])
    for frame in frames:
        lit = np.argwhere(frame[..., 0] > 100)
        assert lit.min(axis=0)[0] >= top
        assert lit.min(axis=0)[1] >= left
        assert lit.max(axis=0)[0] < top + height
        assert lit.max(axis=0)[1] < left + width
    assert (clip.width, clip.height) == (width, height)
    assert width * height < 0.8 * 600 * 900


@pytest.mark.parametrize("form", ["mp4", "folder"])
def test_crop_auto_leaves_the_choice_of_the_matte_to_the_whole_frame(
    form: str, tmp_path: Path
) -> None:
    frames = flames(4, (300, 500))
    for frame in frames:
        frame[60:, 100:420, :3] = np.maximum(frame[60:, 100:420, :3], (200, 90, 10))
    if form == "folder":
        path = fire.write_folder(tmp_path / "f", frames)
    else:
        path = fire.write_video(tmp_path / "a.mp4", frames, "libx264", "yuv420p")
    whole, part = opened(path), opened(path, crop="auto")
    assert part.width < 400
    assert part.matte == whole.matte


def stated(note: str) -> list[int]:
    """Left, top, width and height in a note on ``crop: auto``."""
    return [int(word) for word in note.split("[")[1].split("]")[0].split(",")]


def test_crop_auto_of_transparent_frames_holds_all_that_is_visible(tmp_path: Path) -> None:
    frames = [np.zeros((60, 80, 4), np.uint8) for _ in range(3)]
    frames[0][30, 40] = 255
    frames[2][20, 50] = 1, 1, 1, 1
    clip = opened(fire.write_folder(tmp_path / "f", frames), crop="auto")
    left, top, width, height = stated(clip.notes[0])
    assert left <= 40 < 50 < left + width
    assert top <= 20 < 30 < top + height
    assert width * height < 0.1 * 60 * 80


def glowing(reach: float, middle: tuple[int, int], size: tuple[int, int] = (180, 300)) -> fire.Rgba:
    """A flame at ``middle`` (y, x) whose glow, which does not move, fades over ``reach`` px."""
    y, x = np.mgrid[: size[0], : size[1]]
    away = np.hypot(y - middle[0], x - middle[1])
    light = np.maximum(np.where(away < 20, 255, 0), 90 * np.exp(-np.maximum(away - 20, 0) / reach))
    frame = np.zeros((*size, 4), np.uint8)
    frame[..., :3] = np.rint(light[..., None] * (1, 0.6, 0.2))
    frame[..., 3] = 255
    return frame


def highest_alpha(clip: Clip) -> NDArray[np.float32]:
    return np.asarray(np.max([clip.read(i)[..., 3] for i in range(clip.count)], axis=0))


def edges_of(alpha: NDArray[np.float32]) -> list[float]:
    """The highest alpha along each side, of 255."""
    return [255 * float(side.max()) for side in (alpha[0], alpha[-1], alpha[:, 0], alpha[:, -1])]


@pytest.mark.parametrize("reach", [2, 8, 25, 80])
@pytest.mark.parametrize("middle", [(90, 150), (90, 15), (170, 150), (4, 290)])
@pytest.mark.parametrize("keys", [{}, {"height": 77}, {"sampling": "nearest", "height": 240}])
def test_crop_auto_of_light_shows_no_edge_and_leaves_the_flame_as_it_is(
    reach: float, middle: tuple[int, int], keys: dict[str, Any], tmp_path: Path
) -> None:
    frames = [glowing(reach, middle) for _ in range(3)]
    path = fire.write_folder(tmp_path / "f", frames)
    clip = opened(path, crop="auto", matte="luminance", black=0, **keys)
    assert max(edges_of(highest_alpha(clip))) <= 2
    if keys or middle != (90, 150):
        return  # resized, or the camera cut the flame off, so that it fades itself
    left, top, width, height = stated(clip.notes[0])
    box = slice(71 - top, 110 - top), slice(131 - left, 170 - left)
    whole = opened(path, matte="luminance", black=0)
    np.testing.assert_array_equal(clip.read(0)[box], whole.read(0)[71:110, 131:170])
    assert width * height < 180 * 300


def test_crop_auto_grows_by_glow_that_ends_near_the_flame_and_does_not_fade_it(
    tmp_path: Path,
) -> None:
    frame = np.zeros((200, 300, 4), np.uint8)
    frame[..., 3] = 255
    frame[65:135, 115:185, :3] = 20, 9, 3  # 5 px around the flame: beyond its margin of 4 %
    frame[70:130, 120:180, :3] = 255, 160, 60
    path = fire.write_folder(tmp_path / "f", [frame] * 2)
    clip = opened(path, crop="auto", matte="luminance", black=0)
    left, top, width, height = stated(clip.notes[0])
    assert [left, top, left + width, top + height] == [114, 64, 186, 136]
    assert "fade" not in clip.notes[0]
    np.testing.assert_array_equal(
        clip.read(0), opened(path, matte="luminance", black=0).read(0)[64:136, 114:186]
    )


def test_crop_auto_keeps_art_that_reaches_its_own_edges(tmp_path: Path) -> None:
    frames = [np.full((30, 40, 4), (255, 120, 20, 255), np.uint8) for _ in range(2)]
    for frame in frames:
        frame[:, :12] = 0
    clip = opened(fire.write_folder(tmp_path / "f", frames), crop="auto")
    alpha = highest_alpha(clip)
    assert alpha.shape[0] == 30 and edges_of(alpha)[:2] == [255, 255]


def test_without_flame_crop_auto_keeps_the_frame(tmp_path: Path) -> None:
    dark = np.zeros((60, 80, 4), np.uint8)
    dark[..., 3] = 255
    clip = opened(fire.write_folder(tmp_path / "f", [dark, dark]), crop="auto")
    assert (clip.width, clip.height) == (80, 60)


@given(st.integers(0, 50), st.integers(0, 70), st.integers(0, 9))
def test_one_lit_pixel_is_within_the_box(y: int, x: int, i: int) -> None:
    extent = FlameExtent()
    for k in range(10):
        frame = np.zeros((51, 71, 3), np.uint8)
        frame[y, x] = 200 * (k == i)
        extent.add(k, small_copy(frame))
    box = extent.box((71, 51))
    assert box.left <= x < box.right
    assert box.top <= y < box.bottom


@settings(deadline=None)
@given(st.integers(8, 90), st.integers(8, 90), st.sampled_from([3, 4]), st.data())
def test_reducing_a_few_rows_at_a_time_is_resizing(
    height: int, width: int, channels: int, data: st.DataObject
) -> None:
    rng = np.random.default_rng(height)
    picture = rng.integers(0, 256, (height, width, channels), dtype=np.uint8)
    size = data.draw(st.integers(1, width)), data.draw(st.integers(1, height))
    wanted = resize(to_light(picture), *size)[..., :channels]
    np.testing.assert_allclose(reduce(picture, *size), wanted, atol=2e-6)


def test_a_video_is_decoded_once_however_its_frames_are_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    decoded = counted(monkeypatch)
    path = film(tmp_path / "a.mp4", 12)
    clip = opened(path)
    for i in (11, 0, 5, 3, 11, 4):
        clip.read(i)
    assert decoded == list(range(12))
    opened(path, crop="auto")
    assert decoded == 3 * list(range(12))


def test_decoding_stops_after_the_last_frame_that_is_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    decoded = counted(monkeypatch)
    path = film(tmp_path / "a.mp4", 12)
    for stated in ({"matte": "none"}, {"matte": "luminance", "black": 16}):
        decoded.clear()
        assert opened(path, start=2, count=3, **stated).count == 3
        assert decoded == [0, 1, 2, 3, 4]


def test_for_the_matte_decoding_goes_on_to_the_last_sample_and_not_beyond(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(listing, "_SAMPLED_FRAMES", 9)
    decoded = counted(monkeypatch)
    assert opened(film(tmp_path / "a.mp4", 12), start=2, count=3).count == 3
    assert decoded == list(range(9))


def counted(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Return a list that gets the number of every frame that is decoded."""
    decoded = list[int]()

    def counting(
        path: Path, scan: VideoScan, threads: int, max_pixels: int
    ) -> Generator[DecodedFrame]:
        for i, frame in enumerate(decode_video(path, scan, threads, max_pixels)):
            decoded.append(i)
            yield frame

    monkeypatch.setattr(video, "decode_video", counting)
    return decoded


def test_frames_that_an_edit_list_hides_are_left_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = film_with_hidden_frames(tmp_path / "a.mp4", 20, 2)
    decoded = counted(monkeypatch)
    clip = opened(path, matte="none")
    assert clip.count == 18
    assert decoded == list(range(18))
    # The frames of the whole film from the third on, to what is lost by swscale's other roundings.
    plain = cv2.VideoCapture(str(path), cv2.CAP_FFMPEG)
    for i in range(18):
        frame = np.asarray(plain.read()[1]).astype(int)
        assert np.abs(clip.picture(i)[..., 2::-1] - frame).mean() < 2


def film_with_hidden_frames(path: Path, count: int, hidden: int) -> Path:
    """Write a video whose first frames are before its beginning, as cuts without encoding leave."""
    with av.open(str(path), "w") as container:
        stream: Any = container.add_stream("libx264", rate=24, options={"crf": "12", "bf": "0"})
        stream.width, stream.height, stream.pix_fmt = 128, 96, "yuv420p"
        pictures = [av.VideoFrame.from_ndarray(frame) for frame in rgb(flames(count, (96, 128)))]
        for i, picture in enumerate(pictures):
            picture.pts = i
        for packet in [packet for each in (*pictures, None) for packet in stream.encode(each)]:
            packet.pts -= hidden * round(1 / 24 / packet.time_base)
            packet.dts = packet.pts
            container.mux(packet)
    return path


def rgb(frames: list[fire.Rgba]) -> list[fire.Rgba]:
    return [np.ascontiguousarray(frame[..., :3]) for frame in frames]


def test_the_number_of_workers_changes_no_pixel(tmp_path: Path) -> None:
    path = film(tmp_path / "a.mp4", 9)
    with Workers(1) as one, Workers(3) as three:
        source = FramesSource(path=str(path), crop="auto")
        a = open_frames(source, path, OpeningContext("srgb", one))
        b = open_frames(source, path, OpeningContext("srgb", three))
    for i in range(9):
        np.testing.assert_array_equal(a.picture(i), b.picture(i))


def test_frames_come_back_from_the_temporary_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(frame_store, "MEMORY_BYTES", 1000)
    rng, store = np.random.default_rng(2), FrameStore(tmp_path / "a.mp4")
    shapes = [(4, 5, 3), (9, 8, 4), (2, 3, 4)]
    frames: list[NDArray[Any]] = [rng.random(shape).astype(np.float32) for shape in shapes]
    frames += [rng.integers(0, 9, (20, 30, 4), dtype=np.uint16)]
    for i, frame in enumerate(frames):
        store.add(i, frame)
    for i in (3, 0, 2, 1):
        np.testing.assert_array_equal(store.read(i), frames[i])
        assert store.read(i).dtype == frames[i].dtype


class FullDisk(io.BytesIO):
    """A file on a disk without room."""

    def write(self, _: object) -> int:
        raise OSError(errno.ENOSPC, "No space left on device")


def test_a_full_disk_says_where_it_is_full(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tempfile, "SpooledTemporaryFile", lambda **_: FullDisk())
    store = FrameStore(Path("clips/a.mp4"))
    with pytest.raises(SourceError, match=r"clips/a\.mp4: .*No space left.*TMPDIR") as refused:
        store.add(0, np.zeros((1, 1, 3), np.uint8))
    assert tempfile.gettempdir() in str(refused.value)

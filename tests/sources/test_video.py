"""Videos: counting, timing, alpha, and files that are not whole."""

import io
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest
from PIL import Image

from fire_atlas.core.errors import SourceError
from fire_atlas.sources.video_stream import scan_video
from tests.support import synthetic_fire as fire


def mp4(path: Path, count: int = 24) -> Path:
    options = {"crf": "5", "g": "6"}
    return fire.write_video(path, fire.fires(count), "libx264", "yuv420p", options, rate=24)


def webm(path: Path, count: int = 12) -> Path:
    return fire.write_video(path, fire.fires(count), "libvpx-vp9", "yuva420p", rate=12)


def test_a_video_is_shown_at_another_rate(tmp_path: Path) -> None:
    path = mp4(tmp_path / "a.mp4")
    whole = fire.open_clip(path, matte="none")
    half = fire.open_clip(path, matte="none", fps=8)
    assert (whole.count, whole.fps) == (24, 24)
    assert (half.count, half.fps) == (8, 8)
    for k in range(8):
        np.testing.assert_array_equal(half.read(k), whole.read(3 * k + 1))


def test_a_quicktime_film_with_alpha_keeps_it(tmp_path: Path) -> None:
    path = fire.write_video(tmp_path / "a.mov", fire.fires(3), "qtrle", "argb", rate=12)
    clip = fire.open_clip(path)
    assert clip.matte == "alpha"
    np.testing.assert_allclose(clip.read(2), fire.light(fire.fires(3)[2]), atol=1e-6)


@pytest.mark.parametrize("name", ["a.mp4", "fast.mp4", "a.webm", "a.mov", "a.avi"])
def test_a_truncated_video_is_refused(
    name: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / name
    if name.endswith("webm"):
        webm(path)
    elif name.startswith("fast"):
        mp4(path)
        path = remuxed_with_index_first(path)
    else:
        codec = "mjpeg" if name.endswith("avi") else "libx264"
        layout = "yuvj420p" if codec == "mjpeg" else "yuv420p"
        fire.write_video(path, fire.fires(12), codec, layout)
    data = path.read_bytes()
    for share in (0.1, 0.5, 0.9, 0.995):
        cut = tmp_path / f"cut{path.suffix}"
        cut.write_bytes(data[: int(len(data) * share)])
        with pytest.raises(SourceError, match=rf"cut\{path.suffix}.*truncated"):
            fire.open_clip(cut)
    assert capfd.readouterr().err == ""


def remuxed_with_index_first(path: Path) -> Path:
    """Write the film again with its index before its pictures, as for streaming."""
    fast = path.with_name("index_first.mp4")
    with (
        av.open(str(path)) as source,
        av.open(str(fast), "w", options={"movflags": "faststart"}) as target,
    ):
        stream = target.add_stream_from_template(source.streams.video[0])
        for packet in source.demux(video=0):
            if packet.size:
                packet.stream = stream
                target.mux(packet)
    return fast


def test_a_film_of_garbage_is_refused(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    data = bytearray(mp4(tmp_path / "a.mp4").read_bytes())
    at = data.index(b"mdat") + 4
    stop = data.index(b"moov") - 4
    data[at:stop] = bytes(stop - at)
    (tmp_path / "b.mp4").write_bytes(data)
    with pytest.raises(SourceError, match=r"b\.mp4"):
        fire.open_clip(tmp_path / "b.mp4")
    (tmp_path / "c.webm").write_bytes(b"\x1aE\xdf\xa3" + bytes(200))
    with pytest.raises(SourceError, match=r"c\.webm"):
        fire.open_clip(tmp_path / "c.webm")
    (tmp_path / "d.mpg").write_bytes(b"hello" * 50)
    with pytest.raises(SourceError, match=r"d\.mpg"):
        fire.open_clip(tmp_path / "d.mpg")
    assert capfd.readouterr().err == ""


HLS = "#EXTM3U\n#EXT-X-VERSION:3\n#EXT-X-TARGETDURATION:2\n#EXTINF:2,\n{}\n#EXT-X-ENDLIST\n"
PLAYLISTS = {"hls": HLS, "concat": "ffconcat version 1.0\nfile {}\n"}


@pytest.mark.parametrize("playlist", PLAYLISTS)
@pytest.mark.parametrize("name", ["a.avi", "a.m3u8.mpg", "a.mp4", "a.webm", "a.mov"])
def test_a_playlist_that_is_called_a_video_leads_to_no_other_file(
    tmp_path: Path, playlist: str, name: str
) -> None:
    other = mp4(tmp_path / "other.mp4")
    (tmp_path / name).write_text(PLAYLISTS[playlist].format(other.name))
    with pytest.raises(SourceError, match="cannot be decoded"):
        fire.open_clip(tmp_path / name)


def test_a_frame_far_larger_than_the_header_says_is_not_decoded(tmp_path: Path) -> None:
    path, frame = tmp_path / "a.mov", io.BytesIO()
    Image.new("RGB", (3000, 3000)).save(frame, "png")
    with av.open(str(path), "w") as container:
        stream = container.add_stream("png", rate=12)
        stream.width = stream.height = 32
        stream.pix_fmt = "rgb24"
        for i in range(3):
            packet = av.Packet(frame.getvalue())
            packet.stream, packet.pts, packet.dts = stream, i, i
            packet.time_base, packet.is_keyframe = Fraction(1, 12), True
            container.mux(packet)
    assert scan_video(path, 3000 * 3000).look.stored == (3000, 3000)
    with pytest.raises(SourceError, match=r"a\.mov: .*cannot be decoded"):
        scan_video(path, 32 * 32)

"""GIFs that break the rules of their format, and play in every browser nevertheless."""

from pathlib import Path

import pytest

from fire_atlas.core.errors import SourceError
from fire_atlas.sources.images import decode, read_header
from tests.sources.test_animated import BLUE, CLEAR, GREEN, RED, gif_bytes, shown
from tests.support import synthetic_fire as fire

FRAMES = [(0, 1, [3, 1, 2, 0], 10), (0, 1, [1, 2, 0, 1], 10)]
PICTURES = [[CLEAR, GREEN, BLUE, RED], [GREEN, BLUE, RED, GREEN]]
WHOLE = gif_bytes(FRAMES)
CONTROL = b"\x21\xf9\x04"


def written(path: Path, data: bytes) -> Path:
    path.write_bytes(data)
    return path


def notes(path: Path) -> tuple[str, ...]:
    return fire.open_clip(path, matte="alpha").notes


def second_frame() -> int:
    """Offset of the control block of the second frame."""
    return WHOLE.rindex(CONTROL)


def test_a_whole_gif_has_no_notes(tmp_path: Path) -> None:
    path = written(tmp_path / "a.gif", WHOLE)
    assert shown(path) == PICTURES
    assert notes(path) == ()


def test_without_its_trailer_it_plays_with_a_note(tmp_path: Path) -> None:
    path = written(tmp_path / "a.gif", WHOLE[:-1])
    assert shown(path) == PICTURES
    assert notes(path) == ("it ends without a trailer, perhaps too early; its 2 frames are whole",)


def test_zero_bytes_between_blocks_are_skipped_with_a_note(tmp_path: Path) -> None:
    at = second_frame()
    path = written(tmp_path / "a.gif", WHOLE[:at] + bytes(3) + WHOLE[at:-1] + bytes(2))
    assert shown(path) == PICTURES
    padding, end = notes(path)
    assert padding == "5 zero bytes between its blocks are skipped"
    assert "ends without a trailer" in end


def test_one_that_ends_inside_a_frame_is_refused(tmp_path: Path) -> None:
    for stop in range(second_frame() + 1, len(WHOLE) - 1):
        path = written(tmp_path / "a.gif", WHOLE[:stop])
        with pytest.raises(SourceError, match=r"a\.gif: the file is truncated: it ends at byte"):
            fire.open_clip(path)


def test_what_is_no_block_is_refused(tmp_path: Path) -> None:
    at = second_frame()
    path = written(tmp_path / "a.gif", WHOLE[:at] + b"\x77" + WHOLE[at:])
    with pytest.raises(SourceError, match=rf"a\.gif: byte {at} should begin a block, but is 0x77"):
        fire.open_clip(path)


def test_a_screen_without_pixels_is_as_large_as_the_first_frame(tmp_path: Path) -> None:
    path = written(tmp_path / "a.gif", WHOLE[:6] + bytes(4) + WHOLE[10:])
    assert shown(path) == PICTURES
    assert notes(path) == ("its screen of 0x0 is made as large as its first frame, as in browsers",)


def test_a_first_frame_that_is_larger_than_the_screen_enlarges_it(tmp_path: Path) -> None:
    frames = [(1, 1, [3, 1, 2, 0], 10), (2, 1, [1], 10)]
    path = written(tmp_path / "a.gif", gif_bytes(frames, width=3))
    assert shown(path) == [[CLEAR, GREEN, BLUE, RED], [CLEAR, GREEN, GREEN, RED]]
    assert "its screen of 3x1 is made as large as its first frame" in notes(path)[0]


def test_later_frames_beyond_the_screen_are_cut_with_a_note(tmp_path: Path) -> None:
    frames = [FRAMES[0], (3, 1, [1, 2, 2], 10), (9, 1, [1], 10)]
    path = written(tmp_path / "a.gif", gif_bytes(frames))
    last = [CLEAR, GREEN, BLUE, GREEN]
    assert shown(path) == [[CLEAR, GREEN, BLUE, RED], last, last]
    assert notes(path) == (
        "2 of its 3 frames reach beyond its screen of 4x1; what is outside is left out, as in "
        "browsers",
    )


def test_a_still_among_images_is_read_as_one_alone(tmp_path: Path) -> None:
    still = gif_bytes([(1, 1, [0, 2], 0)])[:-1]
    (tmp_path / "f").mkdir()
    for i in range(2):
        written(tmp_path / "f" / f"{i}.gif", still)
    assert shown(tmp_path / "f") == [[CLEAR, RED, BLUE, CLEAR]] * 2
    assert notes(tmp_path / "f") == (
        "it ends without a trailer, perhaps too early; its frame is whole",
    )
    path = tmp_path / "f" / "0.gif"
    assert decode(path, read_header(path)).shape == (1, 4, 4)


def test_a_huge_first_frame_is_refused_by_its_header(tmp_path: Path) -> None:
    data = bytearray(gif_bytes([(0, 1, [0] * 4, 10)]))
    at = data.index(b"\x2c")
    data[at + 5 : at + 9] = b"\xff" * 4
    with pytest.raises(SourceError, match="65535x65535 is too large"):
        read_header(written(tmp_path / "a.gif", bytes(data)))

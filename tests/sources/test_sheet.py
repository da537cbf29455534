"""Sprite sheets: whole cells untouched, others sampled where they really lie."""

import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from fire_atlas.core.errors import SourceError
from fire_atlas.core.picture import Picture
from fire_atlas.core.pixels import Pixels
from fire_atlas.core.workers import Workers
from fire_atlas.recipe.source import Grid
from fire_atlas.sources.header import Header
from fire_atlas.sources.images import decode
from fire_atlas.sources.sheet import likely_grid, open_sheet
from tests.support import synthetic_fire as fire


def test_whole_cells_are_cut_out_bit_for_bit(tmp_path: Path) -> None:
    frames = fire.fires()
    path = fire.write_sheet(tmp_path / "s.png", frames, columns=2)
    reel = open_sheet(path, Grid(columns=2, rows=3))
    assert (reel.width, reel.height, reel.count) == (48, 40, 6)
    for i, frame in enumerate(frames):
        np.testing.assert_array_equal(reel.read(i), frame)


def _sheet_of_blobs(columns: int, rows: int, width: int = 24, height: int = 32) -> Pixels:
    """Return the alpha of a sheet whose frames show a blob that is smaller than their cell."""
    y, x = np.mgrid[0 : rows * height, 0 : columns * width]
    away = np.hypot((x % width - width / 2 + 0.5) / width, (y % height - height * 0.6) / height)
    return np.asarray(np.clip(1 - away / 0.35, 0, 1), np.float32)


@pytest.mark.parametrize("grid", [(2, 2), (4, 4), (5, 1), (1, 4), (3, 7), (16, 8)])
def test_a_sheet_is_recognised_by_the_empty_lines_between_its_frames(grid: tuple[int, int]) -> None:
    assert likely_grid(_sheet_of_blobs(*grid)) == grid


@pytest.mark.parametrize(
    "cover",
    [
        _sheet_of_blobs(1, 1),
        _sheet_of_blobs(2, 1),
        np.ones((64, 64), np.float32),
        np.zeros((64, 64), np.float32),
        _sheet_of_blobs(4, 4)[:-1, :-1],
    ],
)
def test_other_pictures_are_taken_for_no_sheet(cover: Pixels) -> None:
    assert likely_grid(cover) is None


def blob(x: np.ndarray, y: np.ndarray, at: tuple[float, float]) -> np.ndarray:
    return np.exp(-((x - at[0]) ** 2 + (y - at[1]) ** 2) / (2 * 3.0**2))


def centre(pixels: Pixels) -> tuple[float, float]:
    """Centre of the coverage, px, in the outer-corner convention."""
    alpha = pixels[..., 3].astype(np.float64)
    y, x = np.mgrid[: alpha.shape[0], : alpha.shape[1]] + 0.5
    return float((x * alpha).sum() / alpha.sum()), float((y * alpha).sum() / alpha.sum())


def uneven_sheet(path: Path, columns: int, rows: int, width: int, height: int) -> Path:
    """A sheet with the same soft blob at the centre of every cell, wherever that falls."""
    y, x = np.mgrid[:height, :width] + 0.5
    alpha = np.zeros((height, width))
    for row in range(rows):
        for column in range(columns):
            at = ((column + 0.5) * width / columns, (row + 0.5) * height / rows)
            alpha = np.maximum(alpha, blob(x, y, at))
    frame = np.full((height, width, 4), (255, 120, 0, 0), np.uint8)
    frame[..., 3] = np.rint(alpha * 255)
    Image.fromarray(frame).save(path)
    return path


def test_a_blob_in_the_middle_of_every_cell_stays_there(tmp_path: Path) -> None:
    path = uneven_sheet(tmp_path / "s.png", 12, 6, 512, 256)
    clip = fire.open_clip(path, grid={"columns": 12, "rows": 6})
    assert (clip.width, clip.height, clip.count) == (43, 43, 72)
    for i in range(clip.count):
        x, y = centre(clip.read(i))
        assert abs(x - 21.5) < 0.02
        assert abs(y - 21.5) < 0.02


def test_colour_hidden_under_transparency_does_not_bleed(tmp_path: Path) -> None:
    frame = np.zeros((10, 31, 4), np.uint8)
    frame[..., 1] = 255
    frame[:, 5:25] = (255, 0, 0, 255)
    Image.fromarray(frame).save(tmp_path / "s.png")
    for i in range(2):
        cell = fire.open_clip(tmp_path / "s.png", grid={"columns": 2, "rows": 1}).read(i)
        assert cell[..., 1].max() == 0


def test_nothing_but_the_shared_pixel_comes_from_a_neighbour(tmp_path: Path) -> None:
    frame = np.zeros((9, 31, 4), np.uint8)
    frame[..., 3] = 255
    frame[:, 16:] = 255
    Image.fromarray(frame).save(tmp_path / "s.png")
    clip = fire.open_clip(tmp_path / "s.png", matte="none", grid={"columns": 2, "rows": 1})
    assert clip.read(0)[..., :3].max() == 0


@given(
    st.integers(1, 9), st.integers(1, 9), st.integers(0, 40), st.integers(0, 40)
)  # fmt: skip
def test_every_grid_gives_equal_frames_of_the_nearest_size(
    columns: int, rows: int, more_width: int, more_height: int
) -> None:
    from fire_atlas.sources import sheet

    width, height = columns + more_width, rows + more_height
    picture = np.random.default_rng(0).integers(0, 256, (height, width, 4), np.uint8)
    grid = Grid(columns=columns, rows=rows)
    across = sheet._cells_of(width, columns, None, grid)
    down = sheet._cells_of(height, rows, None, grid)
    assert across is not None and down is not None
    for i in range(columns * rows):
        cell = sheet._fractional_cell(picture, across, down, i)
        assert abs(cell.shape[0] - height / rows) <= 0.5
        assert abs(cell.shape[1] - width / columns) <= 0.5
        if width % columns == 0 and height % rows == 0:
            whole = fire.light(sheet._whole_cell(picture, across, down, i))
            np.testing.assert_allclose(cell, whole, atol=1e-6)


def cells_apart(
    cells: list[np.ndarray], columns: int, margin: int, spacing: int, rest: tuple[int, int] = (0, 0)
) -> np.ndarray:
    """Return a sheet of equal cells, with what no cell covers in white; ``rest``: px more on the
    right and at the bottom."""
    height, width = cells[0].shape[:2]
    rows = len(cells) // columns
    full_height = 2 * margin + rows * (height + spacing) - spacing + rest[1]
    full_width = 2 * margin + columns * (width + spacing) - spacing + rest[0]
    sheet = np.full((full_height, full_width, 4), 255, np.uint8)
    for i, cell in enumerate(cells):
        row, column = divmod(i, columns)
        top, left = margin + row * (height + spacing), margin + column * (width + spacing)
        sheet[top : top + height, left : left + width] = cell
    return sheet


@given(st.integers(0, 5), st.integers(0, 5), st.sampled_from([1, 2, 3, 6]), st.data())
def test_cells_are_found_between_margin_and_spacing(
    margin: int, spacing: int, columns: int, data: st.DataObject
) -> None:
    import tempfile

    frames, rows = fire.fires(6, 12, 9), 6 // columns
    rest = (data.draw(st.integers(0, 11 + spacing)), data.draw(st.integers(0, 8 + spacing)))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "s.png"
        Image.fromarray(cells_apart(frames, columns, margin, spacing, rest)).save(path)
        readers = [open_sheet(path, Grid(cell=(12, 9), margin=margin, spacing=spacing))]
        if rest == (0, 0):
            grid = Grid(columns=columns, rows=rows, margin=margin, spacing=spacing)
            readers.append(open_sheet(path, grid))
        for reader in readers:
            assert (reader.width, reader.height, reader.count) == (12, 9, 6)
            assert bool(reader.notes) == (rest != (0, 0))
            for i, frame in enumerate(frames):
                np.testing.assert_array_equal(reader.read(i), frame)


def test_what_is_no_whole_cell_is_noted(tmp_path: Path) -> None:
    Image.fromarray(np.zeros((21, 34, 4), np.uint8)).save(tmp_path / "s.png")
    (note,) = open_sheet(tmp_path / "s.png", Grid(cell=(10, 9), spacing=1)).notes
    assert note == (
        "its grid has 3 columns x 2 rows of whole cells; 2 px on the right and 2 px at the bottom "
        "are no whole cell, and left out"
    )


def test_cells_with_a_margin_need_not_be_whole_pixels(tmp_path: Path) -> None:
    inner = uneven_sheet(tmp_path / "inner.png", 12, 6, 512, 256)
    sheet = np.zeros((270, 526, 4), np.uint8)
    sheet[7:-7, 7:-7] = np.asarray(Image.open(inner))
    Image.fromarray(sheet).save(tmp_path / "s.png")
    bare = open_sheet(inner, Grid(columns=12, rows=6))
    framed = open_sheet(tmp_path / "s.png", Grid(columns=12, rows=6, margin=7))
    assert framed.count == bare.count == 72
    for i in range(72):
        np.testing.assert_allclose(framed.read(i), bare.read(i), atol=1e-4)


@pytest.mark.parametrize(
    ("grid", "message"),
    [
        ({"columns": 2, "rows": 2, "margin": 20}, "2 columns x 2 rows, margin 20 cannot be cut"),
        ({"columns": 9, "rows": 1, "spacing": 5}, "9 columns x 1 rows, spacing 5 cannot be cut"),
        ({"cell": (49, 8)}, "a cell of 49x8 px cannot be cut from 48x40 pixels; one cell must fit"),
        ({"cell": (8, 8), "margin": 17}, "a cell of 8x8 px, margin 17 cannot be cut from 48x40"),
        ({"cell": (1, 1), "margin": 16384}, "a cell of 1x1 px, margin 16384 cannot be cut"),
    ],
)
def test_a_grid_that_leaves_no_pixel_is_refused(
    grid: dict[str, Any], message: str, tmp_path: Path
) -> None:
    Image.fromarray(fire.fires(1)[0]).save(tmp_path / "s.png")
    with pytest.raises(SourceError, match=message):
        open_sheet(tmp_path / "s.png", Grid(**grid))


def test_a_grid_of_too_many_cells_is_refused(tmp_path: Path) -> None:
    Image.fromarray(np.zeros((101, 100, 4), np.uint8)).save(tmp_path / "s.png")
    with pytest.raises(SourceError, match="which are 10100 cells; at most 10000 frames are"):
        open_sheet(tmp_path / "s.png", Grid(cell=(1, 1)))


def test_a_grid_finer_than_the_pixels_is_refused(tmp_path: Path) -> None:
    Image.fromarray(fire.fires(1)[0]).save(tmp_path / "s.png")
    with pytest.raises(SourceError, match=r"49 columns x 2 rows cannot be cut from 48x40 pixels"):
        fire.open_clip(tmp_path / "s.png", grid={"columns": 49, "rows": 2})


def test_a_grid_on_a_folder_is_refused(tmp_path: Path) -> None:
    folder = fire.write_folder(tmp_path / "f", fire.fires())
    with pytest.raises(SourceError, match=r"cuts one image into cells, but .* is 6 images"):
        fire.open_clip(folder, grid={"columns": 2, "rows": 2})


def test_a_sheet_is_decoded_once_however_many_threads_come_first(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = fire.write_sheet(tmp_path / "sheet.png", fire.fires(6), columns=3)
    decoded = list[Path]()

    def slowly(path: Path, header: Header) -> Picture:
        decoded.append(path)
        time.sleep(0.05)
        return decode(path, header)

    monkeypatch.setattr("fire_atlas.sources.sheet.decode", slowly)
    reader = open_sheet(path, Grid(columns=3, rows=2))
    with Workers(4) as workers:
        assert len(list(workers.map(reader.read, range(6)))) == 6
    assert decoded == [path]

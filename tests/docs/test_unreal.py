"""The numbers of docs/engines/unreal.md are those of its build, and its shader plays it."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from fire_atlas.cli import main
from tests.docs.markdown import code_blocks, prose, section
from tests.support.flipbook import Flipbook, read_flipbook, tent, unreal

PAGE = "docs/engines/unreal.md"


@pytest.fixture(scope="module")
def build(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The outputs of the recipe that the page shows."""
    folder = tmp_path_factory.mktemp("unreal")
    (recipe,) = code_blocks(PAGE, "yaml")
    (folder / "campfire.yaml").write_text(recipe)
    assert main(["build", "-q", str(folder / "campfire.yaml")]) == 0
    return folder / "build"


def rows(heading: str) -> list[list[str]]:
    table = [line for line in section(PAGE, heading).splitlines() if line.startswith("| ")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in table[1:]]


def test_inspect_prints_the_numbers_of_the_page(
    build: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    capsys.readouterr()
    details = ["--pages", "--frames", "--maps", "--flakes"]
    assert main(["inspect", str(build / "campfire.json"), *details]) == 0
    printed = " ".join(capsys.readouterr().out.split())
    number = {name: here for name, here, *_ in rows("Build")}
    columns, lines = number["columns × rows"].split(" × ")
    cell = number["cell, gutter included"].replace("×", "x")
    assert f"{columns} columns x {lines} rows of cells of {cell}, gutter included" in printed
    frame = number["frame"].replace("×", "x").removesuffix(" px")
    seconds, rate, count = (
        number[each] for each in ("length of the loop", "frames a second", "frames")
    )
    assert f"campfire {count} {seconds} {rate} in a loop {frame} " in printed
    (strength,) = re.findall(r" unreal ([\d.]+) of a cell a frame", printed)
    assert number["motion strength"] == f"{float(strength):.2g} of a cell a frame"
    assert f"length {number['length of the tracks']} " in printed
    (streak,) = re.findall(r"streak, of a frame's way ([\d.]+) ", printed)
    assert number["streak"] == f"{float(streak):.1f} of a frame's way"
    assert f"x + {float(streak):.1f} · speed / {rate} |" in prose(PAGE)


def test_sizes_and_frames_in_the_text_follow_from_the_numbers(build: Path) -> None:
    book, text = read_flipbook(build, "campfire"), " ".join(prose(PAGE).split())
    height = book.box[3]
    width_cm, height_cm = (100 * side / height for side in book.cell)
    assert f"= {width_cm:.1f} cm wide" in text and f"= {height_cm:.1f} cm high" in text
    assert f"*Sprite Size* {width_cm:.1f} × {height_cm:.1f}" in text
    assert f"*Plane* of {width_cm / 100:.3f} × {height_cm / 100:.3f}" in text
    assert f"*End Frame* {len(book.places) - 1}," in text
    # The cell's middle is the frame's, as the gutter lies on both sides of it.
    assert book.box[1] * 2 + book.box[3] == book.cell[1]
    assert book.box[0] * 2 + book.box[2] == book.cell[0]


class Vector:
    """A float2 or float4 of HLSL at every pixel, (h, w, components)."""

    def __init__(self, values: NDArray[np.float64]) -> None:
        self.values = values

    @property
    def rg(self) -> NDArray[np.float64]:
        return self.values[..., :2]


def played(book: Flipbook, frame: float) -> NDArray[np.float64]:
    """Run the page's shader on the first page of a flipbook: a cell, (h, w, 4) in 0..255."""
    (code,) = code_blocks(PAGE, "hlsl")
    width, height = book.cell
    page, motion = book.pages[0], book.motion[0]
    y, x = np.mgrid[:height, :width]
    uv = np.stack([(x + 0.5) / width, (y + 0.5) / height], axis=-1)

    def sample(texture: NDArray[np.float64], _: object, at: NDArray[np.float64]) -> Vector:
        return Vector(tent(texture, at * np.array(texture.shape[1::-1]) - 0.5) / 255)

    def lerp(one: Vector, other: Vector, part: float) -> NDArray[np.float64]:
        return one.values + (other.values - one.values) * part

    known: dict[str, Any] = {
        "float2": lambda *two: np.array(two), "frac": lambda a: a % 1, "fmod": np.fmod,
        "floor": np.floor, "lerp": lerp, "Texture2DSample": sample, "UV": uv, "Frame": frame,
        "Columns": page.shape[1] // width, "Rows": page.shape[0] // height,
        "Count": len(book.places), "Strength": book.reading["strength"]["cellUv"][0],
        "Page": page, "PageSampler": None, "Motion": motion, "MotionSampler": None,
    }  # fmt: skip
    python = re.sub(r"^(?:float\d? (?=\w+ =)|return (?=lerp))|;$", "", code, flags=re.MULTILINE)
    python = re.sub(r"^lerp", "shown = lerp", python, flags=re.MULTILINE)
    exec(python, known)
    return np.asarray(known["shown"]) * 255


def test_the_shader_of_the_page_plays_the_build(build: Path) -> None:
    """As a reader does that was written from the formula alone; between frames, and at the seam."""
    book = read_flipbook(build, "campfire")
    for frame in (3.0, 5.5, 23.25, 24 + 7.75):
        own = unreal(book, int(frame) % 24, frame % 1)
        np.testing.assert_allclose(played(book, frame), own, atol=1e-6)

"""What the engine draws is what lies on the pages, blended as the engine blends it."""

import json
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from fire_atlas.cli import main
from fire_atlas.core.pixels import Bytes
from fire_atlas.core.shipped import shipped
from fire_atlas.formats.atlas.texture_packer import read_atlas
from fire_atlas.pipeline.files.exports import exported_files
from fire_atlas.preview.blend import blend
from fire_atlas.preview.cut_frames import cut_frames
from tests.support.godot4 import Godot4
from tests.support.godot4 import picture as screenshot
from tests.support.marked import COUNT, MARK, SIZES, marked
from tests.support.sheets import product_of

BACKGROUND = (40, 60, 90)
SIZE, AT = (260, 240), (130, 200)


@dataclass(frozen=True)
class Case:
    """An export, and the frames of it that are drawn."""

    name: str
    atlas: dict[str, Any] = field(default_factory=dict)
    scale: str = ""
    frames: tuple[int, ...] = (0, 5, 11)

    @property
    def alpha(self) -> str:
        return str(self.atlas.get("alpha", "straight"))


CASES = [
    Case("straight"),
    Case("bled", {"bleed": 4, "padding": 8}),
    Case("premultiplied", {"alpha": "premultiplied"}),
    Case("additive", {"alpha": "additive"}),
    Case("pages", {"alpha": "premultiplied", "max_size": 256}),
    Case("webp", {"alpha": "premultiplied", "format": "webp"}),
    Case("grid", {"alpha": "premultiplied", "layout": "grid", "pot": True}),
    Case("half", {"alpha": "premultiplied", "scales": [1, 0.5]}, "@0.5x"),
    Case("meshes", {"alpha": "premultiplied", "mesh": {"vertices": 8}}),
    Case("half_mesh", {"mesh": {"vertices": 12}, "scales": [1, 0.5]}, "@0.5x"),
    Case("untrimmed", {"alpha": "straight", "trim": "none", "extrude": 2, "dedupe": False}),
]

WHITE = Case("white", {"mesh": {"vertices": 8}})
"""Its page is painted white: the screen shows the mesh."""
CORNER = (SIZE[0] - 20, SIZE[1] - 10)
"""Where a sprite is seen only because of its offset to the top and to the left."""


def build(game: Path, case: Case) -> None:
    frames = sorted((shipped("samples") / "campfire").glob("*.png"))[:12]
    recipe = game / f"{case.name}.yaml"
    recipe.write_text(json.dumps({
        "source": {"path": str(frames[0].parent), "count": 12, "height": 200},
        "atlas": case.atlas, "tracks": [], "timeline": {"loop": "none"},
        "exports": ["json", "godot"],
    }))  # fmt: skip
    assert main(["build", "-q", str(recipe), "-o", str(game)]) == 0


@pytest.fixture(scope="module")
def shots(godot4: Godot4, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A game in which every case was built and drawn, by one engine."""
    folder = tmp_path_factory.mktemp("pictures")
    jobs = {}
    for case in CASES:
        build(folder, case)
        for i in case.frames:
            jobs[f"{case.name}.{i}.shot"] = {
                "do": "draw", "scene": f"res://{case.name}{case.scale}.tscn", "at": AT,
                "animation": case.name, "frame": i,
                "background": "{:02x}{:02x}{:02x}".format(*BACKGROUND),
            }  # fmt: skip
    build(folder, WHITE)
    with Image.open(folder / "white.png") as page:
        Image.new("RGBA", page.size, "white").save(folder / "white.png")
    jobs["white.shot"] = {
        "do": "draw", "scene": "res://white.tscn", "at": CORNER, "animation": "white",
        "frame": 0, "background": "000000",
    }  # fmt: skip
    answers = godot4.run(folder, list(jobs.values()), SIZE)
    for name, answer in zip(jobs, answers, strict=True):
        Image.fromarray(screenshot(answer)).save(folder / name, "PNG")
    return folder


def shot(path: Path) -> Bytes:
    with Image.open(path) as image:
        return np.asarray(image.convert("RGB"))


def picture(frame: Bytes, pivot: tuple[float, float], alpha: str) -> Bytes:
    """The screen with a frame on it, as the engine's blend formula has it."""
    screen = np.zeros((SIZE[1], SIZE[0], 4), np.uint8)
    x, y = AT[0] - round(pivot[0]), AT[1] - round(pivot[1])
    screen[y : y + frame.shape[0], x : x + frame.shape[1]] = frame
    return blend(screen, BACKGROUND, alpha, "srgb")


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_a_frame_is_drawn_as_its_page_has_it(case: Case, shots: Path) -> None:
    """Within 1 of 255."""
    atlas = read_atlas(shots / f"{case.name}{case.scale}.json")
    frames = list(cut_frames(atlas))
    for i in case.frames:
        region = atlas.frames[i]
        pivot = region.anchor[0] * region.frame_width, region.anchor[1] * region.frame_height
        assert pivot == pytest.approx([round(length) for length in pivot], abs=1e-3)
        drawn = shot(shots / f"{case.name}.{i}.shot")
        wanted = picture(frames[i], pivot, case.alpha)
        difference = np.abs(drawn.astype(int) - wanted)
        assert difference.max() <= 1
        assert (wanted != np.array(BACKGROUND)).any(axis=2).sum() > 1000
    assert (len(atlas.sheet.pages) > 1) == ("max_size" in case.atlas)


def test_the_mesh_of_a_frame_is_drawn_and_nothing_beside_it(shots: Path) -> None:
    """Pixels whose middle is in one of its triangles, which each are half-planes."""
    frame = json.loads((shots / "white.json").read_bytes())["frames"]["white/0000"]
    size, anchor = frame["sourceSize"], frame["anchor"]
    left = CORNER[0] - round(anchor["x"] * size["w"])
    top = CORNER[1] - round(anchor["y"] * size["h"])
    y, x = np.mgrid[: SIZE[1], : SIZE[0]] + 0.5
    wanted, on_edge = np.zeros(x.shape, np.bool_), np.zeros(x.shape, np.bool_)
    for corners in frame["triangles"]:
        a, b, c = ([p[0] + left, p[1] + top] for p in (frame["vertices"][i] for i in corners))
        sides = [
            (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0])
            for p, q in ((a, b), (b, c), (c, a))
        ]
        wanted |= np.min(sides, axis=0) >= 0
        on_edge |= np.min(np.abs(sides), axis=0) == 0
    drawn = shot(shots / "white.shot").max(axis=2) > 0
    assert (drawn == wanted)[~on_edge].all()
    assert 3000 < wanted.sum() < 0.9 * frame["frame"]["w"] * frame["frame"]["h"]


MARKED: dict[str, dict[str, Any]] = {
    "packed": {},
    "pages": {"max_size": 32},
    "grid": {"layout": "grid"},
    "one_box": {"trim": "animation"},
    "premultiplied": {"alpha": "premultiplied"},
}


@pytest.fixture(scope="module")
def marks_seen(
    godot4: Godot4, tmp_path_factory: pytest.TempPathFactory
) -> dict[tuple[str, str, int], Bytes]:
    """What was drawn of every frame of the marked sprite, by case, animation and frame."""
    game = tmp_path_factory.mktemp("marked")
    jobs = {}
    for case, atlas in MARKED.items():
        (game / case).mkdir()
        made = marked(**atlas)
        made.write_pages(game / case)
        # Named as its folder, since a project has room for one effect of a name.
        product = product_of(replace(made.sheet, name=case, title=case))
        for file in exported_files(["godot"], product, {}):
            (game / case / file.name).write_bytes(file.data)
        for name in SIZES:
            for i in range(COUNT):
                jobs[case, name, i] = {
                    "do": "draw", "scene": f"res://{case}/{case}.tscn", "animation": name,
                    "frame": i, "at": AT, "background": "000000",
                }  # fmt: skip
    answers = godot4.run(game, list(jobs.values()), SIZE)
    return {key: screenshot(answer) for key, answer in zip(jobs, answers, strict=True)}


@pytest.mark.parametrize("case", MARKED)
def test_the_mark_is_shown_where_the_pivot_says(
    case: str, marks_seen: dict[tuple[str, str, int], Bytes]
) -> None:
    """Two animations of different sizes, each with its own pivot, are shown by one sprite."""
    for name, marks in marked(**MARKED[case]).marks.items():
        for i, mark in enumerate(marks):
            ((y, x),) = np.argwhere((marks_seen[case, name, i] == MARK).all(axis=2))
            assert (x + 0.5 - AT[0], y + 0.5 - AT[1]) == mark

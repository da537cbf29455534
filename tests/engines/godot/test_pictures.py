"""What the engine draws is what lies on the pages, blended as the engine blends it."""

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from fire_atlas.cli import main
from fire_atlas.core.pixels import Bytes
from fire_atlas.core.shipped import shipped
from fire_atlas.formats.atlas.texture_packer import read_atlas
from fire_atlas.pipeline.writers import exported_files
from fire_atlas.preview.blend import blend
from fire_atlas.preview.frames import cut_frames
from fire_atlas.recipe.output import GodotExport, GodotOptions
from tests.engines.godot.engine import Game
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


def build(game: Path, case: Case, version: int) -> None:
    frames = sorted((shipped("samples") / "campfire").glob("*.png"))[:12]
    recipe = game / f"{case.name}.yaml"
    recipe.write_text(json.dumps({
        "source": {"path": str(frames[0].parent), "count": 12, "height": 200},
        "atlas": case.atlas, "tracks": [], "timeline": {"loop": "none"},
        "exports": ["json", {"godot": {"version": version}}],
    }))  # fmt: skip
    assert main(["build", "-q", str(recipe), "-o", str(game)]) == 0


@pytest.fixture(scope="module")
def shots_of_3(godot: None, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A game in which every case was built and drawn, by one engine."""
    game = Game.at(tmp_path_factory.mktemp("pictures") / "game")
    jobs = []
    for case in CASES:
        build(game.folder, case, 3)
        jobs += [
            {"scene": f"res://{case.name}{case.scale}.tscn", "animation": case.name, "frame": i,
             "to": f"{case.name}.{i}.shot"}
            for i in case.frames
        ]  # fmt: skip
    assert game.import_all() == []
    job = {"at": AT, "background": "{:02x}{:02x}{:02x}".format(*BACKGROUND), "shots": jobs}
    assert game.ask("draw.gd", job, SIZE) == len(jobs)
    return game.folder


@pytest.fixture(scope="module")
def shots_of_4(godot4: Godot4, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same, drawn by Godot 4."""
    folder = tmp_path_factory.mktemp("pictures4")
    jobs = {}
    for case in CASES:
        build(folder, case, 4)
        for i in case.frames:
            jobs[f"{case.name}.{i}.shot"] = {
                "do": "draw", "scene": f"res://{case.name}{case.scale}.tscn", "at": AT,
                "animation": case.name, "frame": i,
                "background": "{:02x}{:02x}{:02x}".format(*BACKGROUND),
            }  # fmt: skip
    build(folder, WHITE, 4)
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
def test_godot_3_draws_a_frame_as_its_page_has_it(case: Case, shots_of_3: Path) -> None:
    assert_drawn(case, shots_of_3, 3)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_godot_4_draws_a_frame_as_its_page_has_it(case: Case, shots_of_4: Path) -> None:
    assert_drawn(case, shots_of_4, 1)


def assert_drawn(case: Case, folder: Path, most: int) -> None:
    """Compare screenshots with the pages; they may differ by ``most`` of 255."""
    atlas = read_atlas(folder / f"{case.name}{case.scale}.json")
    frames = list(cut_frames(atlas))
    for i in case.frames:
        region = atlas.frames[i]
        pivot = region.anchor[0] * region.frame_width, region.anchor[1] * region.frame_height
        assert pivot == pytest.approx([round(length) for length in pivot], abs=1e-3)
        drawn = shot(folder / f"{case.name}.{i}.shot")
        wanted = picture(frames[i], pivot, case.alpha)
        difference = np.abs(drawn.astype(int) - wanted)
        assert difference.max() <= most
        assert (wanted != np.array(BACKGROUND)).any(axis=2).sum() > 1000
    assert (len(atlas.sheet.pages) > 1) == ("max_size" in case.atlas)


def test_godot_4_draws_the_mesh_of_a_frame_and_nothing_beside_it(shots_of_4: Path) -> None:
    """Pixels whose middle is in one of its triangles, which each are half-planes."""
    frame = json.loads((shots_of_4 / "white.json").read_bytes())["frames"]["white/0000"]
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
    drawn = shot(shots_of_4 / "white.shot").max(axis=2) > 0
    assert (drawn == wanted)[~on_edge].all()
    assert 3000 < wanted.sum() < 0.9 * frame["frame"]["w"] * frame["frame"]["h"]


MARKED: dict[str, dict[str, Any]] = {
    "packed": {},
    "pages": {"max_size": 128},
    "grid": {"layout": "grid"},
    "one_box": {"trim": "animation"},
    "premultiplied": {"alpha": "premultiplied"},
}


@pytest.fixture(scope="module")
def marks_seen(godot: None, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A game with a folder for each case, in which every frame of the marked sprite was drawn."""
    game = Game.at(tmp_path_factory.mktemp("marked") / "game")
    jobs = []
    for case, atlas in MARKED.items():
        (game.folder / case).mkdir()
        made = marked(**atlas)
        made.write_pages(game.folder / case)
        export = GodotExport(godot=GodotOptions(version=3))
        for file in exported_files([export], product_of(made.sheet), {}):
            (game.folder / case / file.name).write_bytes(file.data)
        jobs += [
            {"scene": f"res://{case}/mark.tscn", "animation": name, "frame": i,
             "to": f"{case}.{name}.{i}.shot"}
            for name in SIZES
            for i in range(COUNT)
        ]  # fmt: skip
    assert game.import_all() == []
    game.ask("draw.gd", {"at": AT, "background": "000000", "shots": jobs}, SIZE)
    return game.folder


@pytest.mark.parametrize("case", MARKED)
def test_the_mark_is_shown_where_the_pivot_says(case: str, marks_seen: Path) -> None:
    """Two animations of different sizes, each with its own pivot, are shown by one sprite."""
    for name, marks in marked(**MARKED[case]).marks.items():
        for i, mark in enumerate(marks):
            drawn = shot(marks_seen / f"{case}.{name}.{i}.shot")
            ((y, x),) = np.argwhere((drawn == MARK).all(axis=2))
            assert (x + 0.5 - AT[0], y + 0.5 - AT[1]) == mark

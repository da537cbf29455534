"""PixiJS 8, Phaser 3 and Phaser 4, in a real browser, draw every frame as it went in."""

import json
import subprocess
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from fire_atlas.atlas.drawing import Edges, draw_page
from fire_atlas.atlas.encode import encode_frame, encode_sprites, shrink
from fire_atlas.atlas.pages import build_sheets
from fire_atlas.atlas.sheet import AnimationFrames
from fire_atlas.core.pixels import Bytes, Pixels
from fire_atlas.core.workers import Workers
from fire_atlas.formats.pages.page_file import write_page
from fire_atlas.pipeline.writers import exported_files
from fire_atlas.recipe.output import Atlas
from tests.support.sheets import product_of

WEB = Path(__file__).parent / "web"

WIDTH, HEIGHT, FOOT = 44, 56, (20, 48)
CANVAS, AT = 160, (80, 120)
FPS = 24


@dataclass(frozen=True)
class Case:
    """An atlas, the file of it that a client loads, and the client."""

    client: str
    export: str
    ending: str
    atlas: dict[str, Any] = field(default_factory=dict)
    scale: float = 1

    @property
    def name(self) -> str:
        settings = "-".join(f"{key}_{value}" for key, value in self.atlas.items())
        return "".join(
            c if c.isalnum() or c in "-_" else "_"
            for c in f"{self.client}-{self.export}-{settings}-{self.scale}"
        )

    @property
    def json(self) -> str:
        return f"fire{'' if self.scale == 1 else f'@{self.scale:g}x'}{self.ending}"


PAGES: dict[str, Any] = {"max_size": 64}
HALF: dict[str, Any] = {"scales": [1, 0.5]}
CASES = [
    Case("pixi", "json", ".json"),
    Case("pixi", "json", ".json", {"alpha": "premultiplied"}),
    Case("pixi", "json", ".json", PAGES),
    Case("pixi", "json", ".json", {**PAGES, "alpha": "premultiplied", "trim": "none"}),
    Case("pixi", "json", ".json", HALF, 0.5),
    Case("pixi", "json", ".json", {**HALF, "alpha": "premultiplied", **PAGES}, 0.5),
    Case("pixi", "json", ".json", {"rotate": True}),
    Case("pixi", "json", ".json", {"trim": "animation", "extrude": 2, "border": 3, "bleed": 2}),
    Case("pixi", "json", ".json", {"layout": "grid", "pot": True, "format": "webp"}),
    *(
        case
        for client in ("phaser", "phaser4")
        for case in (
            Case(client, "phaser", ".phaser.json"),
            Case(client, "phaser", ".phaser.json", PAGES),
            Case(client, "phaser", ".phaser.json", HALF, 0.5),
            Case(client, "phaser", ".phaser.json", {"trim": "none", "extrude": 1, "bleed": 3}),
            Case(client, "json", ".json", {"trim": "animation", "square": True}),
            Case(client, "json-array", ".array.json"),
            Case(client, "aseprite", ".aseprite.json"),
        )
    ),
]  # fmt: skip


def clip() -> list[Pixels]:
    """Frames that move, one empty, one of a single px, one that fills the frame, one repeated."""
    chance = np.random.default_rng(12)
    frames = []
    for _ in range(9):
        pixels = np.zeros((HEIGHT, WIDTH, 4), np.float32)
        x, y = chance.integers(0, 24, 2)
        patch = chance.random((*chance.integers(9, 30, 2), 4), np.float32)
        patch[..., :3] *= patch[..., 3:]
        room = pixels[y : y + patch.shape[0], x : x + patch.shape[1]]
        room[:] = patch[: room.shape[0], : room.shape[1]]
        frames.append(pixels)
    frames[3][:] = 0
    frames[5][:] = 0
    frames[5][17, 40] = 1
    frames[6][:] = np.array([0.1, 0.2, 0.4, 0.8])
    frames[8] = frames[1].copy()
    return frames


def write(case: Case, folder: Path) -> list[str]:
    """Write the atlas of a case as a build does; return the names of its frames."""
    settings = Atlas.model_validate(case.atlas)
    encoded = [encode_sprites(pixels, settings) for pixels in clip()]
    animation = AnimationFrames("fire", tuple(each[0] for each in encoded), 1000 / FPS, True, FOOT)
    sheets = build_sheets("fire", [animation], settings)
    for sheet, sprites in zip(sheets, zip(*encoded, strict=True), strict=True):
        for i, page in enumerate(sheet.pages):
            with Workers(1) as workers, (folder / page.file).open("wb") as file:
                image = draw_page(sheet, i, sprites, Edges.of(settings, sheet.scale))
                write_page(file, image, settings, workers)
    for description in exported_files([case.export], product_of(*sheets), {}):  # type: ignore[list-item]
        (folder / description.name).write_bytes(description.data)
    assert (len(sheets[0].pages) > 1) == ("max_size" in case.atlas)
    return [region.name for region in sheets[0].regions]


def zoom(case: Case) -> int:
    """Pixi shows a smaller variant as large as the whole one; Phaser shows it px for px."""
    return round(1 / case.scale) if case.client == "pixi" else 1


@pytest.fixture(scope="module")
def drawn(node: str, chromium: Path, tmp_path_factory: pytest.TempPathFactory) -> Any:
    """What every client drew in every case: one browser for all."""
    root = tmp_path_factory.mktemp("web")
    (root / "out").mkdir()
    jobs = []
    for case in CASES:
        (root / case.name).mkdir()
        names = write(case, root / case.name)
        jobs.append({
            "id": case.name, "client": case.client, "folder": str(root / case.name),
            "json": case.json, "title": "fire", "size": [CANVAS, CANVAS], "at": AT, "zoom": 1,
            "premultiplied": case.atlas.get("alpha") == "premultiplied", "names": names,
        })  # fmt: skip
    (root / "cases.json").write_text(json.dumps(jobs))
    ran = subprocess.run(
        [node, WEB / "play.mjs", root / "cases.json", root / "out"],
        capture_output=True, text=True, encoding="utf-8", timeout=280, check=False,
    )  # fmt: skip
    assert ran.returncode == 0, ran.stderr
    results = json.loads(ran.stdout)
    for job in jobs:
        result = results[job["id"]]
        data = np.frombuffer((root / "out" / f"{job['id']}.rgba").read_bytes(), np.uint8)
        result["pixels"] = data.reshape(result["frames"], CANVAS, CANVAS, 4)
        result["expected_names"] = job["names"]
    return results


def canvas(pixels: Pixels, case: Case) -> NDArray[np.float64]:
    """The frame as a client has to show it: premultiplied bytes, its foot at the given place."""
    alpha = case.atlas.get("alpha", "straight")
    image: Bytes = encode_frame(shrink(pixels, round(1 / case.scale)), alpha, "srgb")
    shown = image.astype(np.float64)
    if alpha == "straight":
        shown[..., :3] *= shown[..., 3:] / 255
    shown = shown.repeat(zoom(case), axis=0).repeat(zoom(case), axis=1)
    size = case.scale * zoom(case)
    x, y = AT[0] - round(FOOT[0] * size), AT[1] - round(FOOT[1] * size)
    whole = np.zeros((CANVAS, CANVAS, 4))
    whole[y : y + shown.shape[0], x : x + shown.shape[1]] = shown
    return whole


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_every_frame_is_drawn_as_it_was_and_where_it_was(case: Case, drawn: Any) -> None:
    result = drawn[case.name]
    assert result["errors"] == []
    assert result["frames"] == len(clip())
    allowed = 1 if case.atlas.get("alpha") == "premultiplied" else 2
    for pixels, shown in zip(clip(), result["pixels"], strict=True):
        assert np.abs(shown - canvas(pixels, case)).max() <= allowed
    assert result["pixels"][0].any()


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_the_animation_plays_every_frame_in_order_and_starts_over(case: Case, drawn: Any) -> None:
    result, count = drawn[case.name], len(clip())
    names = result["expected_names"]
    if case.export == "aseprite":
        names = [str(i) for i in range(count)]
    assert result["names"] == names
    assert result["played"][:count] == [*names[1:], names[0]]
    if "durations" in result:
        assert result["durations"] == pytest.approx([1000 / FPS] * count, abs=1e-3)
        assert result["repeat"] == -1


def test_the_clients_are_those_that_are_promised(drawn: Any) -> None:
    versions = {case.client: drawn[case.name]["version"].split(".")[0] for case in CASES}
    assert versions == {"pixi": "8", "phaser": "3", "phaser4": "4"}

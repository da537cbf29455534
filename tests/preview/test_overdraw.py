"""``inspect`` says how much is drawn beside what is visible, and which frames stay rectangles."""

from pathlib import Path

import pytest
from PIL import Image

from fire_atlas.atlas.drawing import Edges, draw_page
from fire_atlas.cli import main
from fire_atlas.formats.atlas.texture_packer import export_json_hash
from tests.support.sheets import sheet_with_meshes, sparks_and_others


def test_overdraw_agrees_with_a_recount(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    sprites = sparks_and_others()
    sheet = sheet_with_meshes(sprites)
    for file in export_json_hash(sheet):
        (tmp_path / file.name).write_bytes(file.data)
    page = draw_page(sheet, 0, sprites, Edges(0, 0, 0))
    Image.fromarray(page).save(tmp_path / "fire.png")
    assert main(["inspect", str(tmp_path / "fire.json"), "--overdraw"]) == 0
    said = capsys.readouterr().out
    row = next(line for line in said.splitlines() if "as meshes" in line)
    visible = sum(int((sprite.image.max(axis=2) > 0).sum()) for sprite in sprites)
    drawn, rectangles = 0.0, 0
    for region in sheet.regions:
        assert region.mesh is not None
        for corners in region.mesh.triangles:
            (ax, ay), (bx, by), (cx, cy) = (region.mesh.vertices[i] for i in corners)
            drawn += abs((bx - ax) * (cy - ay) - (cx - ax) * (by - ay)) / 2
        rectangles += region.width * region.height
    assert f" {drawn / visible:.2f} " in row and f" {rectangles / visible:.2f} " in row
    assert drawn < rectangles
    assert "5 as meshes of up to 7 vertices; 1 as rectangles: opaque; 1 as rectangles: empty" in row

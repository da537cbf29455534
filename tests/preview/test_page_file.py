"""What ``fire-atlas preview`` writes where nothing else is asked for."""

import base64
import json
import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fire_atlas.cli import main


@pytest.fixture
def recipe(tmp_path: Path) -> Path:
    (tmp_path / "clip").mkdir()
    y, x = np.mgrid[0:32, 0:24]
    for i in range(4):
        heat = np.clip(1 - np.hypot((x - 11.5) / 7, (y - 24) / (14 + i)), 0, 1)
        rgba = np.stack([255 * heat**0.3, 255 * heat, 120 * heat**2, 255 * heat**0.5], axis=-1)
        Image.fromarray(rgba.astype(np.uint8)).save(tmp_path / "clip" / f"{i:04}.png")
    path = tmp_path / "campfire.yaml"
    path.write_text("source: {path: clip, fps: 12}\nflakes: {rate: 200, alpha: 0.01}\n")
    return path


def test_the_page_of_an_atlas_lies_beside_it(
    recipe: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    build = recipe.parent / "build"
    assert main(["build", str(recipe), "-q"]) == 0
    before = {path.name for path in build.iterdir()}
    assert main(["preview", str(build / "campfire.json")]) == 0
    assert {path.name for path in build.iterdir()} - before == {"campfire.preview.html"}
    assert capsys.readouterr().out == f"{build / 'campfire.preview.html'}: 4 frames\n"


def test_the_page_of_a_recipe_lies_where_its_atlas_would(
    recipe: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["preview", str(recipe), "-q"]) == 0
    assert [path.name for path in (recipe.parent / "build").iterdir()] == ["campfire.preview.html"]
    assert capsys.readouterr() == ("", "")


def test_the_page_goes_where_the_command_says(recipe: Path, tmp_path: Path) -> None:
    assert main(["preview", str(recipe), "-q", "-o", str(tmp_path / "look.html")]) == 0
    assert (tmp_path / "look.html").is_file()
    assert not (tmp_path / "build").exists()


def test_the_page_holds_the_files_as_they_are_and_names_no_other_place(recipe: Path) -> None:
    assert main(["build", str(recipe), "-q"]) == 0
    atlas = recipe.parent / "build" / "campfire.json"
    assert main(["preview", str(atlas), "-q"]) == 0
    html = atlas.with_name("campfire.preview.html").read_text(encoding="utf-8")
    held = re.search(r'id="composed-page-0">([^<]*)<', html)
    assert held is not None
    page = atlas.with_suffix(".png").read_bytes()
    assert base64.b64decode(held[1]) == page
    addresses = set(re.findall(r"[a-z]+://[^\s'\"]+", html))
    assert addresses == {"http://www.w3.org/2000/svg"}, "a namespace, which nothing is asked of"
    assert len(html) < 4 * len(page) / 3 + 120_000
    assert 'id="wind"' not in html, "only fire that answers the wind has a slider for it"


def test_the_same_atlas_gives_the_same_page(recipe: Path) -> None:
    build = recipe.parent / "build"
    assert main(["build", str(recipe), "-q"]) == 0
    pages = []
    for _ in range(2):
        assert main(["preview", str(build / "campfire.json"), "-q"]) == 0
        pages.append((build / "campfire.preview.html").read_bytes())
    assert pages[0] == pages[1]


@pytest.mark.parametrize(
    ("spoil", "stated"),
    [
        (lambda page: page.unlink(), "campfire.png: the page cannot be read"),
        (lambda page: page.write_bytes(b"no image"), "campfire.png: is neither PNG nor WebP"),
        (
            lambda page: Image.new("RGBA", (7, 5)).save(page),
            "campfire.png: is 7x5, but the atlas says",
        ),
    ],
)
def test_a_page_that_is_not_what_it_should_be_is_refused(
    recipe: Path, spoil: object, stated: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["build", str(recipe), "-q"]) == 0
    atlas = recipe.parent / "build" / "campfire.json"
    assert callable(spoil)
    spoil(atlas.with_suffix(".png"))
    assert main(["preview", str(atlas)]) == 1
    assert stated in capsys.readouterr().err
    assert not atlas.with_name("campfire.preview.html").exists()


def test_an_atlas_at_half_size_shows_its_flakes_at_half_size(recipe: Path) -> None:
    recipe.write_text(recipe.read_text() + "atlas: {scales: [1, 0.5]}\n")
    assert main(["build", str(recipe), "-q"]) == 0
    atlas = recipe.parent / "build" / "campfire@0.5x.json"
    assert main(["preview", str(atlas), "-q"]) == 0
    html = atlas.with_name("campfire@0.5x.preview.html").read_text(encoding="utf-8")
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', html)
    assert found is not None
    data = json.loads(found[1])
    assert data["scale"] == 0.5
    assert sum(data["animations"][0]["flakes"]["counts"]) > 0

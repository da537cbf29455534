"""Pages of 16 bits a channel, as other programs read them."""

import json
from pathlib import Path
from typing import Any

import av
import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from fire_atlas.core.shipped import shipped
from fire_atlas.core.workers import Workers
from fire_atlas.formats.pages.png import write_png, write_small_png
from tests.support.repo import Repo

CAMPFIRE = {"path": str(shipped("samples") / "campfire"), "fps": 24, "count": 6, "height": 100}
DEEP = ("--set", "atlas.bits=16")


@pytest.fixture
def repo(tmp_path: Path) -> Repo:
    return Repo(tmp_path / "repo")


def read(path: Path) -> NDArray[Any]:
    """Return R, G, B, A as OpenCV decodes them."""
    image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    assert image is not None
    return image[..., [2, 1, 0, 3]]


def as_ffmpeg_reads(path: Path) -> NDArray[np.uint16]:
    with av.open(str(path)) as file:
        (frame,) = file.decode(video=0)
    assert frame.format.name == "rgba64be"
    plane = frame.planes[0]
    words = np.frombuffer(bytes(plane), ">u2").reshape(plane.height, -1)[:, : 4 * plane.width]
    return words.reshape(plane.height, plane.width, 4).astype(np.uint16)


@pytest.mark.parametrize("alpha", ["straight", "premultiplied", "additive"])
@pytest.mark.parametrize("space", ["srgb", "linear"])
def test_it_has_levels_between_those_of_the_page_of_8_bits_which_it_rounds_to(
    repo: Repo, alpha: str, space: str
) -> None:
    atlas = {"alpha": alpha, "blend_space": space, "scales": [1, 0.5], "rotate": True}
    recipe = repo.recipe(source=CAMPFIRE, maps={"flakes": True}, tracks=[], atlas=atlas)
    names = ("fire.png", "fire@0.5x.png", "fire.flakes.png")
    repo.built(recipe)
    shallow = {name: read(repo.build / name) for name in names}
    repo.built(recipe, *DEEP)
    for name in names:
        deep = read(repo.build / name)
        assert deep.dtype == np.uint16
        assert np.array_equal((deep.astype(np.int64) + 128) // 257, shallow[name]), name
        shines = shallow[name].any(axis=2)
        assert np.mean(deep[shines] % 257 != 0) > 0.5, name
        assert np.array_equal(as_ffmpeg_reads(repo.build / name), deep)
        with Image.open(repo.build / name) as image:  # which keeps the upper byte
            assert np.array_equal(np.asarray(image.convert("RGBA")), deep >> 8)
    meta = json.loads((repo.build / "fire.json").read_text())["meta"]
    assert meta["format"] == "RGBA16161616"
    assert "RGBA16161616" not in repo.run("inspect", repo.build / "fire.json").err


def test_a_clip_of_16_bits_reaches_the_page_in_16_bits(repo: Repo) -> None:
    """Up to the 13 steps that light at its darkest is rounded to in pages of 8 bits."""
    (repo.folder / "clip").mkdir()
    x, y = np.meshgrid(np.linspace(0, 1, 200), np.linspace(0, 1, 60))
    for i in range(3):
        image = np.stack([x * 0.2, x**2, y * (1 - i / 9), 0.1 + 0.9 * x], axis=2)
        words = np.rint(image * 65535).astype(np.uint16)
        cv2.imwrite(str(repo.folder / "clip" / f"{i}.png"), words[..., [2, 1, 0, 3]])
    keys: dict[str, Any] = {"flakes": "none", "motion_blur": "none", "tracks": []}
    atlas = {"bits": 16, "trim": "none"}
    repo.built(repo.recipe(**keys, atlas=atlas, timeline={"loop": "none"}))
    page, entries = (
        read(repo.build / "fire.png"),
        json.loads((repo.build / "fire.json").read_text()),
    )
    for i, entry in enumerate(entries["frames"].values()):
        place = entry["frame"]
        shown = page[place["y"] : place["y"] + 60, place["x"] : place["x"] + 200].astype(int)
        off = np.abs(shown - read(repo.folder / "clip" / f"{i}.png"))
        assert off.max() <= 13 and np.mean(off <= 1) > 0.97


def test_it_is_the_same_at_any_number_of_workers_and_vectors_keep_8_bits(repo: Repo) -> None:
    recipe = repo.recipe(source=CAMPFIRE, maps={"motion": "godot"})
    once = repo.built(recipe, *DEEP, "--jobs", "1")
    assert once == repo.built(recipe, *DEEP, "--jobs", "2", "--force")
    assert read(repo.build / "fire.motion.png").dtype == np.uint8


def test_optimising_changes_no_pixel(tmp_path: Path) -> None:
    image = np.random.default_rng(1).integers(0, 65536, (150, 37, 4), np.uint16)
    image[:, 5:20] //= 300
    for name, write in (("fast", write_png), ("small", write_small_png)):
        with Workers(2) as workers, (tmp_path / f"{name}.png").open("wb") as file:
            write(file, image, workers)
        assert np.array_equal(read(tmp_path / f"{name}.png"), image)


def test_textures_of_flakes_and_movies_go_with_it(repo: Repo) -> None:
    texture = {"texture": str(shipped("samples") / "pixel_flame.png"), "bake": False}
    keys: dict[str, Any] = {"source": CAMPFIRE, "movies": ["apng"], "flakes": texture}
    shallow = repo.built(repo.recipe(**keys, tracks=["json"]))
    page = read(repo.build / "fire.png")
    deep = repo.built(repo.recipe(**keys, tracks=["json"]), *DEEP)
    assert np.array_equal((read(repo.build / "fire.png").astype(int) + 128) // 257, page)
    for name in ("fire.apng", "fire.flakes.json"):
        assert deep[name] == shallow[name]


def test_webp_has_no_16_bits(repo: Repo) -> None:
    recipe = repo.recipe(source=CAMPFIRE, atlas={"format": "webp", "bits": 16})
    ran = repo.run("check", recipe)
    assert ran.code == 2 and "atlas.bits" in ran.err and "atlas.format to png" in ran.err

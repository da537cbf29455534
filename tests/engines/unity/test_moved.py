"""Pages that a user renames in Unity's editor, which moves their .meta too, stay what they are."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from fire_atlas.engines.unity import places
from fire_atlas.engines.unity.names import guids_in
from tests.support.repo import Repo

posix = pytest.mark.skipif(sys.platform == "win32", reason="symbolic links of POSIX")


@pytest.fixture
def repo(tmp_path: Path) -> Repo:
    repo = Repo(tmp_path / "game")
    repo.clip(count=4, height=48)
    return repo


def recipe(repo: Repo, **atlas: object) -> Path:
    maps = {} if "pixels" in atlas else {"flame": True}
    return repo.recipe(maps=maps, atlas=atlas, exports=["json", "unity"])


def move(repo: Repo, file: str, place: str) -> None:
    """Move a file as the editor does: with its .meta."""
    for ending in ("", ".meta"):
        (repo.build / place).parent.mkdir(exist_ok=True, parents=True)
        (repo.build / (file + ending)).rename(repo.build / (place + ending))


def files(repo: Repo) -> dict[str, bytes]:
    found = [path for path in repo.build.rglob("*") if path.is_file()]
    return {path.relative_to(repo.build).as_posix(): path.read_bytes() for path in found}


def pixels(file: Path) -> NDArray[np.uint8]:
    with Image.open(file) as image:
        return np.asarray(image)


def test_images_are_written_where_they_lie_and_nothing_else_changes(repo: Repo) -> None:
    repo.run("build", recipe(repo))
    before = files(repo)
    moved = {"fire.png": "art/fire_page.png", "fire.flame.png": "art/deep/flame.png"}
    for file, place in moved.items():
        move(repo, file, place)
    assert "fire.png is missing" in repo.run("build", recipe(repo), "--dry-run").out
    assert repo.run("build", recipe(repo), "--frozen").code == 1
    ran = repo.run("build", recipe(repo))
    assert ran.code == 0
    for file, place in moved.items():
        assert f"{file} lies at {place} now and is written there" in ran.out + ran.err
    after = files(repo)
    old = {place: file for file, place in moved.items()}
    old |= {f"{place}.meta": f"{file}.meta" for place, file in old.items()}
    same = {old.get(name, name): data for name, data in after.items()}
    assert same.keys() == before.keys()
    changed = {name for name, data in same.items() if data != before[name]}
    assert changed == {"fire.json", "fire.manifest.json"}
    meta = json.loads(after["fire.json"])["meta"]
    assert meta["image"] == "art/fire_page.png"
    assert meta["maps"][0]["image"] == "art/deep/flame.png"
    assert repo.run("build", recipe(repo)).is_up_to_date
    assert repo.run("build", recipe(repo), "--frozen").code == 0
    assert repo.run("inspect", repo.build / "fire.json").code == 0


def test_other_pixels_go_to_the_new_place_and_clean_removes_them(repo: Repo) -> None:
    repo.run("build", recipe(repo))
    move(repo, "fire.png", "art/page.png")
    before = files(repo)["art/page.png"]
    assert repo.run("build", recipe(repo, padding=9)).code == 0
    after = files(repo)
    assert after["art/page.png"] != before and "fire.png" not in after
    size = json.loads(after["fire.json"])["meta"]["size"]
    with Image.open(repo.build / "art/page.png") as page:
        assert page.size == (size["w"], size["h"])
    assert repo.run("clean", recipe(repo)).code == 0
    assert files(repo) == {}


def test_a_page_may_move_again_and_back(repo: Repo) -> None:
    repo.run("build", recipe(repo))
    first = files(repo)
    for old, new in [("fire.png", "a/x.png"), ("a/x.png", "y.png"), ("y.png", "fire.png")]:
        move(repo, old, new)
        assert repo.run("build", recipe(repo)).code == 0
        assert new in files(repo) and old not in files(repo)
    assert files(repo) == first


def test_pages_that_exchange_their_names_stay_apart(repo: Repo) -> None:
    pages = recipe(repo, max_size=64)
    repo.run("build", pages)
    guid = {
        name: guids_in(files(repo)[f"{name}.meta"].decode()) for name in ("fire.png", "fire-1.png")
    }
    move(repo, "fire.png", "z.png")
    move(repo, "fire-1.png", "fire.png")
    move(repo, "z.png", "fire-1.png")
    first = pixels(repo.build / "fire-1.png")
    assert repo.run("build", pages, "--force").code == 0
    assert guids_in(files(repo)["fire-1.png.meta"].decode()) == guid["fire.png"]
    assert json.loads(files(repo)["fire.json"])["meta"]["image"] == "fire-1.png"
    assert np.array_equal(pixels(repo.build / "fire-1.png"), first)


def test_two_files_of_one_guid_are_refused_and_nothing_is_written(repo: Repo) -> None:
    repo.run("build", recipe(repo))
    copy = repo.build / "copy"
    copy.mkdir()
    for name in ("fire.png", "fire.png.meta"):
        (copy / name).write_bytes((repo.build / name).read_bytes())
    before = files(repo)
    ran = repo.run("build", recipe(repo), "--force")
    assert ran.code == 1 and files(repo) == before
    assert str(repo.build.name) in ran.err and "copies" in ran.err
    assert "fire.png.meta" in ran.err and "copy/fire.png.meta" in ran.err.replace("\\", "/")


def test_a_page_that_was_painted_over_at_its_new_place_is_not_replaced(repo: Repo) -> None:
    repo.run("build", recipe(repo))
    move(repo, "fire.png", "art/page.png")
    (repo.build / "art/page.png").write_bytes(b"mine")
    before = files(repo)
    ran = repo.run("build", recipe(repo))
    assert ran.code == 1 and files(repo) == before and "--overwrite" in ran.err


def test_a_meta_with_a_guid_of_its_own_keeps_the_page_where_it_is(repo: Repo) -> None:
    repo.run("build", recipe(repo))
    move(repo, "fire.png", "kept/mine.png")
    meta = (repo.build / "kept/mine.png.meta").read_text()
    (repo.build / "fire.png.meta").write_text(meta.replace(guids_in(meta)[0], "0" * 31 + "1"))
    before = files(repo)["kept/mine.png"]
    assert repo.run("build", recipe(repo)).code == 0
    assert "fire.png" in files(repo) and files(repo)["kept/mine.png"] == before


@pytest.mark.parametrize("place", ["page.cs", "x.manifest.json"])
def test_a_guid_on_a_file_of_another_kind_is_refused(repo: Repo, place: str) -> None:
    repo.run("build", recipe(repo))
    move(repo, "fire.png", place)
    before = files(repo)
    ran = repo.run("build", recipe(repo))
    assert ran.code == 1 and files(repo) == before and "another name" in ran.err


@pytest.mark.parametrize("folder", [".hidden", "Samples~"])
def test_folders_that_unity_does_not_show_are_not_searched(repo: Repo, folder: str) -> None:
    repo.run("build", recipe(repo))
    move(repo, "fire.png", f"{folder}/page.png")
    assert repo.run("build", recipe(repo)).code == 0
    assert "fire.png" in files(repo)


@posix
def test_links_are_not_followed_to_search_or_to_remove(repo: Repo) -> None:
    repo.run("build", recipe(repo))
    move(repo, "fire.png", "art/page.png")
    repo.run("build", recipe(repo))
    outside = repo.folder / "outside"
    (repo.build / "art").rename(outside)
    (repo.build / "art").symlink_to(outside)
    before = (outside / "page.png").read_bytes()
    repo.run("clean", recipe(repo))
    assert (outside / "page.png").read_bytes() == before
    assert repo.run("build", recipe(repo, padding=9)).code == 0
    assert (repo.build / "fire.png").is_file()
    assert (outside / "page.png").read_bytes() == before


def test_a_folder_of_too_many_names_is_refused(repo: Repo, monkeypatch: pytest.MonkeyPatch) -> None:
    repo.run("build", recipe(repo))
    monkeypatch.setattr(places, "MAX_NAMES", 5)
    ran = repo.run("build", recipe(repo), "--force")
    assert ran.code == 1 and "more than 5 names" in ran.err


def test_a_cache_answers_no_build_whose_page_was_moved(repo: Repo) -> None:
    cache = ("--cache", repo.folder / "cache", "--verbose")
    repo.run("build", recipe(repo), *cache)
    move(repo, "fire.png", "art/page.png")
    ran = repo.run("build", recipe(repo), *cache)
    assert ran.code == 0 and "fire.png lies at art/page.png now" in ran.out + ran.err
    assert "art/page.png" in files(repo) and "fire.png" not in files(repo)


def test_the_ramp_of_heat_moves_too(repo: Repo) -> None:
    heat = recipe(repo, pixels="heat")
    ran = repo.run("build", heat)
    assert ran.code == 0, ran.err
    move(repo, "fire.ramp.png", "ramps/fire.png")
    assert repo.run("build", heat).code == 0
    about = json.loads(files(repo)["fire.json"])["meta"]["fireAtlas"]
    assert about["heat"]["ramp"] == "ramps/fire.png" and "fire.ramp.png" not in files(repo)

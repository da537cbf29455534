"""Several sets of flakes over one flame, ``flakes.variants``: tracks alone, of the same fire."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from fire_atlas.cli import main
from fire_atlas.core.chance import RandomStream, seed_of
from fire_atlas.core.shipped import shipped
from fire_atlas.effect.flakes.tracks import Tracks
from fire_atlas.formats.atlas.texture_packer import read_atlas
from fire_atlas.formats.tracks.tracks_json import read_tracks
from fire_atlas.recipe.effect import MAX_VARIANTS
from tests.support.repo import contents
from tests.support.wind import SILK

CLIP: dict[str, Any] = {
    "source": {
        "path": str(shipped("samples") / "campfire"), "fps": 24, "count": 10, "height": 80,
    },
    "flakes": {"bake": False, "rate": 60, "variants": 3},
    "exports": ["json"],
}  # fmt: skip

DEEP: dict[str, Any] = {**SILK, **CLIP, "source": SILK["source"], "wind": {},
                        "timeline": {"frames": 12, "fps": 12}}  # fmt: skip


def built(folder: Path, recipe: dict[str, Any], name: str = "fire") -> Path:
    """Build a recipe; return the folder of its outputs."""
    folder.mkdir(exist_ok=True)
    (folder / f"{name}.yaml").write_text(json.dumps(recipe))
    assert main(["build", "-q", "--jobs", "2", str(folder / f"{name}.yaml")]) == 0
    return folder / "build"


def with_flakes(recipe: dict[str, Any], **keys: Any) -> dict[str, Any]:
    return {**recipe, "flakes": {**recipe["flakes"], **keys}}


def read(path: Path) -> Tracks:
    tracks = read_tracks(path)
    assert tracks is not None, path
    return tracks


def rows_of(path: Path) -> str:
    """Return the text of tracks without their head, which has their name."""
    return path.read_text().split("\n", 1)[1]


def births(path: Path) -> set[tuple[float, float]]:
    return {(x, y) for x, y in read(path).spawns[:, 3:5].tolist()}


def test_the_flame_is_drawn_once_and_the_first_set_is_that_of_a_recipe_without(
    tmp_path: Path,
) -> None:
    several = built(tmp_path / "several", CLIP)
    alone = built(tmp_path / "alone", with_flakes(CLIP, variants=1))
    for file in ("fire.png", "fire.json", "fire.flakes.json"):
        assert (several / file).read_bytes() == (alone / file).read_bytes()
    names = {path.name for path in several.iterdir()} - {path.name for path in alone.iterdir()}
    assert names == {"fire.v1.flakes.json", "fire.v2.flakes.json"}


def test_the_figures_are_those_of_all_sets(tmp_path: Path) -> None:
    folder = built(tmp_path / "several", CLIP)
    figures = json.loads((folder / "fire.manifest.json").read_text())["statistics"]["flakes"]
    sets = [read(path) for path in folder.glob("*.flakes.json")]
    alive = [len(rows) for tracks in sets for rows in tracks.frames]
    assert figures["sets"] == 3
    assert figures["born"] == sum(len(tracks.spawns) for tracks in sets)
    assert figures["alive_mean"] == round(float(np.mean(alive)), 2)
    assert figures["alive_most"] == max(alive)


def test_engines_know_how_many_sets_there_may_be(tmp_path: Path) -> None:
    folder = built(tmp_path, {**CLIP, "exports": ["godot", "unity"]})
    range_of_sets = f"(-1, {MAX_VARIANTS - 1})"
    texts = [path.read_text() for path in folder.rglob("*") if path.suffix in (".gd", ".cs")]
    assert any(f"@export_range{range_of_sets} var flake_set" in text for text in texts)
    assert any(f"Range(-1, {MAX_VARIANTS - 1}), Tooltip(" in text for text in texts)
    assert any(f"randi() % {MAX_VARIANTS}" in text for text in texts)
    assert any(f"Range(0, {MAX_VARIANTS})" in text for text in texts)


def test_another_set_has_the_flakes_of_the_fire_with_another_seed(tmp_path: Path) -> None:
    """A clip is the same flame whatever the seed."""
    several = built(tmp_path / "several", {**CLIP, "seed": 5})
    other = seed_of(5, RandomStream.FLAKE_SETS, 2)
    alone = built(tmp_path / "alone", {**with_flakes(CLIP, variants=1), "seed": other})
    assert (several / "fire.png").read_bytes() == (alone / "fire.png").read_bytes()
    assert rows_of(several / "fire.v2.flakes.json") == rows_of(alone / "fire.flakes.json")
    sets = [births(path) for path in several.glob("*.flakes.json")]
    assert len(sets) == 3 and all(len(each) > 10 for each in sets)
    assert not set.intersection(*sets)


MAIN = "burn", "extinguish"

FORMATS = ["json", "csv", "pcache", "hjson"]


@pytest.mark.parametrize(
    ("keys", "names"),
    [
        ({"views": {"count": 2}}, ["view_0", "view_1"]),
        ({"composite": {"ramp": ["gas", "soul"]}}, ["gas", "soul"]),
        ({"wind": {"levels": [0, 4]}}, ["wind_0", "wind_1", "wind_0_1", "wind_1_0"]),
        ({"phases": {"ignite": 0.5, "extinguish": 0.5}}, ["burn", "ignite", "extinguish"]),
        ({"timeline": {"frames": 12, "fps": 12, "loop": "none"}}, [""]),
        ({"tracks": [*FORMATS, "light"], "exports": ["json", "godot", "unity"]}, [""]),
        ({"maps": {"motion": "godot", "flame": True, "haze": True}, "movies": ["webp"]}, [""]),
        ({"atlas": {"pixels": "heat"}}, [""]),
    ],
    ids=str,
)
def test_every_animation_has_as_many_sets(
    keys: dict[str, Any], names: list[str], tmp_path: Path
) -> None:
    build = built(tmp_path, {**DEEP, **keys})
    for name in names:
        stem = f"fire.{name}".rstrip(".")
        sets = [f"{stem}{number}.flakes" for number in ("", ".v1", ".v2")]
        for ending in keys.get("tracks", ["json"])[:4]:
            files = [build / f"{each}.{ending}" for each in sets]
            assert len({file.read_bytes() for file in files}) == 3, (stem, ending)
        found = [read(build / f"{each}.json") for each in sets]
        shapes = {(t.fps, len(t.frames), t.rounds, t.loop, t.camera) for t in found}
        assert len(shapes) == 1 and all(sum(map(len, t.frames)) for t in found)
    if "csv" in keys.get("tracks", []):
        assert (build / "fire.v2.flakes.csv.import").read_text()  # else Godot would take it amiss
    assert main(["build", "-q", str(tmp_path / "fire.yaml"), "--dry-run"]) == 0
    assert main(["clean", "-q", str(tmp_path / "fire.yaml")]) == 0
    assert not list(build.glob("fire*"))


def test_flakes_of_each_set_fly_on_where_the_fire_changes(tmp_path: Path) -> None:
    """In the first frame of what goes out are the flakes of the frame before, of the same set."""
    build = built(tmp_path, {**DEEP, "phases": {"extinguish": 0.5}})
    graph = read_atlas(build / "fire.json").sheet.states
    assert graph is not None
    (main_way,) = (way for way in graph.transitions if (way.before, way.after) == MAIN)
    for number in ("", ".v1", ".v2"):
        loop = read(build / f"fire.burn{number}.flakes.json")
        after = read(build / f"fire.extinguish{number}.flakes.json")
        wanted = loop.frames[(main_way.frame + 1) % len(loop.frames)][:, 1:3]
        assert len(after.frames[0])
        for place in after.frames[0][:, 1:3]:
            assert np.abs(wanted - place).sum(axis=1).min() < 0.01


def test_a_tail_lasts_until_the_flakes_of_all_sets_are_gone(tmp_path: Path) -> None:
    keys = {**CLIP, "timeline": {"loop": "none", "tail": True}}
    build = built(tmp_path, keys)
    counts = {len(read(path).frames) for path in build.glob("*.flakes.json")}
    shown = len(json.loads((build / "fire.json").read_text())["frames"])
    assert counts == {shown}
    other = seed_of(0, RandomStream.FLAKE_SETS, 1)
    lengths = []
    for seed in (0, other, seed_of(0, RandomStream.FLAKE_SETS, 2)):
        alone = built(tmp_path / str(seed), {**with_flakes(keys, variants=1), "seed": seed})
        lengths.append(len(read(alone / "fire.flakes.json").frames))
    assert len({*lengths}) > 1 and max(lengths) == shown


def test_textures_and_members(tmp_path: Path) -> None:
    Image.new("RGBA", (8, 4), (255, 255, 255, 255)).save(tmp_path / "flake.png")
    (tmp_path / "torch.yaml").write_text(json.dumps(with_flakes(CLIP, texture="flake.png")))
    (tmp_path / "stove.yaml").write_text(json.dumps({**CLIP, "flakes": {"rate": 60}}))
    build = built(tmp_path, {"atlas": {"members": ["torch.yaml", "stove.yaml"]}}, "street")
    assert {path.name for path in build.glob("*.flakes.json")} == {
        "street.torch.flakes.json", "street.torch.v1.flakes.json", "street.torch.v2.flakes.json",
        "street.stove.flakes.json",
    }  # fmt: skip
    tracks = read(build / "street.torch.v2.flakes.json")
    assert tracks.texture is not None
    assert {*tracks.texture.frames} <= {*json.loads((build / "street.json").read_text())["frames"]}


def test_any_number_of_workers_gives_the_same_bytes(tmp_path: Path) -> None:
    build = built(tmp_path, DEEP)
    first = contents(build)
    assert main(["build", "-q", "--jobs", "1", "--force", str(tmp_path / "fire.yaml")]) == 0
    assert contents(build) == first


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"variants": 2}, "each of variants is a fire with flakes of its own already"),
        ({"flakes": {"variants": 2}}, "the pages show flakes already, of one set"),
        ({"maps": {"flakes": True}}, "but maps.flakes draws one set"),
        ({"tracks": ["light"]}, "this recipe writes neither"),
        ({"tracks": [], "exports": ["json", "css"]}, "this recipe writes neither"),
        ({"tracks": [], "exports": [{"unity": {"flakes": False}}]}, "this recipe writes neither"),
        ({"fit": {"memory": 1}}, "flakes.bake: false leaves the flakes to their tracks"),
    ],
    ids=str,
)
def test_what_sets_of_flakes_cannot_be_is_refused_with_its_line(
    keys: dict[str, Any], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "fire.yaml"
    path.write_text(json.dumps({**CLIP, **keys}))
    assert main(["check", "-q", str(path)]) == 2
    text = " ".join(capsys.readouterr().err.split())
    assert "fire.yaml:1: flakes." in text
    assert said in text

"""Several fires of one recipe: their names, and that no two of them show the same drawing."""

import json
import re
import shutil
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from fire_atlas.cli import main
from fire_atlas.core.chance import RandomStream, seed_of
from fire_atlas.core.shipped import shipped
from fire_atlas.formats.atlas.texture_packer import read_atlas
from fire_atlas.formats.tracks.tracks_json import read_all_tracks
from fire_atlas.preview.cut_frames import cut_frames
from tests.support.variants import pairs_of
from tests.support.wind import SILK

SMALL: dict[str, Any] = {
    **SILK, "wind": {}, "timeline": {"frames": 12, "fps": 12}, "exports": ["json"], "variants": 3,
}  # fmt: skip

CANDLE = {"path": str(shipped("samples") / "candle"), "fps": 24}


def built(folder: Path, name: str = "fire", **recipe: Any) -> Path:
    """Build a recipe; return its JSON."""
    (folder / f"{name}.yaml").write_text(json.dumps(recipe))
    assert main(["build", "-q", "--jobs", "2", str(folder / f"{name}.yaml")]) == 0
    return folder / "build" / f"{name}.json"


def refused(folder: Path, capsys: pytest.CaptureFixture[str], **recipe: Any) -> str:
    path = folder / "fire.yaml"
    path.write_text("\n".join(f"{key}: {json.dumps(value)}" for key, value in recipe.items()))
    assert main(["build", "-q", str(path)]) in (1, 2)
    return capsys.readouterr().err


def moving(folder: Path, count: int, every: int = 10_000) -> dict[str, Any]:
    """A clip of drawings that never repeat, or repeat after ``every`` frames."""
    folder.mkdir()
    for i in range(count):
        lit = np.random.default_rng(i % every).random((8, 6)) < 0.5
        pixels = np.zeros((48, 40, 4), np.uint8)
        pixels[4:44, 5:35] = np.kron(lit[..., None], np.ones((5, 5, 1), np.uint8)) * (
            255,
            160,
            40,
            255,
        )
        Image.fromarray(pixels).save(folder / f"{i:03}.png")
    return {"path": str(folder), "fps": 12}


def test_the_first_variant_is_the_fire_of_a_recipe_without(tmp_path: Path) -> None:
    several = read_atlas(built(tmp_path, **{**SMALL, "flakes": "none", "seed": 7}))
    alone = read_atlas(
        built(tmp_path, "alone", **{**SMALL, "flakes": "none", "seed": 7, "variants": 1})
    )
    frames = list(cut_frames(several))
    assert [a.name for a in several.sheet.animations] == ["v0", "v1", "v2"]
    assert [a.variant for a in several.sheet.animations] == [0, 1, 2]
    for one, other in zip(frames[:12], cut_frames(alone), strict=True):
        np.testing.assert_array_equal(one, other)
    other_seed = seed_of(7, RandomStream.VARIANTS, 2)
    third = read_atlas(
        built(tmp_path, "third", **{**SMALL, "flakes": "none", "seed": other_seed, "variants": 1})
    )
    seeds = {seed_of(s, RandomStream.VARIANTS, k) for s, k in product(range(50), range(16))}
    assert len(seeds) == 50 * 16
    for one, other in zip(frames[24:], cut_frames(third), strict=True):
        np.testing.assert_array_equal(one, other)


def test_the_class_of_the_first_fire_decides_for_all(tmp_path: Path) -> None:
    path = built(tmp_path, **SMALL, tracks=["json"])
    found = json.loads(path.with_suffix(".manifest.json").read_text())["statistics"]["animations"]
    flakes = [figures["flakes"] for figures in found.values()]
    assert len({(each["class"], each["style"]) for each in flakes}) == 1
    seeds = [tracks.seed for tracks in read_all_tracks(read_atlas(path)).values()]
    assert seeds == [seed_of(0, RandomStream.VARIANTS, number) for number in range(3)]


@pytest.mark.parametrize(
    ("keys", "names"),
    [
        ({"views": {"count": 2}}, ["view_0", "view_1"]),
        ({"composite": {"ramp": ["gas", "soul"]}}, ["gas", "soul"]),
        ({"composite": {"ramp": ["gas", "soul"]}, "views": {"count": 2}},
         ["gas/view_0", "gas/view_1", "soul/view_0", "soul/view_1"]),
        ({"wind": {"levels": [0, 4]}}, ["wind_0", "wind_1", "wind_0_1", "wind_1_0"]),
        ({"timeline": {"frames": 12, "fps": 12, "loop": "none"}}, [""]),
        ({"atlas": {"scales": [1, 0.5]}, "maps": {"motion": "godot", "flame": True, "haze": True}},
         [""]),
        ({"atlas": {"pixels": "heat4"}}, [""]),
        ({"movies": ["webp"], "exports": ["json", "json-array", "phaser", "css", "tpsheet"]}, [""]),
    ],
)  # fmt: skip
def test_names_of_all_that_variants_combine_with(
    keys: dict[str, Any], names: list[str], tmp_path: Path
) -> None:
    path = built(tmp_path, **{**SMALL, "variants": 2, **keys})
    wanted = [f"v{k}/{name}".rstrip("/") for k in range(2) for name in names]
    atlas = read_atlas(path)
    assert [each.name for each in atlas.sheet.animations] == wanted
    stated = json.loads(path.read_text())["meta"]["fireAtlas"]["variants"]
    assert stated == {name: int(name[1]) for name in wanted}
    loops = keys.get("timeline", {}).get("loop") != "none"
    assert all(each.loop == (loops and "_0_" not in each.name and "_1_" not in each.name)
               for each in atlas.sheet.animations)  # fmt: skip
    tracks = read_all_tracks(atlas)
    assert list(tracks) == wanted
    statistics = json.loads(path.with_suffix(".manifest.json").read_text())["statistics"]
    assert list(statistics["animations"]) == wanted
    for movie in keys.get("movies", []):
        assert {p.name for p in path.parent.glob(f"*.{movie}")} == {
            f"fire.{name}.{movie}" for name in wanted
        }
    pairs = list(pairs_of(path))
    assert len(pairs) == 2 * len(names)
    assert all(pair.distance > 0.25 for pair in pairs)


def test_a_fire_with_phases_has_a_graph_for_each_variant(tmp_path: Path) -> None:
    path = built(tmp_path, **SMALL, phases={"ignite": 0.5, "extinguish": 0.5})
    atlas = read_atlas(path)
    assert atlas.sheet.states is not None
    graphs = atlas.sheet.states.of_each_variant()
    assert len(graphs) == 3
    for number, graph in enumerate(graphs):
        assert graph.of_phase("burn") == (f"v{number}/burn",)
        names = {state.animation for state in graph.states}
        assert all(name.startswith(f"v{number}/") for name in names)
        assert {step.before for step in graph.transitions} <= names
        assert {step.after for step in graph.transitions} <= names
    statistics = json.loads(path.with_suffix(".manifest.json").read_text())["statistics"]
    assert list(statistics["phases"]) == ["v0", "v1", "v2"]


def test_members_keep_their_names_before_those_of_variants(tmp_path: Path) -> None:
    for name in ("torch", "brazier"):
        keys = {**SMALL, "variants": 2 if name == "torch" else 1}
        (tmp_path / f"{name}.yaml").write_text(json.dumps(keys))
    path = built(tmp_path, "street", atlas={"members": ["torch.yaml", "brazier.yaml"]},
                 exports=["json"])  # fmt: skip
    animations = read_atlas(path).sheet.animations
    assert {a.name: a.variant for a in animations} == {
        "torch/v0": 0, "torch/v1": 1, "brazier": None,
    }  # fmt: skip
    assert [a.stem for a in animations] == ["torch/v0", "torch/v1", ""]


@pytest.mark.parametrize("loop", ["auto", "crossfade", "pingpong"])
def test_a_clip_is_cut_into_loops_half_a_second_apart(loop: str, tmp_path: Path) -> None:
    """Frames of such a clip stay as they are but in cross-fades: they tell where they are from."""
    source = moving(tmp_path / "clip", 80)
    path = built(tmp_path, source=source, variants=3, timeline={"loop": loop}, flakes="none",
                 motion_blur="none", exports=["json"], atlas={"dedupe": False})  # fmt: skip
    atlas = read_atlas(path)
    clip = [np.array(Image.open(p)) for p in sorted((tmp_path / "clip").glob("*.png"))]
    numbers: dict[str, list[int]] = {each.name: [] for each in atlas.sheet.animations}
    frames = cut_frames(atlas)
    for animation in atlas.sheet.animations:
        assert animation.loop
        for _ in animation.frames:
            shown = next(frames)
            same = [i for i, frame in enumerate(clip) if (frame == shown).all()]
            numbers[animation.name] += same
    assert list(numbers) == ["v0", "v1", "v2"] and all(len(n) > 6 for n in numbers.values())
    for one, other in (("v0", "v1"), ("v1", "v2"), ("v0", "v2")):
        assert min(numbers[other]) - max(numbers[one]) > 6
    assert all(pair.distance > 0.25 for pair in pairs_of(path))


def test_cuts_of_a_clip_are_lit_and_put_out(tmp_path: Path) -> None:
    source = moving(tmp_path / "clip", 60)
    path = built(tmp_path, source=source, variants=2, timeline={"loop": "crossfade"},
                 flakes="none", phases={"ignite": 0.5, "extinguish": 0.5},
                 exports=["json"])  # fmt: skip
    names = [each.name for each in read_atlas(path).sheet.animations]
    assert {"v0/burn", "v0/ignite", "v0/extinguish", "v1/burn"} <= {*names}


def test_a_clip_that_is_too_short_names_the_largest_number(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = moving(tmp_path / "clip", 80)
    said = refused(tmp_path, capsys, source=source, variants=5)
    assert "fire.yaml:2: variants: " in said and "the clip has 80" in said
    assert "the largest number is 4" in said
    built(tmp_path, source=source, variants=4, timeline={"loop": "crossfade"}, flakes="none")
    shutil.rmtree(tmp_path / "clip")
    said = refused(tmp_path, capsys, source=moving(tmp_path / "clip", 20), variants=2)
    assert "it is enough for one; remove variants, or use a longer clip" in said


def test_a_clip_that_shows_its_drawings_again_has_fewer_variants(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = moving(tmp_path / "clip", 80, every=40)
    said = refused(tmp_path, capsys, source=source, variants=3, flakes="none")
    assert "it shows drawings again: it is enough for one" in said


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"source": CANDLE, "timeline": {"loop": "none"}}, "loop: none of the timeline"),
        ({"source": {"kind": "sprites", "path": str(shipped("samples") / "candle")}},
         "are of fire, but sprites are only packed"),
        ({"source": {"path": str(shipped("samples") / "explosion"), "fps": 8}},
         "are cuts of a clip that burns on, but the fire"),
        ({"source": {"path": str(shipped("samples") / "pixel_flame.png")}}, "it is enough for one"),
    ],
)  # fmt: skip
def test_what_variants_cannot_be_is_refused_with_its_line(
    keys: dict[str, Any], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = refused(tmp_path, capsys, **keys, variants=2)
    assert f"fire.yaml:{len(keys) + 1}: variants: " in text
    assert said in text


def test_members_alone_have_no_variants(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "torch.yaml").write_text(json.dumps(SMALL))
    text = refused(tmp_path, capsys, atlas={"members": ["torch.yaml"]}, variants=2)
    assert "fire.yaml:2: variants: are of a recipe's own fire" in text


def test_what_is_learnt_of_a_short_clip_has_as_many_variants_as_differ(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = {"kind": "profile", "path": CANDLE["path"], "fps": 24, "height": 64}
    keys: dict[str, Any] = {
        "source": source, "timeline": {"frames": 24}, "flakes": "none", "variants": 16,
    }  # fmt: skip
    text = refused(tmp_path, capsys, **keys)
    assert "fire.yaml:4: variants: " in text and "shows a drawing of v" in text
    if number := re.search(r"the largest number is (\d+)", text):
        path = built(tmp_path, **{**keys, "variants": int(number[1])}, exports=["json"])
        assert all(pair.distance > 0.2 for pair in pairs_of(path))
    else:
        assert "it is enough for one" in text

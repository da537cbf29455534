"""The assets are what the editor itself would have written: every key, every reference."""

import re
from dataclasses import replace
from typing import Any

import pytest
import yaml
from unityparser import UnityDocument

from fire_atlas.engines.unity.names import player_name
from fire_atlas.engines.unity.sprites import max_texture_size
from tests.engines.unity.products import ALONE, SEVERAL, Fire, exported, kinds
from tests.engines.unity.type_trees import Loader, documents, faults, importer
from tests.support.sheets import product_of, sheet_with_meshes, sparks_and_others

YAML_ENDINGS = (".anim", ".controller", ".prefab", ".mat", ".meta")

BUILT_IN = "0000000000000000f000000000000000"

MAIN_ID = {".cs": 11500000, ".shader": 4800000, ".bytes": 4900000, ".mat": 2100000,
           ".anim": 7400000, ".controller": 9100000}  # fmt: skip


def guids(files: dict[str, bytes]) -> dict[str, str]:
    """File of each GUID."""
    found: dict[str, str] = {}
    for name, data in files.items():
        if name.endswith(".meta"):
            guid = yaml.load(data, Loader)["guid"]
            assert re.fullmatch("[0-9a-f]{32}", guid)
            assert guid not in found, f"{name} and {found[guid]} share a GUID"
            found[guid] = name.removesuffix(".meta")
    return found


def sprite_ids(meta: bytes) -> dict[str, int]:
    """Id of each sprite of a page, after the three tables of it agree."""
    _, fields = importer(meta.decode())
    sprites = {s["name"]: s["internalID"] for s in fields["spriteSheet"]["sprites"]}
    assert sprites == fields["spriteSheet"]["nameFileIdTable"]
    stated = {entry["second"]: entry["first"][213] for entry in fields["internalIDToNameTable"]}
    assert sprites == stated
    assert len(set(sprites.values())) == len(sprites) and 0 not in sprites.values()
    return sprites


@pytest.mark.parametrize(("fire", "atlas"), kinds())
def test_the_editors_type_trees_know_every_key(fire: Fire, atlas: dict[str, Any]) -> None:
    files = exported(fire.product(**atlas), assembly=True, namespace="Game.Fire")
    checked = {name: data for name, data in files.items() if name.endswith(YAML_ENDINGS)}
    assert len(checked) > len(files) / 2
    assert [f for name, data in checked.items() for f in faults(name, data.decode())] == []


@pytest.mark.parametrize(("fire", "atlas"), kinds())
def test_every_reference_finds_what_it_means(fire: Fire, atlas: dict[str, Any]) -> None:
    product = fire.product(**atlas)
    files = exported(product)
    pages = {page.file for sheet in product.sheets for page in sheet.pages}
    files_of = guids(files)
    assert set(files_of.values()) == {n for n in files if not n.endswith(".meta")} | pages
    reference = re.compile(r"\{fileID: (-?\d+)(?:, guid: (\w+), type: (\d))?\}")
    for name, data in files.items():
        if not name.endswith(YAML_ENDINGS) or name.endswith(".meta"):
            continue
        own = {file_id for _, file_id, _ in documents(data.decode())}
        for number, guid, kind in reference.findall(data.decode()):
            if guid == BUILT_IN:
                continue
            if not guid:
                assert int(number) in own | {0}, (name, number)
                continue
            target = files_of[guid]
            if target in pages:
                assert int(number) in sprite_ids(files[f"{target}.meta"]).values()
            else:
                assert int(number) == MAIN_ID[target[target.rindex(".") :]]
            assert int(kind) == (2 if target.endswith((".mat", ".anim", ".controller")) else 3)


@pytest.mark.parametrize(("fire", "atlas"), kinds())
def test_another_parser_reads_and_writes_the_same(
    fire: Fire, atlas: dict[str, Any], tmp_path: Any
) -> None:
    for name, data in exported(fire.product(**atlas)).items():
        if not name.endswith(YAML_ENDINGS):
            continue
        path = tmp_path / f"{name}.yaml"
        path.write_bytes(data)
        UnityDocument.load_yaml(path).dump_yaml()
        assert _unwrapped(path.read_text()) == _unwrapped(data.decode()), name


def _unwrapped(text: str) -> list[str]:
    """Lines without line wrapping and blanks at the end."""
    joined = re.sub(r"(\{[^{}]*?)\n +", r"\1 ", text)
    return [line.rstrip() for line in joined.splitlines()]


@pytest.mark.parametrize(("fire", "atlas"), kinds())
def test_clips_play_every_frame_for_its_time(fire: Fire, atlas: dict[str, Any]) -> None:
    product = fire.product(**atlas)
    files = exported(product)
    for sheet in product.sheets:
        ids: dict[int, str] = {}
        for page in sheet.pages:
            meta = files[f"{page.file}.meta"]
            ids |= {number: name for name, number in sprite_ids(meta).items()}
        clips = [n for n in files if n.startswith(f"{sheet.name}.") and n.endswith(".anim")]
        assert len(clips) == len(sheet.animations)
        for animation, name in zip(sheet.animations, clips, strict=True):
            ((_, _, clip),) = documents(files[name].decode())
            (curve,) = clip["m_PPtrCurves"]
            fps = 1000 / next(r.duration for r in sheet.regions if r.name == animation.frames[0])
            assert [ids[key["value"]["fileID"]] for key in curve["curve"]] == [
                re.sub("[/;]", lambda m: "_" if m[0] == "/" else m[0], frame)
                for frame in animation.frames
            ]
            times = [key["time"] for key in curve["curve"]]
            assert times == pytest.approx([i / fps for i in range(len(times))], abs=1e-6)
            assert clip["m_SampleRate"] == pytest.approx(fps)
            settings = clip["m_AnimationClipSettings"]
            # The engine takes a clip to end one sample after its last key.
            assert settings["m_StopTime"] == pytest.approx(times[-1] + 1 / clip["m_SampleRate"])
            assert settings["m_LoopTime"] == int(animation.loop)


def test_the_controller_begins_with_the_first_animation() -> None:
    files = exported(SEVERAL.product())
    objects = {i: (c, fields) for c, i, fields in documents(files["hero.controller"].decode())}
    states = {i: f["m_Name"] for i, (c, f) in objects.items() if c == 1102}
    assert list(states.values()) == ["walk", "run", "火 ; # 1"]
    machine = objects[110700000][1]
    assert states[machine["m_DefaultState"]["fileID"]] == "walk"
    assert [child["m_State"]["fileID"] for child in machine["m_ChildStates"]] == list(states)


@pytest.mark.parametrize(
    ("alpha", "fixes_border"), [("straight", 1), ("premultiplied", 0), ("additive", 0)]
)
def test_only_straight_alpha_lets_the_importer_touch_colours(alpha: str, fixes_border: int) -> None:
    files = exported(ALONE.product(alpha=alpha))
    _, meta = importer(files["fire.png.meta"].decode())
    assert meta["alphaIsTransparency"] == fixes_border
    assert meta["mipmaps"]["sRGBTexture"] == 1
    assert ("fire.mat" in files) == (alpha != "straight")
    built_in = f"guid: {BUILT_IN}".encode() in files["fire.prefab"]
    assert built_in == (alpha == "straight")


def test_no_import_limit_shrinks_a_page() -> None:
    for side, limit in ((300, 2048), (2048, 2048), (2049, 4096), (4097, 8192)):
        assert max_texture_size(side, 17) == max_texture_size(17, side) == limit


def test_every_scale_is_as_large_in_the_scene() -> None:
    product = ALONE.product(scales=[1, 0.5], trim="none")
    files = exported(product, pixels_per_unit=40)
    for sheet in product.sheets:
        _, meta = importer(files[f"{sheet.pages[0].file}.meta"].decode())
        assert meta["spritePixelsToUnits"] == 40 * sheet.scale
        components = [(c, f) for c, _, f in documents(files[f"{sheet.name}.prefab"].decode())]
        assert dict(components)[212]["m_Size"] == {"x": 1.5, "y": 1.5}
        (player,) = (f for c, f in components if c == 114 and "tracks" in f)
        assert player["pixelsPerUnit"] == 40


@pytest.mark.parametrize(
    ("fire", "options", "enabled"),
    [
        (Fire({"fire": 3}), {}, 1),
        (Fire({"fire": 3}, baked=True), {}, 0),
        (Fire({"fire": 3}, tracks=False), {}, None),
        (Fire({"fire": 3}), {"flakes": False}, None),
    ],
)
def test_flakes_are_shown_once(fire: Fire, options: dict[str, Any], enabled: int | None) -> None:
    files = exported(fire.product(), **options)
    scripts = [f for c, _, f in documents(files["fire.prefab"].decode()) if c == 114]
    players = [fields for fields in scripts if "tracks" in fields]
    assert [player["m_Enabled"] for player in players] == ([] if enabled is None else [enabled])
    assert ("fire_flakes.cs" in files) == ("fire.flakes.bytes" in files) == (enabled is not None)


def test_two_effects_in_one_project_share_nothing() -> None:
    names = ["fire", "my-fire", "my_fire", "my.fire", "2fire", "_2fire", "fire_flakes", "x" * 100]
    files: dict[str, bytes] = {}
    for name in names:
        made = exported(Fire({name: 2}, name=name).product(alpha="premultiplied"))
        assert not made.keys() & files.keys()
        files |= made
    guids(files)
    scripts = {n: d.decode() for n, d in files.items() if n.endswith(".cs")}
    stated = re.compile(r"public sealed class (\w+) : MonoBehaviour")
    classes = {stated.findall(script)[0] for script in scripts.values()}
    assert classes == {name.removesuffix(".cs") for name in scripts}
    assert len({c.casefold() for c in classes}) == 2 * len(names)
    assert len(names) == len(set(map(player_name, names)))
    shaders = {
        d.split(b'Shader "')[1].split(b'"')[0] for n, d in files.items() if n.endswith(".shader")
    }
    assert len(shaders) == 2 * len(names)


def test_one_name_twice_in_a_project_takes_two_namespaces() -> None:
    forest = exported(ALONE.product(alpha="premultiplied"), namespace="Forest")
    desert = exported(ALONE.product(alpha="premultiplied"), namespace="Desert")
    assert not guids(forest).keys() & guids(desert).keys()
    assert b"namespace Forest" in forest["fire_flakes.cs"]
    assert b'Shader "Desert/fire/Sprite"' in desert["fire.shader"]


def test_outlines_are_the_meshes_in_units_of_the_sprite_editor() -> None:
    sheet = sheet_with_meshes(sparks_and_others())
    lying = exported(product_of(sheet_with_meshes(sparks_and_others())))["fire.png.meta"]
    was_full = lying.replace(b"spriteMeshType: 1", b"spriteMeshType: 0")
    product = replace(product_of(sheet), existing={"fire.png.meta": was_full}.get)
    meta = exported(product)["fire.png.meta"].decode()
    assert faults("fire.png.meta", meta) == []
    _, fields = importer(meta)
    assert fields["spriteMeshType"] == 1
    sprites = {sprite["name"]: sprite for sprite in fields["spriteSheet"]["sprites"]}
    for region in sheet.regions:
        sprite = sprites[region.name.replace("/", "_")]
        (outline,) = sprite["outline"]
        assert region.mesh is not None
        # From the middle of the rect, y up, to the trimmed frame's top-left corner, y down.
        rect = sprite["rect"]
        back = [(p["x"] + rect["width"] / 2, rect["height"] / 2 - p["y"]) for p in outline]
        assert back == list(region.mesh.vertices)

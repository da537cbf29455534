"""What the editor and people wrote into a .meta stays; what a rebuild must not change does not."""

import re
from typing import Any

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from fire_atlas.core.errors import OutputError
from fire_atlas.engines.unity.meta import TEXTURE_KEYS, merged
from fire_atlas.engines.unity.names import guids_in
from tests.engines.unity.products import ALONE, SEVERAL, Fire, exported
from tests.engines.unity.type_trees import Loader, faults, importer

GUID = "0123456789abcdef0123456789abcdef"

ANDROID = """\
  - serializedVersion: 3
    buildTarget: Android
    maxTextureSize: 512
    resizeAlgorithm: 0
    textureFormat: 50
    textureCompression: 1
    compressionQuality: 50
    crunchedCompression: 0
    allowsAlphaSplitting: 0
    overridden: 1
    androidETC2FallbackOverride: 0
    forceMaximumCompressionQuality_BC6H_BC7: 0
  spriteSheet:
"""

EDITS = [
    ("guid: [0-9a-f]{32}", f"guid: {GUID}"),
    ("\nTextureImporter:", "\nlabels:\n- fire\n- warm things\nTextureImporter:"),
    ("filterMode: 1", "filterMode: 0"),
    ("enableMipMap: 0", "enableMipMap: 1"),
    ("textureCompression: 2", "textureCompression: 0"),
    ("userData: ", 'userData: "{\\"a\\": 1,\n    \\"b\\": 2}"'),
    ("assetBundleName: ", "assetBundleName: effects/fire"),
    ("  spriteSheet:\n", ANDROID),
    ("secondaryTextures: \\[\\]", "secondaryTextures:\n    - texture: {fileID: 2800000, guid: "
     f"{GUID}, type: 3}}\n      name: _MotionTex"),
    ("serializedVersion: 11", "serializedVersion: 12\n  cookieLightType: 1"),
    ("    physicsShape: \\[\\]\n    bones", "    customData: \n    physicsShape: []\n    bones"),
]  # fmt: skip


def edited(meta: bytes) -> bytes:
    text = meta.decode()
    for pattern, replacement in EDITS:
        text, count = re.subn(pattern, lambda _, r=replacement: r, text, count=1)  # type: ignore[misc]
        assert count, pattern
    return text.encode()


def metas(files: dict[str, bytes]) -> dict[str, bytes]:
    return {name: data for name, data in files.items() if name.endswith(".meta")}


def test_a_persons_edits_survive_a_rebuild_of_other_frames() -> None:
    before = edited(exported(ALONE.product())["fire.png.meta"])
    product = Fire({"fire": 9}).product({"fire.png.meta": before}, pivot="center")
    after = exported(product)["fire.png.meta"]
    fresh = exported(Fire({"fire": 9}).product(pivot="center"))["fire.png.meta"]
    # A .meta with the same edits, made for the new frames from the start.
    assert after.decode().splitlines() == edited(fresh).decode().splitlines()
    assert yaml.load(after, Loader)["labels"] == ["fire", "warm things"]


def test_what_refers_to_a_page_follows_its_guid() -> None:
    before = edited(exported(ALONE.product())["fire.png.meta"])
    files = exported(ALONE.product({"fire.png.meta": before}))
    for name in ("fire.anim", "fire.prefab"):
        assert GUID.encode() in files[name]


@pytest.mark.parametrize("ends", ["\n", "\r\n"])
def test_a_rebuild_of_the_same_changes_no_byte(ends: str) -> None:
    files = exported(SEVERAL.product(alpha="premultiplied"))
    lying = {name: data.replace(b"\n", ends.encode()) for name, data in files.items()}
    lying["hero.png.meta"] = edited(files["hero.png.meta"]).replace(b"\n", ends.encode())
    again = exported(SEVERAL.product(lying, alpha="premultiplied"))
    assert metas(again) == metas(lying)


def test_pages_never_shrink_on_import_but_where_a_person_wants_it() -> None:
    old = edited(exported(ALONE.product())["fire.png.meta"])
    unused = ANDROID.replace("overridden: 1", "overridden: 0").replace("Android", "Standalone")
    old = old.replace(b"  spriteSheet:\n", unused.encode())
    huge = Fire({"fire": 7}).product({"fire.png.meta": old}, pot=True, padding=64, max_size=8192)
    wide = huge.sheets[0].pages[0]
    assert max(wide.width, wide.height) < 2048
    _, meta = importer(exported(huge)["fire.png.meta"].decode())
    limits = {p["buildTarget"]: p["maxTextureSize"] for p in meta["platformSettings"]}
    assert limits == {"DefaultTexturePlatform": 2048, "Android": 512, "Standalone": 2048}


@pytest.mark.parametrize("change", ["frames", "pages", "alpha", "order"])
def test_ids_and_guids_outlive_every_change(change: str) -> None:
    before = exported(SEVERAL.product(alpha="premultiplied"))
    animations = dict(SEVERAL.animations)
    atlas: dict[str, Any] = {"alpha": "premultiplied"}
    match change:
        case "frames":
            animations |= {"walk": 6, "run": 2, "jump": 3}
        case "pages":
            atlas["max_size"] = 32
        case "alpha":
            atlas["alpha"] = "straight"
        case "order":
            animations = dict(reversed(animations.items()))
    after = exported(Fire(animations, name="hero").product(**atlas))
    for name in metas(before).keys() & after.keys():
        assert guids_in(before[name].decode()) == guids_in(after[name].decode()), name
    ids = [_sprite_ids(files) for files in (before, after)]
    common = ids[0].keys() & ids[1].keys()
    assert len(common) >= 7
    assert {name: ids[0][name] for name in common} == {name: ids[1][name] for name in common}


def _sprite_ids(files: dict[str, bytes]) -> dict[str, int]:
    pages = [importer(data.decode())[1] for n, data in files.items() if n.endswith(".png.meta")]
    return {k: v for page in pages for k, v in page["spriteSheet"]["nameFileIdTable"].items()}


def test_another_importers_meta_leaves_its_guid_and_labels() -> None:
    old = f"fileFormatVersion: 2\nguid: {GUID}\nlabels:\n- mine\nDefaultImporter:\n  userData: x\n"
    made = exported(ALONE.product({"fire.png.meta": old.encode(), "fire.anim.meta": old.encode()}))
    for name, kind in (("fire.png", "TextureImporter"), ("fire.anim", "NativeFormatImporter")):
        meta = yaml.load(made[f"{name}.meta"], Loader)
        assert (meta["guid"], meta["labels"]) == (GUID, ["mine"])
        assert kind in meta and "DefaultImporter" not in meta


@pytest.mark.parametrize("stub", [f"fileFormatVersion: 2\nguid: {GUID}\n", f"guid: {GUID}"])
def test_a_stub_with_a_guid_is_filled(stub: str) -> None:
    made = exported(ALONE.product({"fire.png.meta": stub.encode()}))["fire.png.meta"]
    fresh = exported(ALONE.product())["fire.png.meta"]
    assert made.replace(GUID.encode(), guids_in(fresh.decode())[0].encode()) == fresh


def test_a_stub_that_only_names_the_importer_gets_what_is_ours() -> None:
    stub = f"fileFormatVersion: 2\nguid: {GUID}\nTextureImporter:\n  spriteSheet: {{}}\n"
    _, meta = importer(
        exported(ALONE.product({"fire.png.meta": stub.encode()}))["fire.png.meta"].decode()
    )
    assert len(meta["spriteSheet"]["sprites"]) == 7
    assert meta["spriteMode"] == 2 and meta["mipmaps"]["sRGBTexture"] == 1


@pytest.mark.parametrize(
    ("data", "advice"),
    [
        (b"\xff\xfe\x00", r"fire\.png\.meta: is not text"),
        (b"<<<<<<< HEAD\nguid: 1\n=======\n>>>>>>> theirs\n", "resolve that first"),
        (f"guid: {GUID}\nguid: {GUID[::-1]}\n".encode(), "resolve that first"),
    ],
)
def test_a_guid_that_cannot_be_read_is_never_replaced(data: bytes, advice: str) -> None:
    with pytest.raises(OutputError, match=advice):
        exported(ALONE.product({"fire.png.meta": data}))


def test_a_material_is_its_owners_once_it_is_there() -> None:
    mine = b"%YAML 1.1\n--- mine\n"
    made = exported(ALONE.product({"fire.mat": mine}, alpha="premultiplied"))
    assert made["fire.mat"] == mine
    assert made["fire.flakes.mat"] != mine


SOUND = exported(ALONE.product())["fire.png.meta"].decode()


@given(st.text("ab: -\n#'\"{}[]&\r\t", max_size=200), st.integers(60, len(SOUND)))
@settings(deadline=None)
def test_whatever_a_meta_holds_its_guid_is_kept(noise: str, at: int) -> None:
    old = SOUND[:at] + noise + SOUND[at:]
    assert guids_in(merged(old, SOUND, TEXTURE_KEYS)) == guids_in(SOUND)


def test_faults_are_found() -> None:
    files = {name: data.decode("latin") for name, data in exported(ALONE.product()).items()}
    for name, old, new in [
        ("fire.anim", "  m_Legacy: 0\n", ""),
        ("fire.anim", "serializedVersion: 6", "serializedVersion: 7"),
        ("fire.anim", "m_SampleRate: 12", "m_SampleRate: fast"),
        ("fire.png.meta", "      internalID", "      internalId"),
        ("fire.png.meta", "enableMipMap: 0", "enableMipMap: no"),
        ("fire.anim.meta", "mainObjectFileID", "mainObject"),
    ]:
        assert faults(name, files[name]) == []
        assert old in files[name]
        assert faults(name, files[name].replace(old, new, 1)), old

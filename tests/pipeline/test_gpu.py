"""``atlas.gpu``: builds that write their pages and maps as compressed textures, too."""

import json
import math
import re
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import texture2ddecoder
from numpy.typing import NDArray
from PIL import Image
from zstandard import ZstdDecompressor

from fire_atlas.core.shipped import shipped
from fire_atlas.formats.atlas.texture_packer import read_atlas
from fire_atlas.formats.textures.texture_file import read_texture
from tests.support.clips import real
from tests.support.repo import Repo, run_alone, script

ALL = ["bc3.dds", "bc7.dds", "bc7.ktx2", "astc-4x4.ktx2", "astc-6x6.ktx2", "etc2.ktx2"]

OTHERS = {"etc2": "etc2a8", "eac-r11": "eacr", "eac-rg11": "eacrg"}
"""What texture2ddecoder calls a format, if by another name."""


def statistics(repo: Repo, name: str = "fire") -> dict[str, Any]:
    manifest = json.loads((repo.build / f"{name}.manifest.json").read_bytes())
    found: dict[str, Any] = manifest["statistics"]
    return found


def image(path: Path) -> NDArray[np.uint8]:
    with Image.open(path) as opened:
        return np.asarray(opened.convert("RGBA"))


def size_of(path: Path) -> tuple[int, int]:
    with Image.open(path) as opened:
        return opened.size


def blocks_of(path: Path) -> tuple[int, int, list[bytes]]:
    """Width, height and levels of a texture, read apart from our own readers."""
    data = path.read_bytes()
    if path.suffix == ".ktx2":
        width, height, *_, count = struct.unpack_from("<6I", data, 20)
        index = [struct.unpack_from("<2Q", data, 80 + 24 * level) for level in range(count)]
        levels = [data[place : place + size] for place, size in index]
        if data[44] == 2:
            levels = [ZstdDecompressor().decompress(level) for level in levels]
        return width, height, levels
    height, width, _, _, count = struct.unpack_from("<5I", data, 12)
    levels, at = [], 148 if data[84:88] == b"DX10" else 128
    for level in range(count):
        blocks = [-(-max(side >> level, 1) // 4) for side in (width, height)]
        size = blocks[0] * blocks[1] * (8 if ".bc4." in path.name or ".bc1." in path.name else 16)
        levels.append(data[at : at + size])
        at += size
    assert at == len(data)
    return width, height, levels


def decoded(path: Path, level: int = 0) -> NDArray[np.uint8]:
    """The pixels that texture2ddecoder finds in a texture."""
    width, height, levels = blocks_of(path)
    width, height = max(width >> level, 1), max(height >> level, 1)
    kind = path.name.split(".")[-2]
    if kind.startswith("astc"):
        side = int(kind[-1])
        pixels = texture2ddecoder.decode_astc(levels[level], width, height, side, side)
    else:
        decode = getattr(texture2ddecoder, f"decode_{OTHERS.get(kind, kind)}")
        pixels = decode(levels[level], width, height)
    return np.frombuffer(pixels, np.uint8).reshape(height, width, 4)[..., [2, 1, 0, 3]]


def psnr(texture: Path, page: NDArray[np.uint8], straight: bool = False) -> float:
    """The error over visible pixels, premultiplied, of what another decoder finds."""
    one, other = decoded(texture).astype(np.float64), page.astype(np.float64)
    if straight:
        for each in (one, other):
            each[..., :3] *= each[..., 3:] / 255
    visible = (page[..., 3] > 2) | (other[..., :3].max(axis=2) > 2)
    return float(10 * np.log10(255**2 / np.mean((one - other)[visible] ** 2)))


def test_every_page_and_map_gets_its_textures(repo: Repo) -> None:
    repo.clip()
    atlas = {"gpu": ALL, "alpha": "premultiplied", "scales": [1, 0.5], "mips": 2}
    maps = {"motion": "godot", "flame": True}
    files = repo.built(repo.recipe(atlas=atlas, maps=maps, exports=["json", "phaser"]))
    expected = {f"{page}.{each}" for page in ("fire", "fire.flame", "fire@0.5x", "fire@0.5x.flame")
                for each in ALL}  # fmt: skip
    vectors = {"bc5.dds", "bc5.ktx2", "astc-4x4.ktx2", "astc-6x6.ktx2", "eac-rg11.ktx2"}
    expected |= {f"{page}.motion.{each}" for page in ("fire", "fire@0.5x") for each in vectors}
    assert {name for name in files if name.endswith((".dds", ".ktx2"))} == expected
    assert statistics(repo)["gpu"].keys() == expected
    roles = {
        each["path"]: each["role"] for each in json.loads(files["fire.manifest.json"])["outputs"]
    }
    assert {roles[name] for name in expected} == {"texture"}
    for sheet in ("fire", "fire@0.5x"):
        listed = json.loads(files[f"{sheet}.json"])["meta"]["gpu"]
        assert listed == json.loads(files[f"{sheet}.phaser.json"])["meta"]["gpu"]
        mine = {name for name in expected if name.startswith(f"{sheet}.")}
        assert {each["file"] for each in listed} == mine
        for each in listed:
            header = read_texture(repo.build / each["file"])
            width, height = size_of(repo.build / each["image"])
            assert (header.width, header.height) == (width, height)
            assert (header.format.name, len(header.sizes)) == (each["format"], each["levels"])
    read = read_atlas(repo.build / "fire.json").sheet
    assert [texture.file for texture in read.gpu] == [
        each["file"] for each in json.loads(files["fire.json"])["meta"]["gpu"]
    ]


@pytest.mark.parametrize("alpha", ["straight", "premultiplied"])
def test_another_decoder_finds_the_error_that_the_manifest_states(repo: Repo, alpha: str) -> None:
    repo.clip(height=160)
    repo.built(repo.recipe(atlas={"gpu": ALL, "alpha": alpha}, maps={"motion": "godot"}))
    page = image(repo.build / "fire.png")
    vectors = image(repo.build / "fire.motion.png").astype(np.float64)
    for file, figures in statistics(repo)["gpu"].items():
        if ".motion." in file:
            error = decoded(repo.build / file)[..., :2] - vectors[..., :2]
            found = 10 * math.log10(255**2 / np.mean(error**2))
            assert figures["psnr"] > 40 and figures["hue"] is None
            # texture2ddecoder keeps 8 of the 16 bits that ASTC interpolates and of the 11 of EAC,
            # and rounds none.
            close = 2 if "astc" in file else 0.5 if "eac" in file else 0.01
            assert figures["psnr"] == pytest.approx(found, abs=close), file
            continue
        found = psnr(repo.build / file, page, alpha == "straight")
        assert figures["psnr"] == pytest.approx(found, abs=0.15 if "astc" in file else 0.01), file


def test_vectors_alone_are_compressed_if_only_bc5_is_listed(repo: Repo) -> None:
    repo.clip()
    files = repo.built(
        repo.recipe(atlas={"gpu": ["bc5.dds"]}, maps={"motion": "godot"}, exports=["json"])
    )
    assert [name for name in files if name.endswith(".dds")] == ["fire.motion.bc5.dds"]
    vectors = image(repo.build / "fire.motion.png")
    error = decoded(repo.build / "fire.motion.bc5.dds")[..., :2].astype(int) - vectors[..., :2]
    assert np.sqrt(np.mean(error**2)) < 1
    assert np.abs(error[(vectors[..., :2] == 128).all(axis=2)]).mean() < 0.2


def test_the_sample_campfire_is_kept_well(repo: Repo) -> None:
    source = {"path": str(shipped("samples") / "campfire"), "fps": 24, "count": 6}
    atlas = {"gpu": ["bc7.ktx2", "astc-6x6.ktx2"], "alpha": "premultiplied"}
    repo.built(repo.recipe(source=source, timeline={"loop": "none"}, atlas=atlas))
    page = image(repo.build / "fire.png")
    assert psnr(repo.build / "fire.bc7.ktx2", page) >= 40.5
    # Its sparks are finer than blocks of 6 x 6: the encoder's most thorough search gains 0.2 dB.
    assert psnr(repo.build / "fire.astc-6x6.ktx2", page) >= 35


CLIPS = [
    real("real_fireplace_gif", 42, 36), real("real_firewall_stock", 42, 36),
    real("sim_unity_flame02", 42, 36), real("cartoon_fluent_fire", 42, 36),
    real("cartoon_wesnoth_campfire", 34, 30),  # dithered art
]  # fmt: skip


@pytest.mark.parametrize(("clip", "bc7", "astc"), CLIPS)
def test_real_clips_are_kept_well(
    clips: Path, repo: Repo, clip: str, bc7: float, astc: float
) -> None:
    meta = json.loads((clips / clip / "meta.json").read_text(encoding="utf-8"))
    source = {"path": str(clips / clip / "frames"), "fps": meta["fps"], "count": 4}
    atlas = {"gpu": ["bc7.dds", "astc-6x6.ktx2"], "alpha": "premultiplied"}
    repo.built(repo.recipe(source=source, timeline={"loop": "none"}, atlas=atlas))
    page = image(repo.build / "fire.png")
    assert psnr(repo.build / "fire.bc7.dds", page) >= bc7
    assert psnr(repo.build / "fire.astc-6x6.ktx2", page) >= astc


def test_the_same_bytes_twice_and_at_one_and_two_workers(repo: Repo) -> None:
    repo.clip()
    recipe = repo.recipe(atlas={"gpu": [*ALL, "bc5.dds"]}, maps={"motion": "godot"})
    first = repo.built(recipe, "--jobs", "2")
    for jobs in ("2", "1"):
        assert repo.built(recipe, "--force", "--jobs", jobs) == first


def test_pages_of_16_bits_are_compressed_as_those_of_8(repo: Repo) -> None:
    repo.clip()
    atlas = {"gpu": ["bc7.dds"], "alpha": "premultiplied"}
    first = repo.built(repo.recipe(atlas=atlas))
    second = repo.built(repo.recipe(atlas={**atlas, "bits": 16}))
    assert first["fire.bc7.dds"] == second["fire.bc7.dds"]
    said = repo.run("inspect", repo.build / "fire.json", "--memory").out
    assert "rgba16" in said and "12.5 %" in said


def test_depth_takes_bc4_and_smoke_keeps_its_alpha(repo: Repo) -> None:
    source = {"kind": "silk", "width": 48, "height": 64}
    atlas = {"gpu": ["bc7.dds"], "alpha": "additive"}
    recipe = repo.recipe(source=source, timeline={"frames": 3}, atlas=atlas,
                         maps={"depth": True, "normals": True, "smoke": True})  # fmt: skip
    files = {name for name in repo.built(recipe) if name.endswith(".dds")}
    assert files == {
        "fire.bc7.dds", "fire.smoke.bc7.dds", "fire.normals.bc7.dds", "fire.depth.bc4.dds"
    }  # fmt: skip
    for kind, blocks, channels in (("depth", "bc4", 1), ("normals", "bc7", 4), ("smoke", "bc7", 4)):
        kept = decoded(repo.build / f"fire.{kind}.{blocks}.dds")[..., :channels].astype(int)
        error = kept - image(repo.build / f"fire.{kind}.png")[..., :channels]
        assert np.sqrt(np.mean(error**2)) < 4, kind
    assert read_texture(repo.build / "fire.smoke.bc7.dds").alpha == "premultiplied"


@pytest.mark.parametrize(
    ("pixels", "blocks", "part", "least"), [("heat", "bc4", 8, 38), ("heat4", "bc7", 16, 32)]
)
def test_heat_takes_a_part_of_the_memory(
    repo: Repo, pixels: str, blocks: str, part: int, least: float
) -> None:
    """One channel in BC4, or four frames in BC7, next to pages of colours in 8 bits a channel."""
    source = {"path": str(shipped("samples") / "campfire"), "fps": 24, "count": 8}
    gpu = ["bc7.dds", "bc7.ktx2", "astc-4x4.ktx2"]
    files = repo.built(
        repo.recipe(source=source, timeline={"loop": "none"}, flakes="none", exports=["json"],
                    atlas={"pixels": pixels, "gpu": gpu, "layout": "grid"})
    )  # fmt: skip
    names = [f"fire.{blocks}.dds", f"fire.{blocks}.ktx2", "fire.astc-4x4.ktx2"]
    assert [name for name in files if name.endswith((".dds", ".ktx2"))] == sorted(names)
    channels = 1 if pixels == "heat" else 4
    page = image(repo.build / "fire.png")[..., :channels].astype(float)
    frames_of_page = page.shape[0] * page.shape[1] * channels  # px of the frames that it holds
    assert len(blocks_of(repo.build / names[0])[2][0]) == frames_of_page * 4 / part
    for name in names:
        ours = decoded(repo.build / name)[..., :channels]
        found = 10 * math.log10(255**2 / np.mean((ours - page)[page > 0] ** 2))
        figures = statistics(repo)["gpu"][name]
        close = 2.5 if "astc" in name else 0.1  # texture2ddecoder keeps fewer bits of ASTC
        assert figures["psnr"] == pytest.approx(found, abs=close) and found > least
        assert figures["hue"] is None
        assert not read_texture(repo.build / name).srgb
        means = page.reshape(page.shape[0] // 2, 2, -1, 2, channels).mean(axis=(1, 3))
        half = decoded(repo.build / name, 1)[..., :channels]
        assert 10 * math.log10(255**2 / np.mean((half - means) ** 2)) > least


def test_layers_beside_heat_keep_their_colours(repo: Repo) -> None:
    repo.clip()
    atlas = {"pixels": "heat", "gpu": ["bc7.dds"]}
    files = repo.built(repo.recipe(atlas=atlas, maps={"flame": True}))
    textures = {name for name in files if name.endswith(".dds")}
    assert textures == {"fire.bc4.dds", "fire.flame.bc7.dds"}
    assert psnr(repo.build / "fire.flame.bc7.dds", image(repo.build / "fire.flame.png")) > 33


@pytest.mark.parametrize("name", ["motion", "haze"])
def test_a_recipe_may_be_named_as_a_map(repo: Repo, name: str) -> None:
    repo.clip()
    recipe = repo.recipe(f"{name}.yaml", atlas={"gpu": ["bc7.dds"]})
    assert repo.run("build", recipe).code == 0
    assert (repo.build / f"{name}.bc7.dds").exists()
    planned = repo.run("build", recipe, "--depfile", repo.folder / "fire.d", "--dry-run")
    assert planned.code == 0 and "up to date" in planned.out


def test_pages_are_those_of_the_same_layout_without_textures(repo: Repo) -> None:
    """Another format changes no page: only which layout is asked for does."""
    repo.clip()
    first = repo.built(repo.recipe(atlas={"gpu": ["bc7.dds"]}))
    second = repo.built(repo.recipe(atlas={"gpu": ["astc-4x4.ktx2", "bc3.ktx2"]}))
    assert first["fire.png"] == second["fire.png"]
    assert "fire.bc7.dds" not in second, "what the recipe no longer asks for is removed"


@pytest.mark.parametrize(
    ("space", "gpu", "transfer"),
    [("srgb", "bc7.ktx2", 1), ("linear", "bc7.ktx2", 2), ("linear", "astc-6x6.ktx2", 2)],
)
def test_clients_that_blend_in_linear_light_get_srgb_formats(
    repo: Repo, space: str, gpu: str, transfer: int
) -> None:
    repo.clip()
    atlas = {"gpu": [gpu], "blend_space": space, "alpha": "premultiplied"}
    repo.built(repo.recipe(atlas=atlas, maps={"motion": "godot"}, exports=["json"]))
    header = read_texture(repo.build / f"fire.{gpu}")
    assert (header.srgb, header.alpha) == (transfer == 2, "premultiplied")
    data = (repo.build / f"fire.{gpu}").read_bytes()
    (descriptor,) = struct.unpack_from("<I", data, 48)
    assert (data[descriptor + 14], data[descriptor + 15]) == (transfer, 1)
    vectors = gpu.replace("bc7", "bc5")
    assert not read_texture(repo.build / f"fire.motion.{vectors}").srgb


def test_more_mips_are_written_on_request(repo: Repo) -> None:
    repo.clip()
    for mips, levels in ("auto", 3), (1, 1), (4, 4), (15, 9):
        repo.built(repo.recipe(atlas={"gpu": ["bc7.dds"], "mips": mips}))
        width, height, found = blocks_of(repo.build / "fire.bc7.dds")
        assert len(found) == levels
        safe = json.loads((repo.build / "fire.json").read_bytes())["meta"]["fireAtlas"]
        assert safe["safeMipLevel"] >= min(levels, 5) - 1
    assert max(width, height) >> 8 == 1, "the last is down to one pixel"


REFUSED: list[tuple[dict[str, Any], dict[str, Any], str]] = [
    ({"gpu": ["bc1.dds"]}, {}, "bc1.dds has no alpha"),
    ({"gpu": ["bc1.dds"], "pixels": "heat4"}, {}, "bc1.dds has no alpha, which heat4"),
    ({"gpu": ["bc4.ktx2"]}, {}, "bc4.ktx2 holds one channel"),
    ({"gpu": ["bc4.ktx2"], "pixels": "heat4"}, {}, "bc4.ktx2 holds one channel"),
    ({"gpu": ["bc5.dds"]}, {}, "bc5.dds holds two channels"),
    ({"gpu": ["bc7.dds", "bc7.dds"]}, {}, "bc7.dds is listed twice"),
    ({"gpu": ["bc7"]}, {}, "atlas.gpu"),
    ({"gpu": ["astc-6x6.dds"]}, {}, "atlas.gpu"),
    ({"mips": 3}, {}, "are the levels of compressed textures"),
    ({"gpu": ["bc7.dds"], "mips": 0}, {}, "atlas.mips"),
    ({"gpu_quality": "draft"}, {}, "atlas.gpu_quality: is of compressed textures"),
    ({"gpu_quality": "fast", "gpu": ["bc7.dds"]}, {}, "atlas.gpu_quality"),
    ({"supercompression": "zstd"}, {}, "atlas.supercompression: is of KTX2 files"),
    ({"supercompression": "zstd", "gpu": ["bc7.dds"]}, {}, "atlas.supercompression: is of KTX2"),
]


@pytest.mark.parametrize(("atlas", "maps", "advice"), REFUSED)
def test_what_cannot_be_is_refused_before_any_work(
    repo: Repo, atlas: dict[str, Any], maps: dict[str, Any], advice: str
) -> None:
    repo.clip()
    ran = repo.run("check", repo.recipe(atlas=atlas, maps=maps))
    assert ran.code and advice in ran.err and "fire.yaml:1" in ran.err


def test_additive_pages_fit_bc1(repo: Repo) -> None:
    repo.clip()
    repo.built(repo.recipe(atlas={"gpu": ["bc1.dds"], "alpha": "additive"}))
    page = image(repo.build / "fire.png").astype(int)
    assert np.abs(page - decoded(repo.build / "fire.bc1.dds"))[..., :3].mean() < 3
    assert statistics(repo)["gpu"]["fire.bc1.dds"]["psnr"] > 24


def test_a_missing_extra_is_named(repo: Repo, monkeypatch: pytest.MonkeyPatch) -> None:
    repo.clip()
    monkeypatch.setattr("fire_atlas.formats.problems.find_spec", lambda name: None)
    ran = repo.run("check", repo.recipe(atlas={"gpu": ["bc7.dds"]}))
    assert ran.code == 1 and "pip install 'fire-atlas[gpu]'" in ran.err


def test_a_missing_zstandard_is_named(repo: Repo, monkeypatch: pytest.MonkeyPatch) -> None:
    repo.clip()
    monkeypatch.setattr(
        "fire_atlas.formats.problems.find_spec", lambda name: name != "zstandard" or None
    )
    atlas = {"gpu": ["bc7.ktx2"], "supercompression": "zstd"}
    ran = repo.run("check", repo.recipe(atlas=atlas))
    assert ran.code == 1 and "needs zstandard: pip install 'fire-atlas[gpu]'" in ran.err
    assert repo.run("check", repo.recipe(atlas={"gpu": ["bc7.ktx2"]})).code == 0


@pytest.mark.parametrize("layout", ["packed", "grid"])
def test_supercompressed_files_hold_the_same_blocks(repo: Repo, layout: str) -> None:
    repo.clip()
    atlas = {"gpu": ["bc7.ktx2", "astc-6x6.ktx2", "bc3.dds"], "layout": layout}
    maps = {"motion": "godot"} if layout == "grid" else {}
    plain = repo.built(repo.recipe(atlas=atlas, maps=maps))
    levels = {name: blocks_of(repo.build / name) for name in plain if name.endswith(".ktx2")}
    recipe = repo.recipe(atlas={**atlas, "supercompression": "zstd"}, maps=maps)
    packed = repo.built(recipe, "--jobs", "2")
    assert packed.keys() == plain.keys() and len(levels) == (4 if maps else 2)
    for name, found in levels.items():
        assert blocks_of(repo.build / name) == found
        assert len(packed[name]) < 0.75 * len(plain[name])
        assert read_texture(repo.build / name).memory == sum(map(len, found[2]))
    assert packed["fire.bc3.dds"] == plain["fire.bc3.dds"]
    assert repo.built(recipe, "--force", "--jobs", "1") == packed
    assert repo.run("inspect", repo.build / "fire.json", "--memory").code == 0


def test_a_draft_stands_in_the_manifest_and_a_build_encodes_again(repo: Repo) -> None:
    repo.clip()
    atlas = {"gpu": ["bc7.dds", "astc-6x6.ktx2"]}
    recipe = repo.recipe(atlas=atlas)
    final = repo.built(recipe, "--cache", repo.folder / "cache")
    assert statistics(repo)["gpu_quality"] == "final"
    ran = repo.run(
        "build", recipe, "--set", "atlas.gpu_quality=draft", "--cache", repo.folder / "cache"
    )
    assert ran.code == 0 and "atlas.gpu_quality: draft" in ran.out + ran.err
    assert statistics(repo)["gpu_quality"] == "draft"
    for name in ("fire.bc7.dds", "fire.astc-6x6.ktx2"):
        assert (repo.build / name).read_bytes() != final[name]
        assert (repo.build / name).stat().st_size == len(final[name])
    assert (repo.build / "fire.png").read_bytes() == final["fire.png"]
    assert repo.built(recipe) == final
    assert "gpu_quality" not in statistics_of_plain_build(repo)


def statistics_of_plain_build(repo: Repo) -> dict[str, Any]:
    repo.built(repo.recipe())
    return statistics(repo)


def test_a_preview_is_a_draft_unless_the_recipe_says_otherwise(repo: Repo) -> None:
    repo.clip()
    for atlas, is_draft in (
        ({"gpu": ["bc7.dds"]}, True),
        ({"gpu": ["bc7.dds"], "gpu_quality": "final"}, False),
        ({}, False),
    ):
        ran = repo.run("preview", repo.recipe(atlas=atlas), "-o", repo.folder / "fire.html")
        assert ran.code == 0, ran.err
        assert ("atlas.gpu_quality: draft" in ran.out + ran.err) == is_draft


def test_encoders_are_loaded_only_where_textures_are_asked_for(repo: Repo) -> None:
    repo.clip()
    said = "import atexit, sys; atexit.register(lambda: print('MODULES', *sys.modules))"
    for atlas, loaded in ({}, False), ({"gpu": ["bc7.dds", "astc-4x4.ktx2"]}, True):
        ran = run_alone(script(said, "build", repo.recipe(atlas=atlas), "-q"))
        assert ran.code == 0, ran.err
        modules = set(ran.out.split())
        assert ({"etcpak", "astc_encoder"} <= modules) == loaded
        assert ("etcpak" in modules) == loaded == ("astc_encoder" in modules)


def test_art_that_compression_spoils_is_noted_with_advice(repo: Repo) -> None:
    chance = np.random.default_rng(4)
    noise = [
        np.dstack([chance.integers(0, 256, (40, 40, 3)), np.full((40, 40), 255)]) for _ in "ab"
    ]
    repo.frames([each.astype(np.uint8) for each in noise])
    recipe = repo.recipe(
        source={"path": "clip", "fps": 8}, flakes="none", motion_blur="none",
        timeline={"loop": "none"}, atlas={"gpu": ["bc3.dds"]},
    )  # fmt: skip
    ran = repo.run("build", recipe)
    assert "atlas.gpu: fire.bc3.dds differs from its image by" in ran.out + ran.err


BUILDS: list[dict[str, Any]] = [
    {},
    {"gpu": ["bc7.dds", "astc-6x6.ktx2"], "alpha": "premultiplied"},
    {"gpu": ["bc3.ktx2", "bc7.dds"], "mips": 4, "layout": "grid"},
]


@pytest.mark.parametrize("atlas", BUILDS, ids=str)
def test_inspect_states_what_a_recount_gives(repo: Repo, atlas: dict[str, Any]) -> None:
    repo.clip()
    repo.built(repo.recipe(atlas=atlas, maps={"flame": True} if atlas else {}))
    said = repo.run("inspect", repo.build / "fire.json", "--memory").out
    lines = [re.split(r"  +", line) for line in said.splitlines() if line.startswith("fire")]
    rows = {cells[0]: cells[1:] for cells in lines}
    images = ["fire.png", *(["fire.flame.png"] if atlas else [])]
    names = [f"{each[:-4]}.{kind}" for each in images for kind in atlas.get("gpu", [])]
    assert rows.keys() == {*images, *names}
    levels = {0: 1, 1: 3, 2: 4}[BUILDS.index(atlas)]
    side = {"bc3": 4, "bc7": 4, "astc-6x6": 6}
    for file, (kind, count, memory, part, error, hue) in rows.items():
        of = f"{file.rpartition('.')[0].removesuffix(f'.{kind}')}.png"
        width, height = size_of(repo.build / of)
        sizes = [(max(width >> i, 1), max(height >> i, 1)) for i in range(levels)]
        whole = sum(w * h * 4 for w, h in sizes)
        taken = whole if kind == "rgba8" else sum(
            -(-w // side[kind]) * -(-h // side[kind]) * 16 for w, h in sizes
        )  # fmt: skip
        assert (count, memory) == (str(levels), f"{taken / 2**20:.2f} MiB")
        assert part == f"{100 * taken / whole:.1f} %"
        if kind == "rgba8":
            assert (error, hue) == ("-", "-")
            continue
        assert (repo.build / file).stat().st_size - taken in range(148, 148 + 400)
        page = image(repo.build / of)
        found = psnr(repo.build / file, page, atlas.get("alpha") is None)
        assert float(error.removesuffix(" dB")) == pytest.approx(found, abs=0.11)
        distance = hue_distance(decoded(repo.build / file), page, atlas.get("alpha") is None)
        assert float(hue) == pytest.approx(distance, abs=0.2, rel=0.02)


XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])


def hue_distance(one: NDArray[np.uint8], other: NDArray[np.uint8], straight: bool) -> float:
    """The 99.5th percentile of the distances in the plane a*, b* of CIELAB, seen over black."""
    light = []
    for each in (one, other):
        shown = each[..., :3] / 255 * (each[..., 3:] / 255 if straight else 1)
        light.append(np.where(shown <= 0.04045, shown / 12.92, ((shown + 0.055) / 1.055) ** 2.4))
    visible = (other[..., 3] > 2) | ((other[..., :3] * (other[..., 3:] / 255 if straight else 1))
                                     .max(axis=2) > 2)  # fmt: skip
    lab = [np.cbrt(each[visible] @ (XYZ / XYZ.sum(axis=1, keepdims=True)).T) for each in light]
    x, y, z = (lab[0] - lab[1]).T
    return float(np.percentile(np.hypot(500 * (x - y), 200 * (y - z)), 99.5))


def test_inspect_refuses_textures_that_are_not_as_the_atlas_says(repo: Repo) -> None:
    repo.clip()
    repo.built(repo.recipe(atlas={"gpu": ["bc7.dds"]}))
    texture = repo.build / "fire.bc7.dds"
    data = texture.read_bytes()
    texture.write_bytes(data[:-1])
    ran = repo.run("inspect", repo.build / "fire.json")
    assert ran.code == 1 and "fire.bc7.dds" in ran.err and "build the recipe again" in ran.err
    texture.unlink()
    ran = repo.run("inspect", repo.build / "fire.json")
    assert ran.code == 1 and "cannot be read" in ran.err

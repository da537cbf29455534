"""What builds write is what docs/formats.md says: real outputs against its schemas and tables."""

import fnmatch
import json
import re
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args

import pytest
from jsonschema import Draft202012Validator
from referencing import Registry, Resource

from fire_atlas.cli import main
from fire_atlas.core.output_file import Role
from fire_atlas.core.shipped import shipped
from fire_atlas.effect.flakes.tracks import COLUMNS, DEPTH_COLUMNS, SPAWN_COLUMNS
from fire_atlas.formats.atlas.texture_packer import read_atlas
from fire_atlas.formats.templates.context import context_of
from fire_atlas.formats.tracks.columns import CELL
from tests.docs.markdown import PAGES, code_blocks, page_text, prose, section, table_column

FORMATS = "docs/formats.md"

SCHEMAS = {schema["$id"]: schema for schema in map(json.loads, code_blocks(FORMATS, "json"))}

SCHEMA_OF = {
    ".flakes.json": "tracks",
    ".light.json": "light",
    ".flakes.hjson": "hjson",
    ".manifest.json": "manifest",
    ".array.json": "array",
    ".aseprite.json": "array",
    ".phaser.json": "phaser",
    ".json": "hash",
}
"""The name of each ending's schema; the first that fits counts."""

CAMPFIRE = {"path": str(shipped("samples") / "campfire"), "fps": 24, "count": 6, "height": 80}

SILK = {"kind": "silk", "width": 48, "height": 48, "rows": 6, "columns": 4}

MADE_BY_OTHERS = {"campfire.yaml", "campfire.preview.html"}
"""Files whose names begin like those of outputs: the recipe's, and what ``preview`` writes."""

RECIPES: dict[str, dict[str, Any]] = {
    "everything": {
        "source": {**CAMPFIRE, "count": 12},
        "timeline": {"frames": 6},
        "atlas": {
            "layout": "grid",
            "alpha": "premultiplied",
            "scales": [1, 0.5],
            "gpu": ["bc7.dds", "astc-6x6.ktx2"],
            "supercompression": "zstd",
        },
        "maps": {"motion": "godot", "flame": True, "flakes": True, "emission": "exr", "haze": True},
        "exports": ["json", "json-array", "phaser", "aseprite", "tpsheet", "godot", "unity"],
        "tracks": ["json", "csv", "pcache", "hjson", "light"],
        "movies": ["webm", "webp", "apng", "gif", "mp4"],
    },
    "pages": {
        "source": CAMPFIRE,
        "timeline": {"loop": "none"},
        "atlas": {"max_size": 96, "mesh": {"vertices": 6}},
        "maps": {"motion": "godot"},
        "exports": ["json", "json-array", "phaser", "css", "tpsheet", "godot"],
    },
    "sides": {
        "source": SILK,
        "timeline": {"frames": 6},
        "views": {"count": 2},
        "maps": {"motion": "unity", "smoke": True, "normals": True, "depth": True},
        "atlas": {"layout": "grid"},
        "exports": ["json", "phaser", "godot"],
        "tracks": ["json", "light"],
        "movies": ["gif"],
    },
    "budget": {
        "source": CAMPFIRE,
        "fit": {"memory": 0.05},
        "exports": ["json", "godot"],
    },
    "winds": {
        "source": SILK,
        "timeline": {"frames": 6},
        "wind": {"levels": [0, 3]},
        "exports": ["json", "godot"],
    },
    "icons": {
        "source": {
            "kind": "sprites",
            "path": CAMPFIRE["path"],
            "animations": "none",
            "borders": {"0000": [4, 3, 2, 1]},
        },
        "exports": ["json", "json-array", "phaser", "css", "tpsheet", "godot"],
    },
    "sprites": {
        "source": {**CAMPFIRE, "count": 4},
        "flakes": "none",
        "motion_blur": "none",
        "maps": {"motion": "godot"},
        "atlas": {"format": "webp", "quality": 80},
    },
    "played": {
        "source": {**CAMPFIRE, "count": 4},
        "flakes": {"bake": False},
        "exports": ["godot"],
    },
    "sparks": {
        "source": {**CAMPFIRE, "count": 4},
        "flakes": {"bake": False, "variants": 2},
        "exports": ["json", "godot", "unity"],
        "tracks": ["json", "csv", "pcache", "hjson"],
    },
    "lit": {
        "source": {**CAMPFIRE, "count": 8},
        "timeline": {"loop": "crossfade"},
        "phases": {"ignite": 0.2, "extinguish": 0.2},
        "tracks": [],
        "exports": ["json", "godot", "unity"],
    },
    "several": {
        "source": SILK,
        "timeline": {"frames": 6},
        "variants": 2,
        "phases": {"ignite": 0.2, "extinguish": 0.2},
        "exports": ["json", "unity"],
    },
    "gusty": {
        "source": SILK,
        "timeline": {"frames": 6},
        "variants": 2,
        "wind": {"levels": [0, 3]},
    },
    "heat": {
        "source": {**CAMPFIRE, "count": 5},
        "flakes": "none",
        "atlas": {"pixels": "heat4", "ramp": ["learnt", "gas"]},
        "exports": ["json", "json-array", "phaser", "godot"],
    },
    "grey": {
        "source": {**CAMPFIRE, "count": 4},
        "flakes": "none",
        "atlas": {"pixels": "heat"},
        "exports": ["unity"],
    },
    "level": {"atlas": {"members": ["pages.yaml", "sprites.yaml"]}},
}
"""Recipes that together write every format, and every key of the JSON ones."""


@pytest.fixture(scope="session")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the outputs of all recipes."""
    folder = tmp_path_factory.mktemp("formats")
    for name, recipe in RECIPES.items():
        (folder / f"{name}.yaml").write_text(json.dumps(recipe), encoding="utf-8")
    assert main(["build", str(folder), "-q"]) == 0
    return folder / "build"


def validator(name: str) -> Draft202012Validator:
    known = Registry[Any]().with_resources(
        (uri, Resource.from_contents(schema)) for uri, schema in SCHEMAS.items()
    )
    return Draft202012Validator(SCHEMAS[f"urn:fire-atlas:{name}"], registry=known)


def schema_of(path: Path) -> str | None:
    return next((name for end, name in SCHEMA_OF.items() if path.name.endswith(end)), None)


def objects(schema: Any) -> Iterator[dict[str, Any]]:
    """Yield each schema of an object within a schema."""
    if isinstance(schema, dict):
        if "object" in schema.get("type", ()):
            yield schema
        for inner in schema.values():
            yield from objects(inner)
    elif isinstance(schema, list):
        for inner in schema:
            yield from objects(inner)


@pytest.mark.parametrize("name", sorted(set(SCHEMA_OF.values())))
def test_outputs_are_as_their_schema_says(name: str, built: Path) -> None:
    check = validator(name)
    files = [path for path in sorted(built.iterdir()) if schema_of(path) == name]
    assert files, f"no recipe here writes what the schema {name} describes"
    for path in files:
        check.validate(json.loads(path.read_text(encoding="utf-8")))


def test_schemas_are_sound_and_take_no_key_that_they_do_not_name() -> None:
    assert {f"urn:fire-atlas:{name}" for name in (*SCHEMA_OF.values(), "parts")} == SCHEMAS.keys()
    for name, schema in SCHEMAS.items():
        Draft202012Validator.check_schema(schema)
        assert all("additionalProperties" in each for each in objects(schema)), name


@pytest.mark.parametrize("name", sorted(set(SCHEMA_OF.values())))
def test_a_key_more_is_noticed(name: str, built: Path) -> None:
    path = next(path for path in sorted(built.iterdir()) if schema_of(path) == name)
    document = json.loads(path.read_text(encoding="utf-8"))
    assert not validator(name).is_valid({**document, "another": 1})


@pytest.mark.parametrize("page", PAGES)
def test_every_output_that_a_page_names_is_written(page: str, built: Path) -> None:
    """What pages call ``campfire.json`` is ``everything.json`` here; rows of tables go on with
    endings: ``.csv``, ``_motion.tres``."""
    written = [path.name for path in built.iterdir()]
    for line in prose(page).splitlines():
        names = [name.removeprefix("build/") for name in re.findall(r"`([^`\s]+)`", line)]
        outputs = [name for name in names if re.match(r"campfire[-.@_].*\.[a-z*]+$", name)]
        endings = [f"*{name}" for name in names if outputs and re.match(r"[._][a-z._]+$", name)]
        for name in set(outputs) - MADE_BY_OTHERS:
            others = [name.replace("campfire", recipe) for recipe in RECIPES]
            assert any(fnmatch.filter(written, other) for other in others), f"{page}: {name}"
        for ending in endings:
            assert fnmatch.filter(written, ending), f"{page}: {ending}"


def test_every_file_of_a_build_is_listed(built: Path) -> None:
    known = set(table_column(page_text(FORMATS).partition("\n## ")[0]))
    stems = "|".join(RECIPES)
    for path in built.iterdir():
        ending = re.sub(
            rf"^({stems})(@0\.5x)?(-\d+)?(\.(v\d+\.)?((view|wind|extinguish)(_\d+)+|burn|ignite|extinguish|out|pages"
            r"|\d{4}))?(\.v1(?=\.flakes))?",
            "",
            path.name,
        )
        companion = re.search(r"\.(meta|import|(gd|gdshader)\.uid)$", ending)
        assert (companion[0] if companion else ending) in known, path.name


def test_roles_of_outputs_are_those_of_the_schema() -> None:
    outputs = SCHEMAS["urn:fire-atlas:manifest"]["properties"]["outputs"]
    roles = outputs["items"]["properties"]["role"]["enum"]
    assert {*roles, "manifest"} == set(get_args(Role))


def test_tables_of_tracks_have_every_column(built: Path) -> None:
    text = section(FORMATS, "Tracks: JSON")
    rows, spawns = text.split("| key of a spawn |")
    spawns, cameras = spawns.split("| key of `camera` |")
    assert tuple(table_column(rows)) == (*COLUMNS, *DEPTH_COLUMNS, CELL)
    assert tuple(table_column("| key of a spawn |" + spawns)) == SPAWN_COLUMNS + DEPTH_COLUMNS
    tracks = json.loads((built / "sides.view_1.flakes.json").read_text())
    assert list(tracks["camera"]) == table_column("| key |" + cameras)
    assert tuple(tracks["columns"]) == COLUMNS + DEPTH_COLUMNS
    header = (built / "everything.flakes.csv").read_text().splitlines()[0]
    assert header.split(",") == ["frame", "t", *COLUMNS]


def test_attributes_of_caches_are_those_of_the_tables(built: Path) -> None:
    cache = json.loads((built / "everything.flakes.hjson").read_text())
    attributes = table_column(section(FORMATS, "Tracks: hjson"))
    assert cache["header"]["attrib_name"] == attributes
    points = (built / "everything.flakes.pcache").read_text().splitlines()
    properties = [line.split()[2] for line in points if line.startswith("property float ")]
    assert properties == table_column(section(FORMATS, "Tracks: pcache"))


def test_light_has_the_keys_of_its_table(built: Path) -> None:
    light = json.loads((built / "everything.light.json").read_text())
    assert list(light["frames"][0]) == table_column(section(FORMATS, "Light"))


def test_a_tpsheet_has_the_header_and_fields_of_its_tables(built: Path) -> None:
    header, fields = section(FORMATS, "tpsheet").split("| field |")
    lines = (built / "pages.tpsheet").read_text().splitlines()
    written = [line.partition("=")[0] for line in lines if line.startswith(":")]
    assert written == table_column(header)
    assert len(lines[-1].split(";")) == len(table_column("| field |" + fields))


def test_the_style_sheet_has_a_class_for_each_animation_and_frame(built: Path) -> None:
    text = (built / "pages.css").read_text()
    assert "\n.pages {" in text
    assert all(f"\n.pages-000{i} {{" in text for i in range(6))


def test_godots_arrays_are_those_of_the_tables(built: Path) -> None:
    arrays, numbers = section(FORMATS, "Godot").split("| number of a row |")
    text = (built / "everything_flakes.tres").read_text()
    resource = dict(re.findall(r"^(\w+) = ([^\n]*)", text.partition("[resource]")[2], re.M))
    assert list(resource) == ["script", *table_column(arrays)]
    row = resource["rows"].removeprefix("PackedFloat32Array(").rstrip(",").split(",")
    in_plane, in_space = numbers.split("| number of a row in space |")
    assert len(row) == len(table_column("| number of a row |" + in_plane))
    text = (built / "winds_flakes_3d.tres").read_text()
    row = text.partition("rows = PackedFloat32Array(")[2].splitlines()[0].rstrip(",").split(",")
    assert len(row) == len(table_column("| number of a row |" + in_space))


def test_unitys_bytes_are_as_their_tables_say(built: Path) -> None:
    magic, animation, row = (
        "<" + "".join(map(code_of, part.splitlines()))
        for part in re.split(r"\n\n(?=then of|and after)", section(FORMATS, "Unity"))
    )
    data = (built / "everything.flakes.bytes").read_bytes()
    assert struct.unpack_from(magic, data) == (b"FAFL", 2, 1)
    at = struct.calcsize(magic)
    (length,) = struct.unpack_from("<i", data, at)
    assert data[at + 4 : at + 4 + length] == b"everything"
    fps, loop, hard, rounds, _, _, frames = struct.unpack_from(
        animation.replace("i", "", 1), data, at + 4 + length
    )
    assert (fps, loop, hard, rounds, frames) == (24, 1, 0, 1, 6)
    at += 4 + length + struct.calcsize(animation) - 4
    counts = struct.unpack_from(f"<{frames}i", data, at)
    assert at + 4 * frames + sum(counts) * struct.calcsize(row) == len(data)


def code_of(line: str) -> str:
    """Return the codes of ``struct`` for the fields in a line of a table."""
    codes = {"int32": "i", "float32": "f", "float16": "e", "4 bytes": "4s"}
    kind = line.split("|")[2].strip() if line.startswith("|") else ""
    return codes[kind] * len(table_column(line)) if kind in codes else ""


def test_templates_see_what_their_page_lists(built: Path) -> None:
    context = context_of(read_atlas(built / "everything.json").sheet)
    of_atlas, of_frame = page_text("templates/README.md").split("and of a frame:")
    listed = table_column(of_atlas)
    assert set(context) <= set(listed)
    assert set(context["frames"][0]) == set(table_column(of_frame.partition("Folders here")[0]))

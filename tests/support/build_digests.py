"""The SHA-256 of every file that a broad set of builds writes: has a change moved a byte?

Builds the ready recipes, the ten real clips under default settings with every export and
track format, and recipes that reach what those do not: members, views, scales, grids, each kind of
map, each way a clip is arranged. Only the command line is used, so that the program inside may be
rearranged at will. Run by hand before and after such a change:

    python -m tests.support.build_digests write digests.json
    python -m tests.support.build_digests compare digests.json

The digest of the tool itself, which manifests hold, is left out: it changes with every edit. So is
the class of CPU, which is the machine's.
"""

import argparse
import hashlib
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import yaml

from fire_atlas.core.shipped import shipped

_EXPORTS = ["json", "json-array", "phaser", "aseprite", "css", "tpsheet", "godot", "unity"]
_TRACKS = ["json", "csv", "pcache", "hjson", "light"]
_EVERY_FORMAT = {"exports": _EXPORTS, "tracks": _TRACKS}
_NOT_STRAIGHT = {"exports": [name for name in _EXPORTS if name != "css"], "tracks": _TRACKS}
_SEVERAL = {"exports": [name for name in _EXPORTS if name != "aseprite"], "tracks": _TRACKS}

_FRAMES = {"path": "campfire", "fps": 24}
_SMALL = {"path": "campfire", "fps": 24, "height": 120, "count": 16}
_SILK = {"kind": "silk", "width": 64, "height": 96}
_TEMPLATE = "{% for f in frames %}{{ f.name }} {{ f.x }} {{ f.y }} {{ motion }}\n{% endfor %}"

_RECIPES: dict[str, dict[str, Any]] = {
    "scales": {"source": _SMALL, "atlas": {"scales": [1, 0.5, 0.25]}, **_EVERY_FORMAT},
    "several_pages": {
        "source": _FRAMES,
        "atlas": {"max_size": 600, "scales": [1, 0.5]},
        **_SEVERAL,
    },
    "unity_grid": {
        "source": _SMALL,
        "maps": {"motion": "unity", "flame": True, "flakes": True},
        "atlas": {"layout": "grid", "scales": [1, 0.5], "pot": True},
        **_EVERY_FORMAT,
    },
    "godot_grid": {
        "source": _SMALL,
        "maps": {"motion": "godot"},
        "atlas": {"layout": "grid", "alpha": "premultiplied"},
        "timeline": {"fps": 12},
        **_NOT_STRAIGHT,
    },
    "unreal_grid": {
        "source": _SMALL,
        "maps": {"motion": "unreal"},
        "atlas": {"layout": "grid", "alpha": "additive", "blend_space": "linear"},
        "exports": ["json", "unity", {"template": "list.j2", "to": "{{ name }}.txt"}],
        "tracks": _TRACKS,
    },
    "packed_motion": {
        "source": _SMALL,
        "maps": {"motion": "godot", "flakes": True},
        "exports": ["json", {"template": "list.j2", "to": "{{ name }}.txt"}],
        "timeline": {"frames": 40},
    },
    "flakes_apart": {
        "source": _SMALL,
        "exports": ["json", "godot"],
        "tracks": ["json", "light"],
        "atlas": {"alpha": "premultiplied", "scales": [1, 0.5]},
        "flakes": {"bake": False},
    },
    "unity_options": {
        "source": _SMALL,
        "exports": [
            {"unity": {"namespace": "Game.Fire", "assembly": True, "pixels_per_unit": 50.0}}
        ],
        "atlas": {"alpha": "premultiplied"},
        "flakes": {"bake": False, "sprite": "pixel"},
    },
    "webp": {
        "source": _SMALL,
        "atlas": {"format": "webp", "rotate": True, "extrude": 1, "border": 3, "square": True},
        "exports": ["json", "json-array"],
    },
    "small_png": {
        "source": _SMALL,
        "atlas": {"compression": "small", "bleed": 4, "trim": "animation", "multiple_of": 4},
        "flakes": "none",
    },
    "blurred_flame": {
        "source": _SMALL,
        "flakes": "none",
        "motion_blur": {"flame": True, "shutter": 2.0},
        "tracks": ["light"],
    },
    "only_packs": {
        "source": {"path": "campfire", "count": 8},
        "flakes": "none",
        "motion_blur": "none",
        "maps": {"motion": "godot"},
        **_EVERY_FORMAT,
    },
    "pixel_sheet": {
        "source": {"path": "pixel_flame.png", "grid": {"columns": 8, "rows": 1}},
        "flakes": {"sprite": "pixel", "edge": "crop"},
        "composite": {"palette": "clip", "blend": "over"},
        "exports": _EXPORTS,
    },
    "wind_gusts": {
        "source": _SMALL,
        "wind": {"gusts": {"mean": 2.0, "strength": 1.0, "period": 0.5}},
        "buoyancy": {"projection": True, "turbulence": 0.6},
        "composite": {"blend": "screen"},
        "motion_blur": {"flame": True},
        "flakes": {"glow": 1.0},
    },
    "wind_keyframes": {
        "source": {"path": "torch.gif", "count": 20},
        "wind": {"keyframes": [{"t": 0.0, "level": 0.0}, {"t": 0.5, "level": 3.0}]},
        "timeline": {"loop": "none", "tail": True},
        "tracks": _TRACKS,
    },
    "paper": {
        "source": _SMALL,
        "features": {"preset": "paper"},
        "buoyancy": {"motion": "features"},
        "tracks": _TRACKS,
    },
    "crossfade": {"source": _SMALL, "timeline": {"loop": "crossfade", "overlap": 4}},
    "pingpong": {"source": _SMALL, "timeline": {"loop": "pingpong"}, "tracks": _TRACKS},
    "slowed": {"source": _SMALL, "timeline": {"fps": 30, "frames": 60}},
    "short_loop": {
        "source": {"path": "campfire", "fps": 60, "count": 6, "height": 96},
        "flakes": {"life": [0.5, 1.5], "rate": 60, "bake": False},
        **_EVERY_FORMAT,
    },
    "still": {"source": {"path": "campfire/0000.png"}, **_EVERY_FORMAT},
    "silk_views": {
        "source": _SILK,
        "views": {"count": 3, "elevation": 10},
        "timeline": {"frames": 12},
        "atlas": {"scales": [1, 0.5], "alpha": "premultiplied"},
        "maps": {"flame": True, "normals": True, "depth": True},
        **_NOT_STRAIGHT,
    },
    "silk_parts": {
        "source": {
            **_SILK,
            "fuel": "gas",
            "texture": {"path": "torch.gif"},
            "intruders": [{"shape": "sphere", "at": [0.1, 0.3, 0.0], "radius": 0.08}],
        },
        "wind": {"level": 2.0, "direction": "left"},
        "timeline": {"frames": 10, "loop": "none"},
        "tracks": _TRACKS,
    },
    "profile_views": {
        "source": {"kind": "profile", "path": "torch.gif", "height": 96},
        "views": {"count": 2},
        "timeline": {"frames": 16, "fps": 20},
        "wind": {"level": 2.0},
        "maps": {"motion": "godot"},
        "tracks": _TRACKS,
    },
    "learnt": {
        "source": {"kind": "profile", "path": "candle.profile.json", "height": 96},
        "timeline": {"frames": 16, "loop": "none"},
    },
    "meshes": {
        "source": _SMALL,
        "atlas": {"mesh": {"vertices": 8}},
        "exports": ["json", "godot", "unity"],
    },
    "heat": {
        "source": _SMALL,
        "atlas": {"pixels": "heat", "ramp": ["learnt", "soul"]},
        "exports": ["json", "godot", "unity"],
    },
    "heat4": {
        "source": _SMALL,
        "atlas": {"pixels": "heat4", "alpha": "additive"},
        "exports": ["json"],
    },
    "ramps": {"source": _SMALL, "composite": {"ramp": ["soul", "gas"]}, **_EVERY_FORMAT},
    "every_map": {
        "source": {"path": "explosion", "fps": 24, "height": 120},
        "timeline": {"loop": "none"},
        "atlas": {"alpha": "premultiplied"},
        "maps": {"motion": "godot", "flame": True, "flakes": True, "haze": True, "smoke": True},
        "exports": ["json", "godot", "unity"],
    },
    "gpu": {
        "source": _SMALL,
        "atlas": {"gpu": ["bc7.dds", "astc-6x6.ktx2", "etc2.ktx2"], "alpha": "premultiplied"},
    },
    "cover_full": {"source": _SMALL, "atlas": {"alpha": "premultiplied", "cover": "full"}},
    "levels_of_wind": {
        "source": {"kind": "profile", "path": "torch.gif", "height": 96},
        "wind": {"levels": [0, 3]},
        "timeline": {"frames": 12, "fps": 12},
        **_SEVERAL,
    },
    "sprites": {
        "source": {"kind": "sprites", "path": ["campfire", "pixel_flame.png"]},
        "exports": ["json", "godot", "unity", "css"],
    },
    "silk_tile": {
        "source": {
            **_SILK,
            "width": 96,
            "sheets": [{"arrangement": "line", "tile": True, "count": 5}],
        },
        "timeline": {"frames": 10},
    },
    "gas": {
        "source": {"kind": "fluid", "height": 96, "resolution": "draft", "radius": 0.25},
        "views": {"count": 2},
        "timeline": {"frames": 8},
        "maps": {"smoke": True},
        **_SEVERAL,
    },
    "member_a": {"source": _SMALL, "exports": []},
    "member_b": {"source": {"path": "torch.gif", "count": 12}, "flakes": "none", "exports": []},
    "members": {
        "source": {"path": "fireball"},
        "atlas": {"members": ["member_a.yaml", "member_b.yaml"], "scales": [1, 0.5]},
        "maps": {"flame": True},
        **_EVERY_FORMAT,
    },
    "member_pages": {
        "atlas": {"members": ["member_a.yaml", "member_b.yaml"], "max_size": 512},
        "exports": ["json", "phaser", "godot", "unity"],
        "tracks": ["json", "hjson"],
    },
}  # fmt: skip
"""Recipes by name, on inputs that the project ships."""


def main() -> int:
    """Write the digests, or compare with those written before; 1 where they differ."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("action", choices=["write", "compare"])
    parser.add_argument("file", type=Path)
    parser.add_argument("--jobs", default="2")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        digests = dict(_digests(Path(folder), arguments.jobs))
    if arguments.action == "write":
        arguments.file.write_text(json.dumps(digests, indent=1) + "\n", encoding="utf-8")
        print(f"{len(digests)} files")
        return 0
    before = json.loads(arguments.file.read_text(encoding="utf-8"))
    changed = sorted(
        name for name in before.keys() | digests.keys() if before.get(name) != digests.get(name)
    )
    for name in changed:
        state = "gone" if name not in digests else "new" if name not in before else "changed"
        print(f"{state}: {name}")
    print(f"{len(digests)} files, {len(changed)} differ")
    return 1 if changed else 0


def _digests(work: Path, jobs: str) -> Iterator[tuple[str, str]]:
    """Build everything below the empty folder ``work`` and yield each file's name and digest."""
    for name in sorted(path.stem for path in shipped("recipes").glob("*.yaml")):
        _run("init", name, work / "ready")
    for folder, recipes in {"recipes": _RECIPES, "clips": _clip_recipes()}.items():
        (work / folder).mkdir()
        for name, values in recipes.items():
            text = yaml.safe_dump(values, sort_keys=False)
            (work / folder / f"{name}.yaml").write_text(text, encoding="utf-8")
    shutil.copytree(shipped("samples"), work / "recipes", dirs_exist_ok=True)
    (work / "recipes" / "list.j2").write_text(_TEMPLATE, encoding="utf-8")
    _run("learn", work / "recipes" / "candle", "-o", work / "recipes" / "candle.profile.json")
    yield from _of_folder(work / "recipes", work, ["candle.profile.json", "candle.profile.png"])
    for folder in ("ready", "recipes", "clips"):
        _run("build", work / folder, "--jobs", jobs, "-q")
        build = work / folder / "build"
        yield from _of_folder(build, work, sorted(path.name for path in build.iterdir()))


def _clip_recipes() -> dict[str, dict[str, Any]]:
    """Return a recipe for each real clip, with all that can be written of it."""
    recipes = {}
    for meta in sorted(Path(os.environ["FIRE_ATLAS_CLIPS"]).glob("*/meta.json")):
        fps = json.loads(meta.read_text(encoding="utf-8"))["fps"]
        recipes[meta.parent.name] = {
            "source": {"path": str(meta.parent / "frames"), "fps": fps},
            "atlas": {"max_size": 8192},  # aseprite describes one page
            **_EVERY_FORMAT,
        }
    return recipes


def _run(*arguments: str | Path) -> None:
    command = [sys.executable, "-m", "fire_atlas", *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise SystemExit(f"{' '.join(command)}\n{done.stderr}")


def _of_folder(folder: Path, root: Path, names: list[str]) -> Iterator[tuple[str, str]]:
    for name in names:
        path = folder / name
        if path.is_file():
            data = _without_maker(path) if name.endswith(".manifest.json") else path.read_bytes()
            yield path.relative_to(root).as_posix(), hashlib.sha256(data).hexdigest()


def _without_maker(manifest: Path) -> bytes:
    """Return a manifest without the digest of the tool and the class of CPU that made it."""
    document = json.loads(manifest.read_bytes())
    del document["made_by"]
    document["statistics"].pop("cpu", None)
    return json.dumps(document).encode()


if __name__ == "__main__":
    sys.exit(main())

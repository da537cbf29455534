"""Mutated recipes over sound inputs: ``check``, ``build --dry-run`` and ``build`` refuse the same.

A build is stopped where it would decode or simulate its first frame: whatever it refuses until
then, ``check`` has to refuse with the same exit code and message, and nothing that it lets pass.
"""

import contextlib
import json
import re
import tempfile
from collections import Counter
from pathlib import Path
from typing import Any, NoReturn
from unittest.mock import patch

import numpy as np
import yaml

from tests.campaign import corpus
from tests.campaign.mutations import Chance, spoilt_bytes, spoilt_json, spoilt_text

_COUNT = 2_000
"""Recipes of a whole campaign."""

_FIRST_FRAMES = (
    "fire_atlas.sources.images._decoded",
    "fire_atlas.sources.animated._play",
    "fire_atlas.sources.video.decode_video",
    "fire_atlas.generators.silk.renderer.simulate",
    "fire_atlas.generators.profile.fire.calibrate",
)
"""What decodes or simulates the first frame of each kind of source."""


class FirstFrame(BaseException):
    """A build has come to its first frame."""


def run(count: int | None, seed: int) -> list[str]:
    """Compare the commands on ``count`` recipes; return what they disagree on."""
    results, faults = Counter[str](), list[str]()
    with tempfile.TemporaryDirectory(prefix="agreement-") as name:
        folder = Path(name)
        recipes = _write_inputs(folder)
        (folder / "out").mkdir()  # some errors list what lies beside the recipe
        for kind, recipe in recipes.items():
            path = folder / "case.yaml"
            path.write_text(json.dumps(recipe), encoding="utf-8")
            if (found := _check(path)) != (0, []):
                faults.append(f"{kind}, as it is: {found}")
        for number in range(count or _COUNT):
            chance = np.random.default_rng([seed, number])
            kind = list(recipes)[number % len(recipes)]
            path = folder / "case.yaml"
            path.write_bytes(_mutated({"seed": 1, **recipes[kind]}, chance))
            checked, dry, built = _check(path), _dry_run(path), _build(path, folder / "out")
            results[f"{kind}: {'refused' if built[0] else 'let pass'}"] += 1
            if not checked == dry == built:
                faults.append(
                    f"case {number} ({kind}):\n{path.read_text(errors='replace')[:2000]}\n"
                    f"check {checked}\ndry-run {dry}\nbuild {built}"
                )
    for result, times in sorted(results.items()):
        print(f"{times:7} {result}")
    return faults


_Verdict = tuple[int, list[str]]
"""Exit code of a command, and its errors."""


def _check(path: Path) -> _Verdict:
    return _verdict(*corpus.command("check", path, "-q"))


def _dry_run(path: Path) -> _Verdict:
    return _verdict(*corpus.command("build", path, "--dry-run", "-o", path.parent / "out", "-q"))


def _build(path: Path, out: Path) -> _Verdict:
    with contextlib.ExitStack() as stack:
        for place in _FIRST_FRAMES:
            stack.enter_context(patch(place, _stop))
        try:
            return _verdict(*corpus.command("build", path, "-o", out, "-q"))
        except FirstFrame:
            return 0, []


def _stop(*_: object, **__: object) -> NoReturn:
    raise FirstFrame


def _verdict(code: int, said: str) -> _Verdict:
    return code, [line for line in said.splitlines() if line.startswith("error: ")]


def _mutated(recipe: dict[str, Any], chance: Chance) -> bytes:
    text = yaml.safe_dump(recipe).encode()
    match int(chance.integers(0, 6)):
        case 0:
            return spoilt_text(text, chance)
        case 1:
            return spoilt_bytes(text, chance)
        case 2:
            return spoilt_json(json.dumps(recipe).encode(), chance)
    return _with_another_number(text.decode(), chance).encode()


def _with_another_number(text: str, chance: Chance) -> str:
    """Return a recipe with one of its numbers changed, a little or by far."""
    numbers = list(re.finditer(r"-?\d+(\.\d+)?", text))
    found = numbers[int(chance.integers(0, len(numbers)))]
    number = float(found[0]) * float(chance.choice([0, 0.5, 1, 2, 10, 1000, -1]))
    number += float(chance.choice([0, 0, 1, -1]))
    shown = f"{number:g}" if "." in found[0] else str(int(number))
    return text[: found.start()] + shown + text[found.end() :]


def _write_inputs(folder: Path) -> dict[str, dict[str, Any]]:
    """Write sound inputs of every kind, and return recipes that use them, by their kind."""
    corpus.write_profile(folder)
    for name, write in (("images", corpus.write_images), ("videos", corpus.write_videos)):
        (folder / name).mkdir()
        write(folder / name)
    corpus.write_build(folder)
    (folder / "build").rename(folder / "atlas")
    (folder / "list.j2").write_text("{% for frame in frames %}{{ frame.name }}{% endfor %}")
    silk = {"rows": 8, "columns": 6, "width": 32, "height": 32, "stiffness": 1.0, "damping": 1.0}
    bobbing = [{"t": 0, "at": [0, 0, 0.3]}, {"t": 1, "at": [0.2, 0, 0.3]}]
    keyframes = [{"t": 0, "value": 1.0}, {"t": 1, "value": 1.5}, {"t": 2, "value": 1.0}]
    clip = {"path": "clip", "fps": 12, "start": 1, "count": 4, "crop": [2, 2, 12, 16]}
    return {
        "clip": {
            "source": {**clip, "height": 32, "matte": "alpha"},
            "timeline": {"loop": "pingpong", "frames": 6},
            "flakes": {"rate": 20, "life": [0.5, 1], "size": [0.01, 0.02]},
            "buoyancy": {"lift": 1.5, "drag": 1}, "wind": {"level": 2, "direction": "left"},
        },
        "crossfade": {
            "source": clip, "timeline": {"loop": "crossfade", "frames": 3, "overlap": 1, "fps": 12},
            "exports": ["json", {"template": "list.j2", "to": "{{ name }}.txt"}],
        },
        "packing": {
            "source": {"path": "clip/*.png"}, "flakes": "none", "motion_blur": "none",
            "atlas": {"max_size": 64, "layout": "grid", "padding": 2, "scales": [1, 0.5]},
            "exports": ["json", "css", "godot"], "maps": {"motion": "godot"},
        },
        "sprites": {
            "source": {"path": "images/still.*", "matte": "none"},
            "flakes": "none", "motion_blur": "none", "exports": ["json", "unity"],
        },
        "sheet": {
            "source": {"path": "images/still.png", "grid": {"cell": [5, 6], "spacing": 0}},
            "flakes": {"texture": {"path": "images/still.png", "grid": {"columns": 2, "rows": 1}}},
        },
        "animation": {
            "source": {"path": "images/moves.gif", "fps": 20, "start": 0},
            "timeline": {"frames": 5, "loop": "none"},
            "atlas": {"pixels": "heat", "ramp": ["soul", "images/still.png"], "max_size": 512},
        },
        "video": {
            "source": {"path": "videos/film.mp4", "height": 16, "crop": "auto"},
            "timeline": {"tail": 1.5, "loop": "none"}, "movies": ["webp"],
        },
        "atlas": {"source": {"path": "atlas/fire.json", "animation": "fire"}, "seed": 3},
        "layer": {"source": {"path": "images/light.exr", "black": "auto"}, "maps": {"haze": True}},
        "profile": {
            "source": {"kind": "profile", "path": "fire.profile.json", "slices": 2, "height": 24},
            "timeline": {"frames": 12, "fps": 24}, "wind": {"levels": [0, 2]},
        },
        "learnt": {
            "source": {"kind": "profile", "path": "learnt", "count": 10, "threshold": 90},
            "views": {"count": 2, "elevation": 10},
        },
        "silk": {
            "source": {
                "kind": "silk", **silk, "mass": 1.0, "pressure": {"keyframes": keyframes},
                "sheets": {"arrangement": "ring", "count": 3, "spread": 0.2},
                "intruders": [{"shape": "sphere", "keyframes": [*bobbing, {**bobbing[0], "t": 2}]}],
            },
            "timeline": {"frames": 48, "fps": 24},
        },
        "silk of a clip": {
            "source": {
                "kind": "silk", **silk,
                "texture": {"path": "learnt", "images": 5, "synthesis": "none"},
            },
            "timeline": {"frames": 8},
        },
        "members": {"atlas": {"members": ["fire.yaml"], "max_size": 256}, "exports": ["phaser"]},
    }  # fmt: skip

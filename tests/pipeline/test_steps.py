"""Each step of the line reads just what the table says: so it can be kept while that is the same.

What a step reads is observed, not declared: every key of a recipe that is looked up while the step
runs, or while its arguments are put together.
"""

import itertools
import json
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fire_atlas.core.progress import SilentProgress
from fire_atlas.core.shipped import shipped
from fire_atlas.pipeline import (
    animate,
    build,
    change_wind,
    contribute,
    fly_in_depth,
    pack_only,
    prepare,
)
from fire_atlas.pipeline.check import load_checked
from fire_atlas.pipeline.context import BuildOptions
from fire_atlas.recipe.base import Settings
from fire_atlas.recipe.keys import all_keys, blocks_at
from fire_atlas.recipe.tree import read_tree

CALLERS = (build, contribute, prepare, animate, change_wind, fly_in_depth)
"""The modules that call the steps of ``TABLE``."""

WHOLE = ("source", "views", "wind")
"""Sections that are read as a whole."""

ENCODING = {
    "atlas.alpha", "atlas.bits", "atlas.blend_space", "atlas.scales", "atlas.trim_threshold",
}  # fmt: skip
BLUR = {
    "motion_blur.flame", "motion_blur.shutter", "motion_blur.samples", "motion_blur.exaggeration",
}  # fmt: skip
MAPS = {
    "maps.motion", "maps.flame", "maps.flakes", "maps.emission", "maps.smoke", "maps.normals",
    "maps.depth",
}  # fmt: skip

FORM = {"maps.normals", "maps.depth"}

DECIDED = {
    "features.preset", "flakes.rate", "flakes.sparks", "flakes.size", "flakes.colors",
    "flakes.sprite",
    "composite.palette",
}  # fmt: skip
"""What the class of a fire decides, and whether it does."""

TABLE = {
    # The names of all outputs that are known before any work.
    "refuse_taken_names": {
        *MAPS, "maps.haze", "name", "exports", "tracks", "movies", "flakes", "views", "wind",
        "atlas.format", "atlas.gpu", "atlas.members", "atlas.pixels", "atlas.scales",
    },
    # Whether a recipe only packs decides what its source may be.
    "open_input": {
        "name", "seed", "source", "views", "wind", "flakes", "motion_blur", "motion_blur.flame",
        "timeline.frames", "timeline.fps", "timeline.loop", "atlas.blend_space", "atlas.max_size",
    },
    "arrange": {
        "timeline.loop", "timeline.frames", "timeline.fps", "timeline.overlap", "timeline.tail",
        "flakes.life",
        "seed",  # of the motion of a few images
    },
    "study_flame": {
        "features.sigma", "features.epsilon", "features.n", "features.kappa_over",
        "features.kernel", "buoyancy.lift",
        # The class of the view before, which the statistics state.
        "motion_blur.flame", "flakes.fire_class", *DECIDED,
    },
    # What the automatic rate depends on, too.
    "classify": {
        *DECIDED, "seed", "flakes.fire_class", "flakes.alpha", "flakes.bursts", "flakes.life",
        "flakes.texture",
    },
    "analyse": {
        "seed", "wind", "motion_blur.flame", "maps.haze",
        "features.preset", "features.sigma", "features.kernel", "features.beta", "features.clamp",
        "buoyancy.motion", "buoyancy.cell", "buoyancy.coupling", "buoyancy.feature_force",
        "buoyancy.lift", "buoyancy.gravity", "buoyancy.drag", "buoyancy.viscosity",
        "buoyancy.turbulence", "buoyancy.projection",
        "flakes.rate", "flakes.bursts", "flakes.alpha", "flakes.life", "flakes.size",
        "flakes.sparks", "flakes.sprite", "flakes.bake", "flakes.rounds", "maps.flakes",
        "flakes.tint",  # of the flakes that are not born in the view from the side
        "flakes.texture",  # which is larger than embers
    },
    "simulate": {
        "seed", "buoyancy.gravity", "buoyancy.turbulence", "composite.blend",
        "composite.intensity",
        "motion_blur.shutter",
        "features.preset",  # whether flakes differ in brightness and focus
        "flakes.colors", "flakes.edge", "flakes.intensity", "flakes.lag", "flakes.life",
        "flakes.max", "flakes.own_motion", "flakes.scatter", "flakes.sprite", "flakes.stretch",
    },
    "simulate_in_depth": {
        "seed", "buoyancy.gravity", "buoyancy.turbulence",
        "features.preset",
        "flakes.edge", "flakes.lag", "flakes.life", "flakes.max", "flakes.own_motion",
        "flakes.scatter",
    },
    # Blur and haze, to know whether a view needs a field of its own.
    "see_flight": {
        "seed", "features.preset", "composite.blend", "composite.intensity", "motion_blur.flame",
        "maps.haze",
        "motion_blur.shutter", "flakes.colors", "flakes.edge", "flakes.intensity",
        "flakes.sprite", "flakes.stretch",
    },
    # The loop, only to say whether a tail would let flakes burn out; the source, only whether it is
    # pixel art, which engines do not filter.
    "render": {
        *ENCODING, *BLUR, *MAPS, "source", "timeline.loop", "tracks", "composite.blend",
        "composite.palette", "flakes.bake", "flakes.edge", "flakes.glow", "flakes.sprite",
    },
    "thumbnails_of_skipped_frames": {*BLUR, "maps.motion", "atlas.blend_space"},
    "measure_motion": {"maps.motion"},
    "measure_haze": {"maps.haze", "seed"},
    "pack_only": {
        *ENCODING, *(MAPS - FORM), "maps.haze", "source", "tracks", "flakes", "motion_blur", "name",
        "timeline.loop", "timeline.overlap", "timeline.tail",
    },
    # The class of the fire, which the statistics state.
    "page_content": {
        "name", "atlas.alpha", "atlas.blend_space", "atlas.pixels", "atlas.ramp",
        "flakes.fire_class",
    },
    "pack": {
        *MAPS, "name",
        "atlas.alpha", "atlas.bits", "atlas.blend_space", "atlas.border", "atlas.compression",
        "atlas.dedupe", "atlas.extrude", "atlas.format", "atlas.layout", "atlas.max_size",
        "atlas.multiple_of", "atlas.padding", "atlas.pivot", "atlas.pot", "atlas.rotate",
        "atlas.scales", "atlas.square", "atlas.trim",
        "atlas.mesh", "atlas.mesh.vertices", "atlas.trim_threshold", "atlas.gpu", "atlas.mips",
    },
    "write_images": {
        *MAPS, "maps.haze", "atlas.bleed", "atlas.compression", "atlas.extrude", "atlas.format",
        "atlas.padding", "atlas.quality",
        "atlas.alpha", "atlas.blend_space",  # of compressed textures
    },
    "product_of": {"tracks"},
    "movie_files": {"movies"},
    "open_texture": {"atlas.blend_space", "flakes", "flakes.texture", "flakes.texture.grid"},
    "prepared_texture": {
        "atlas.alpha", "atlas.bits", "atlas.blend_space", "atlas.scales", "flakes.size",
        "flakes.texture",
        "flakes.texture.play", "flakes.tint",
    },
}  # fmt: skip

SHIPPED = shipped("samples")
CLIP = {"path": str(SHIPPED / "campfire"), "count": 8, "height": 64}
RECIPES: dict[str, dict[str, Any]] = {
    "plain": {"source": {**CLIP, "sampling": "nearest"}},
    "everything": {
        "source": CLIP,
        "wind": {"keyframes": [{"t": 0.0, "level": 1.0}]},
        "timeline": {"fps": 12, "tail": True, "loop": "none"},
        "flakes": {"glow": 1.0, "edge": "crop"},
        "motion_blur": {"flame": True},
        "composite": {"palette": "clip"},
        "atlas": {
            "layout": "grid",
            "scales": [1, 0.5],
            "bleed": 2,
            "mesh": {"vertices": 6},
            "gpu": ["bc7.dds"],
        },
        "maps": {"motion": "godot", "flame": True, "flakes": True, "emission": "exr", "haze": True},
        "tracks": ["light", "json"],
    },
    "crossfaded": {"source": CLIP, "timeline": {"loop": "crossfade"}, "wind": {"gusts": {}}},
    "tracks": {
        "source": CLIP,
        "timeline": {"loop": "crossfade"},
        "flakes": {"bake": False},
        "seed": 3,
    },
    "texture": {"source": CLIP, "flakes": {"texture": str(SHIPPED / "pixel_flame.png")}},
    "heat": {"source": CLIP, "atlas": {"pixels": "heat", "ramp": ["learnt", "gas"]}},
    "silk": {
        "source": {"kind": "silk", "width": 48, "height": 64},
        "views": {"count": 2},
        "timeline": {"frames": 4},
    },
    "learnt": {
        "source": {"kind": "profile", "path": str(SHIPPED / "torch.gif"), "height": 64},
        "timeline": {"frames": 4},
    },
    "sprites": {
        "source": {"path": "art"},
        "flakes": "none",
        "motion_blur": "none",
        "maps": {"motion": "godot"},
    },
}
"""Recipes that take every branch, but that of several winds."""

SEVERAL_WINDS: dict[str, Any] = {
    "source": {"kind": "silk", "width": 48, "height": 64, "rows": 10, "columns": 8},
    "wind": {"levels": [0, 3]},
    "timeline": {"frames": 6},
}
BETWEEN_WINDS = {
    # The level of each loop, and of each state.
    "study_flame": {"wind", "timeline.loop"}, "page_content": {"wind"},
    # What is stated of the loop before; above, what is noted.
    "render": {"flakes.fire_class"},
}  # fmt: skip
"""What is looked up between the steps of a fire in several winds, by the step that comes next."""


class Reads:
    """The keys of a recipe that each step reads."""

    def __init__(self) -> None:
        self.of = defaultdict[str, set[str]](set)
        self._step: str | None = None
        self._between = set[str]()

    def forget(self) -> None:
        """Forget what was read outside of all steps."""
        self._between.clear()

    def key(self, key: str) -> None:
        """Note a key for the step that runs, or else for the next one: it is an argument."""
        (self._between if self._step is None else self.of[self._step]).add(key)

    def found(self) -> dict[str, set[str]]:
        """Return the keys that each step read; sections that are read as a whole by their name."""
        return {
            step: {key.partition(".")[0] if key.startswith(WHOLE) else key for key in keys}
            for step, keys in self.of.items()
        }

    def watched(self, name: str, step: Callable[..., Any]) -> Callable[..., Any]:
        """Return a step whose reads are noted."""

        def run(*arguments: Any, **named: Any) -> Any:
            self.of[name] |= self._between
            self._between, self._step = set(), name
            try:
                return step(*arguments, **named)
            finally:
                self._step = None

        return run


@pytest.fixture
def reads(monkeypatch: pytest.MonkeyPatch) -> Reads:
    """Watch what the steps of the builds of this test read."""
    seen, look_up = Reads(), Settings.__getattribute__
    places = {block: ".".join(path) for path in all_keys() for block in blocks_at(path)}

    def watched(block: Settings, name: str) -> Any:
        value = look_up(block, name)
        if name in type(block).model_fields and not isinstance(value, Settings):
            seen.key(f"{places.get(type(block), '')}.{name}".lstrip("."))
        return value

    monkeypatch.setattr(Settings, "__getattribute__", watched)
    imported_late = [("pack_only", pack_only)]  # by a function, from the module that has it
    for name, module in (*itertools.product(TABLE, CALLERS), *imported_late):
        if step := getattr(module, name, None):
            monkeypatch.setattr(module, name, seen.watched(name, step))
    return seen


def test_each_step_reads_just_its_keys(reads: Reads, tmp_path: Path) -> None:
    art = tmp_path / "art"
    art.mkdir()
    for i, frame in enumerate(sorted((SHIPPED / "campfire").glob("*.png"))[:4]):
        (art / f"{'ab'[i % 2]}_{i}.png").write_bytes(frame.read_bytes())
    for name, keys in RECIPES.items():
        build_watched(name, keys, tmp_path, reads)
    assert reads.found() == TABLE


def test_fire_in_several_winds_is_made_by_the_same_steps(reads: Reads, tmp_path: Path) -> None:
    build_watched("winds", SEVERAL_WINDS, tmp_path, reads)
    others = {step: keys - TABLE[step] for step, keys in reads.found().items()}
    assert {step: keys for step, keys in others.items() if keys} == BETWEEN_WINDS


def build_watched(name: str, keys: dict[str, Any], folder: Path, reads: Reads) -> None:
    recipe = folder / f"{name}.yaml"
    recipe.write_text(json.dumps(keys), encoding="utf-8")
    loaded = load_checked(read_tree(recipe))
    reads.forget()
    build.build(loaded, folder / "out", BuildOptions(2), SilentProgress())

"""Products for the exporter, and what it makes of them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fire_atlas.atlas.pages import build_sheets
from fire_atlas.atlas.sheet import AnimationFrames, AtlasSheet
from fire_atlas.effect.flakes.tracks import COLUMNS, SPAWN_COLUMNS, Tracks
from fire_atlas.formats.product import Product
from fire_atlas.pipeline.files.exports import exporter
from fire_atlas.recipe.output import Atlas, UnityExport, UnityOptions
from tests.support.sheets import FRAME, sprite_of


def some_tracks(frames: int = 3, fps: float = 24.0, *, loop: bool = True) -> Tracks:
    """Random flakes in the middle of the frame; one fewer in every next frame."""
    rng = np.random.default_rng(7)
    tables = []
    for i in range(frames):
        table = rng.uniform(0.2, 1, (max(5 - i, 0), len(COLUMNS)))
        table[:, 0] = np.arange(len(table))
        table[:, 1:5] *= FRAME
        table[:, 5] *= 16
        table[:, 6] += 1
        tables.append(table)
    spawns = np.zeros((5, len(SPAWN_COLUMNS)))
    return replace(Tracks.one_shot(fps, (FRAME, FRAME), 7, spawns, tables), loop=loop)


@dataclass(frozen=True, slots=True)
class Fire:
    """A product in the making."""

    animations: Mapping[str, int]
    name: str = "fire"
    tracks: bool = True
    baked: bool = False
    extra: int = 0

    def sheets(self, **atlas: Any) -> tuple[AtlasSheet, ...]:
        animations = [
            AnimationFrames(
                name,
                tuple(
                    sprite_of(8 + (3 * i) % 17, 9 + (5 * i) % 13, i % 7, i % 5, 20 * n + i + 1)
                    for i in range(count)
                ),
                1000 / (12 + n), n != 1, (30.0, 54.0),
            )
            for n, (name, count) in enumerate(self.animations.items())
        ]  # fmt: skip
        return build_sheets(self.name, animations, Atlas.model_validate(atlas))

    def product(self, existing: Mapping[str, bytes] | None = None, **atlas: Any) -> Product:
        tracks = {name: some_tracks(n) for name, n in self.animations.items() if self.tracks}
        baked = frozenset(tracks) if self.baked else frozenset[str]()
        lying = existing or {}
        return Product(self.sheets(**atlas), tracks, baked, lying.get)


def exported(product: Product, **options: Any) -> dict[str, bytes]:
    """Return the files of the export, by name."""
    made = exporter(UnityExport(unity=UnityOptions(**options)))(product)
    files = [(file.name, file.data) for file in made]
    assert len(dict(files)) == len(files), "a file written twice"
    return dict(files)


ALONE = Fire({"fire": 7})
SEVERAL = Fire({"walk": 4, "run": 3, "火 ; # 1": 1}, name="hero")


def kinds() -> Sequence[Any]:
    """Every kind of pages a recipe can ask for that Unity can show: a product's fire and atlas."""
    return (
        (ALONE, {}),
        (ALONE, {"alpha": "premultiplied", "blend_space": "linear"}),
        (ALONE, {"alpha": "additive", "pivot": [2.5, -1]}),
        (ALONE, {"max_size": 32, "dedupe": False, "alpha": "premultiplied"}),
        (ALONE, {"layout": "grid", "padding": 4}),
        (ALONE, {"scales": [1, 0.5, 0.25], "trim": "none"}),
        (SEVERAL, {"alpha": "premultiplied", "pot": True, "square": True, "extrude": 2}),
        (SEVERAL, {"trim": "animation", "max_size": 64}),
        (Fire({"fire": 3}, baked=True), {}),
        (Fire({"fire": 3}, tracks=False), {"alpha": "premultiplied"}),
    )

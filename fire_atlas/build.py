"""The whole tool in one function: recipe in, finished assets out."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fire_atlas.analysis import Analysis, analyse
from fire_atlas.atlas.encode import encode_sprite
from fire_atlas.atlas.layout import AtlasSheet, Sprite
from fire_atlas.atlas.pages import draw_page, lay_out
from fire_atlas.atlas.png import write_png
from fire_atlas.core.clip import Clip
from fire_atlas.core.progress import Progress
from fire_atlas.core.workers import Workers
from fire_atlas.effect import fly_flakes, render
from fire_atlas.exporters.registry import exporter, track_writer
from fire_atlas.field.buoyancy import lift_direction
from fire_atlas.flakes.tracks import Tracks
from fire_atlas.flame.study import FlameStudy, study_flame
from fire_atlas.interruption import Interruptible
from fire_atlas.manifest import Input, Output, describe, manifest_name, stale_outputs
from fire_atlas.recipe.effect import MotionBlur
from fire_atlas.recipe.load import LoadedRecipe
from fire_atlas.recipe.models import Recipe
from fire_atlas.sources.registry import open_source
from fire_atlas.staging import Staging
from fire_atlas.timeline.closing import arrange


@dataclass(frozen=True, slots=True)
class BuildReport:
    """What a build did.

    Attributes:
        files: The outputs, in the order they were written.
        timings: Seconds by stage.
        statistics: Figures about the result, as in the manifest.
    """

    files: tuple[Path, ...]
    timings: dict[str, float]
    statistics: dict[str, Any]


def build(loaded: LoadedRecipe, out: Path, jobs: int, progress: Progress) -> BuildReport:
    """Build one recipe into the folder ``out``: everything is written, or nothing is.

    Raises:
        FireAtlasError: Anything a person can mend; the previous outputs are whole.
        KeyboardInterrupt: A signal came. The previous outputs are whole, or the new ones are.
    """
    recipe, clock = loaded.recipe, _Clock()
    with (
        Interruptible(progress) as progress,
        Workers(jobs) as workers,
        Staging(out) as staging,
    ):
        with clock.measure("study"):
            clip = open_source(recipe.source, loaded.source_path, recipe.atlas.blend_space)
            progress.note(f"{clip.matte} matte: {clip.matte_reason}")
            # Hashed before they are read: what changes meanwhile is not up to date afterwards.
            inputs = list(workers.map(Input.of, clip.inputs))
            staging.keep([*clip.inputs, *loaded.tree.files])
            clip = arrange(clip, recipe.timeline, workers)
            study = study_flame(clip, recipe.features, lift_direction(recipe.buoyancy), workers)
        with clock.measure("analyse"):
            analysis = _analysis(clip, recipe, study, workers, progress)
        with clock.measure("fly"):
            tracks = _tracks(clip, recipe, analysis, progress)
        with clock.measure("render"):
            sprites = _sprites(clip, recipe, analysis, tracks, workers, progress)
        with clock.measure("pack"):
            sheet = lay_out(
                recipe.name, sprites, frame_size=(clip.width, clip.height), fps=clip.fps,
                settings=recipe.atlas, anchor=_anchor(clip, study),
            )  # fmt: skip
        with clock.measure("write"):
            outputs = _write_pages(sheet, sprites, staging, workers, progress)
            outputs += _write_exports(recipe, sheet, tracks, staging)
            statistics = _statistics(clip, sheet, tracks)
            manifest = describe(loaded.tree, recipe.model_dump_json(), inputs, outputs, statistics)
            outputs.append(_write(staging, manifest_name(recipe.name), "manifest", manifest))
            names = [output.name for output in outputs]
            staging.commit(stale_outputs(out, recipe.name, names))
    return BuildReport(tuple(out / name for name in names), clock.seconds, statistics)


def _analysis(
    clip: Clip, recipe: Recipe, study: FlameStudy, workers: Workers, progress: Progress
) -> Analysis | None:
    """Return what the effect needs to know, or None where a recipe only packs."""
    blurs_flame = isinstance(recipe.motion_blur, MotionBlur) and recipe.motion_blur.flame
    if recipe.flakes == "none" and not blurs_flame:
        return None
    return analyse(clip, recipe, study, workers, progress)


def _tracks(
    clip: Clip, recipe: Recipe, analysis: Analysis | None, progress: Progress
) -> Tracks | None:
    """Fly the flakes, where there are any: a blurred flame is analysed without them too."""
    if analysis is None or recipe.flakes == "none":
        return None
    return fly_flakes(clip, recipe, analysis, progress)


def _sprites(
    clip: Clip,
    recipe: Recipe,
    analysis: Analysis | None,
    tracks: Tracks | None,
    workers: Workers,
    progress: Progress,
) -> list[Sprite]:
    """Render and encode every frame in the pool; only trimmed bytes are kept."""
    progress.stage("render", clip.count)
    atlas = recipe.atlas

    def sprite(i: int) -> Sprite:
        pixels = render(i, clip, recipe, analysis, tracks)
        return encode_sprite(pixels, atlas.alpha, atlas.blend_space)

    sprites = []
    for finished in workers.map(sprite, range(clip.count)):
        sprites.append(finished)
        progress.advance()
    return sprites


def _anchor(clip: Clip, study: FlameStudy) -> tuple[float, float]:
    """Foot of the flame in 0..1 of the frame."""
    x, y = study.base
    return x / clip.width, y / clip.height


def _write_pages(
    sheet: AtlasSheet,
    sprites: list[Sprite],
    staging: Staging,
    workers: Workers,
    progress: Progress,
) -> list[Output]:
    """Draw and write one page after the other, so that only one is in memory."""
    progress.stage("write", len(sheet.pages))
    outputs = []
    for i, page in enumerate(sheet.pages):
        with staging.open(page.file) as file:
            write_png(file, draw_page(sheet, i, sprites), workers)
        outputs.append(Output(page.file, "page", staging.path(page.file)))
        progress.advance()
    return outputs


def _write_exports(
    recipe: Recipe, sheet: AtlasSheet, tracks: Tracks | None, staging: Staging
) -> list[Output]:
    files = [file for name in recipe.exports for file in exporter(name)(sheet)]
    if tracks is not None:
        files += [track_writer(name)(recipe.name, tracks) for name in recipe.tracks]
    return [_write(staging, file.name, file.role, file.data) for file in files]


def _write(staging: Staging, name: str, role: str, data: bytes) -> Output:
    with staging.open(name) as file:
        file.write(data)
    return Output(name, role, staging.path(name))


def _statistics(clip: Clip, sheet: AtlasSheet, tracks: Tracks | None) -> dict[str, Any]:
    area = sum(page.width * page.height for page in sheet.pages)
    used = sum(region.width * region.height for region in sheet.regions)
    statistics: dict[str, Any] = {
        "frames": clip.count,
        "frame_size": [clip.width, clip.height],
        "fps": round(clip.fps, 4),
        "matte": clip.matte,
        "pages": [[page.width, page.height] for page in sheet.pages],
        "occupancy": round(used / area, 4),
    }
    if tracks is not None:
        alive = [len(rows) for rows in tracks.frames]
        statistics["flakes"] = {
            "born": len(tracks.spawns),
            "alive_mean": round(float(np.mean(alive)), 2),
            "alive_most": max(alive),
        }
    return statistics


class _Clock:
    """Seconds spent in each stage."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}

    @contextmanager
    def measure(self, stage: str) -> Iterator[None]:
        start = time.perf_counter()
        yield
        self.seconds[stage] = round(time.perf_counter() - start, 4)

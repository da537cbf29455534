"""The whole tool in one function: recipe in, finished assets out."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from fire_atlas.atlas.drawing import Edges, draw_page
from fire_atlas.atlas.layout import AtlasSheet, Strip
from fire_atlas.atlas.pages import lay_out
from fire_atlas.channels.encoding import motion_encoding
from fire_atlas.channels.page import draw_motion_page
from fire_atlas.channels.sheet import margin_of, with_maps
from fire_atlas.core.clock import Clock
from fire_atlas.core.errors import OutputError
from fire_atlas.core.pixels import Bytes
from fire_atlas.core.progress import Progress
from fire_atlas.core.workers import Workers
from fire_atlas.effect.flakes.tracks import Tracks
from fire_atlas.formats.pages.page_file import write_page
from fire_atlas.formats.product import Product
from fire_atlas.formats.tracks.light import write_light
from fire_atlas.outputs.manifest import (
    Input,
    Output,
    describe,
    maker,
    manifest_name,
    refuse_others,
    stale_outputs,
)
from fire_atlas.outputs.staging import Staging
from fire_atlas.pipeline.describe import describe_product
from fire_atlas.pipeline.interruption import Interruptible
from fire_atlas.pipeline.part import Part, Stage, make_part
from fire_atlas.pipeline.writers import track_writer
from fire_atlas.recipe.load import LoadedRecipe
from fire_atlas.recipe.models import Recipe
from fire_atlas.recipe.output import Maps, missing_extra


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
    recipe, clock = loaded.recipe, Clock()
    with (
        Interruptible(progress) as progress,
        Workers(jobs) as workers,
        Staging(out) as staging,
    ):
        if missing := missing_extra(recipe.atlas):
            raise OutputError(missing)
        stage = Stage(workers, staging, progress, clock)
        made_by = workers.start(maker)
        templates = [Input.of(path) for path in loaded.templates.values()]
        staging.keep([*loaded.templates.values(), *loaded.tree.files])
        parts = [make_part(each, stage) for each in loaded.parts]
        with clock.measure("pack"):
            strips = [
                replace(strip, name=_title(strip.name, part, parts))
                for part in parts
                for strip in part.strips
            ]
            sheets = _lay_out(recipe, strips, parts)
            _tell_of_pages(sheets[0], progress)
        with clock.measure("write"):
            outputs = _write_pages(sheets, parts, recipe, stage)
            product = _product(sheets, loaded, parts, staging)
            outputs += _write_exports(loaded, product, staging)
            outputs += _write_tracks(recipe, product, staging)
            outputs += _write_lights(product, staging)
            inputs = [each for part in parts for each in part.inputs] + templates
            statistics = _statistics(parts, sheets[0])
            manifest = describe(
                loaded.tree, _resolved(loaded), inputs, outputs, statistics, made_by.result()
            )
            outputs.append(_write(staging, manifest_name(recipe.name), "manifest", manifest))
            names = [output.name for output in outputs]
            refuse_others(out, recipe.name, outputs)
            staging.commit(stale_outputs(out, recipe.name, names))
    return BuildReport(tuple(out / name for name in names), clock.seconds, statistics)


def _resolved(loaded: LoadedRecipe) -> str:
    """Return the recipe with all its defaults, and its members with theirs."""
    recipes = (loaded.recipe, *(member.recipe for member in loaded.members))
    return "\n".join(recipe.model_dump_json() for recipe in recipes)


def _title(animation: str, part: Part, parts: Sequence[Part]) -> str:
    """Name an animation of a part: where parts share the pages, the part's name goes before it."""
    is_only = len(parts) == 1 or [strip.name for strip in part.strips] == [part.name]
    return animation if is_only else f"{part.name}/{animation}"


def _product(
    sheets: tuple[AtlasSheet, ...],
    loaded: LoadedRecipe,
    parts: Sequence[Part],
    staging: Staging,
) -> Product:
    """Return what was made; flakes and light go by the name of their animation in the atlas."""
    tracks, baked = dict[str, Tracks](), set[str]()
    for each, part in zip(loaded.parts, parts, strict=True):
        titles = [_title(animation, part, parts) for animation in part.tracks]
        tracks |= zip(titles, part.tracks.values(), strict=True)
        if each.recipe.flakes != "none" and each.recipe.flakes.bake:
            baked.update(titles)
    lights = {
        _title(animation, part, parts): light
        for part in parts
        for animation, light in part.lights.items()
    }
    formats = loaded.recipe.tracks
    return Product(sheets, tracks, frozenset(baked), staging.existing, formats, lights)


def _tell_of_pages(sheet: AtlasSheet, progress: Progress) -> None:
    if len(sheet.pages) > 1:
        progress.note(
            f"needs {len(sheet.pages)} pages; a larger atlas.max_size, a smaller source.height or "
            f"fewer frames would spare clients from loading several"
        )


def _lay_out(
    recipe: Recipe, strips: Sequence[Strip], parts: Sequence[Part]
) -> tuple[AtlasSheet, ...]:
    """Decide where every frame goes, on the pages and on what lies beside them."""
    motions = [motion for part in parts for motion in part.motions]
    encoding = None if recipe.maps.motion == "none" else motion_encoding(recipe.maps.motion)
    sheets = lay_out(
        recipe.name, strips, recipe.atlas, margin=margin_of(motions), shares=recipe.maps == Maps()
    )
    return tuple(with_maps(sheet, recipe.maps.layers, motions, encoding) for sheet in sheets)


def _write_pages(
    sheets: Sequence[AtlasSheet], parts: Sequence[Part], recipe: Recipe, stage: Stage
) -> list[Output]:
    """Draw and write one page after the other, so that only one is in memory."""
    images = [image for sheet in sheets for image in _images(sheet, sheets, parts, recipe)]
    stage.progress.stage("write", len(images))
    outputs = []
    for name, role, draw in images:
        with stage.staging.open(name) as file:
            write_page(file, draw(), recipe.atlas, stage.workers)
        outputs.append(Output(name, role, stage.staging.path(name)))
        stage.progress.advance()
    return outputs


def _images(
    sheet: AtlasSheet, sheets: Sequence[AtlasSheet], parts: Sequence[Part], recipe: Recipe
) -> Iterator[tuple[str, str, Callable[[], Bytes]]]:
    """Yield the name and role of every image of a sheet, and what draws it: pages, then maps."""
    edges, scale = Edges.of(recipe.atlas, sheet.scale), sheets.index(sheet)
    drawn = [frame[scale] for part in parts for frame in part.sprites]
    for i, page in enumerate(sheet.pages):
        yield page.file, "page", partial(draw_page, sheet, i, drawn, edges)
    for layer in recipe.maps.layers:
        drawn = [frame[scale] for part in parts for frame in part.layers[layer]]
        for i, name in enumerate(sheet.map(layer).files):
            yield name, "map", partial(draw_page, sheet, i, drawn, edges)
    if recipe.maps.motion != "none":
        encoding = motion_encoding(recipe.maps.motion)
        moving = [each for part in parts for motion in part.motions for each in motion.frames()]
        for i, name in enumerate(sheet.map("motion").files):
            yield name, "map", partial(draw_motion_page, sheet, i, moving, encoding, edges)


def _write_exports(loaded: LoadedRecipe, product: Product, staging: Staging) -> list[Output]:
    files = describe_product(loaded.recipe.exports, product, loaded.templates)
    return [_write(staging, file.name, file.role, file.data) for file in files]


def _write_tracks(recipe: Recipe, product: Product, staging: Staging) -> list[Output]:
    """Write the flakes of each animation."""
    files = (
        track_writer(kind)(product.stem(animation), tracks)
        for animation, tracks in product.tracks.items()
        for kind in recipe.tracks
        if kind != "light"
    )
    return [_write(staging, file.name, file.role, file.data) for file in files]


def _write_lights(product: Product, staging: Staging) -> list[Output]:
    """Write the light of each animation, where it is asked for."""
    files = (
        write_light(product.stem(animation), light) for animation, light in product.lights.items()
    )
    return [_write(staging, file.name, file.role, file.data) for file in files]


def _write(staging: Staging, name: str, role: str, data: bytes) -> Output:
    with staging.open(name) as file:
        file.write(data)
    return Output(name, role, staging.path(name))


def _statistics(parts: Sequence[Part], sheet: AtlasSheet) -> dict[str, Any]:
    """Return figures about the pages, and about the one part or each of several."""
    area = sum(page.width * page.height for page in sheet.pages)
    places = {(region.page, region.x, region.y): region for region in sheet.regions}
    used = sum(region.width * region.height for region in places.values())
    pages = {
        "pages": [[page.width, page.height] for page in sheet.pages],
        "occupancy": round(used / area, 4),
    }
    if len(parts) == 1:
        return {**parts[0].statistics, **pages}
    members = {part.name: part.statistics for part in parts}
    return {"frames": len(sheet.regions), **pages, "members": members}

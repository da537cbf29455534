"""Hash and open the inputs of a recipe: footage, sprites, or generated fire."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from fire_atlas.core.clip import Clip
from fire_atlas.core.context import BuildContext
from fire_atlas.core.errors import SourceError
from fire_atlas.core.fire_in_wind import FireInWind
from fire_atlas.core.pixels import Pixels
from fire_atlas.core.workers import Workers
from fire_atlas.outputs.dependencies import inputs_of, recipe_files
from fire_atlas.outputs.digest import HashedFile
from fire_atlas.outputs.staging import Staging
from fire_atlas.recipe.effect import RampHue
from fire_atlas.recipe.load import LoadedRecipe
from fire_atlas.recipe.located import located
from fire_atlas.recipe.problem import KeyPath
from fire_atlas.recipe.ramps import FLAME_RAMP
from fire_atlas.recipe.source import FramesSource, SpritesSource
from fire_atlas.sources.registry import open_source, open_source_in_wind

if TYPE_CHECKING:
    from fire_atlas.heat.ready import RampLight
    from fire_atlas.sources.sprites import Sprites

Opened: TypeAlias = "Mapping[str, Clip] | FireInWind | Sprites"
"""An opened source: clips by the name of their animation, one for each view; a fire in several
winds; or sprites, which are only packed."""


def source_key(loaded: LoadedRecipe) -> KeyPath:
    """Return the key that errors about a recipe's source are about if they name none."""
    return next(iter(loaded.source_files), ("source",))


def open_input(loaded: LoadedRecipe, context: BuildContext) -> Opened:
    """Open a recipe's source."""
    opened = _open(loaded, context)
    first = _first(opened)
    if isinstance(first, Clip):
        context.progress.note(f"{first.matte} matte: {first.matte_reason}")
    for note in first.notes:
        context.progress.note(note)
    if isinstance(first, Clip) and _is_one_picture(loaded, first):
        _note_likely_sheet(first, context)
    return opened


def _open(loaded: LoadedRecipe, context: BuildContext) -> Opened:
    workers, max_pixels = context.workers, context.max_pixels
    if loaded.recipe.wind.levels:
        return open_source_in_wind(loaded, workers, max_pixels)
    if isinstance(loaded.recipe.source, SpritesSource):
        from fire_atlas.sources.sprites import open_sprites

        return open_sprites(loaded, workers, max_pixels)
    return open_source(loaded, workers, max_pixels, context.progress)


def open_texture(loaded: LoadedRecipe, context: BuildContext) -> list[Pixels]:
    """Return the cells of the texture of a recipe's flakes, (h, w, 4) each; none without one.

    Raises:
        SourceError: It is not an image, broken or empty.
    """
    flakes = loaded.recipe.flakes
    if flakes == "none" or flakes.own_texture is None:
        return []
    from fire_atlas.sources.flake_texture import read_cells

    ((key, path),) = loaded.texture_files.items()
    with located(loaded.tree, key):
        space = loaded.recipe.atlas.blend_space
        return read_cells(flakes.own_texture, path, space, context.max_pixels)


def open_ramps(loaded: LoadedRecipe, context: BuildContext) -> "dict[str, RampLight]":
    """Return the colours that a recipe gives its fire, by the names of their animations: one
    without a name if it states one ramp; none if the fire keeps its own.

    Raises:
        SourceError: An image of a ramp cannot be read.
    """
    composite, space = loaded.recipe.composite, loaded.recipe.atlas.blend_space
    if not composite.ramps:
        return {}
    from fire_atlas.atlas.sheet import RAMP_WIDTH
    from fire_atlas.heat.ready import colours_light, hue_light, ready_light
    from fire_atlas.sources.ramp_image import read_ramp

    lights: dict[str, RampLight] = {}
    for place, (name, ramp) in enumerate(composite.ramps.items()):
        key = (*FLAME_RAMP, place) if composite.listed_ramps else FLAME_RAMP
        if isinstance(ramp, RampHue):
            lights[name] = hue_light(ramp.hue)
        elif isinstance(ramp, tuple):
            lights[name] = colours_light(ramp)
        elif key not in loaded.flame_ramps:
            lights[name] = ready_light(ramp)
        else:
            with located(loaded.tree, key):
                path = loaded.flame_ramps[key]
                lights[name] = read_ramp(path, RAMP_WIDTH, space, context.max_pixels)
    return lights


def _is_one_picture(loaded: LoadedRecipe, clip: Clip) -> bool:
    """Whether a clip is one whole image file, not a frame that was chosen from several."""
    source = loaded.recipe.source
    is_file = isinstance(source, FramesSource) and source.grid is None
    return is_file and clip.count == len(clip.inputs) == 1


def _note_likely_sheet(clip: Clip, context: BuildContext) -> None:
    from fire_atlas.sources.json_atlas import describes
    from fire_atlas.sources.sheet import likely_grid

    image = clip.inputs[0]
    if describes(beside := image.with_suffix(".json"), image):
        context.progress.note(
            f"{image.name} is read as one frame, but {beside.name} beside it describes frames in "
            f"it; to use these, give that as source.path"
        )
    elif found := likely_grid(clip.read(0)[..., 3]):
        columns, rows = found
        context.progress.note(
            f"{clip.inputs[0].name} looks like a sheet of {columns} x {rows} frames, but is read "
            f"as one; if it is a sheet, set source.grid: {{columns: {columns}, rows: {rows}}}"
        )


def open_alone(loaded: LoadedRecipe, max_pixels: int) -> Opened:
    """Open a recipe's source outside of a build, to read its frames."""
    with Workers(1) as workers:
        return open_input(loaded, BuildContext.silent(workers, max_pixels))


def hash_inputs(loaded: LoadedRecipe, staging: Staging, workers: Workers) -> list[HashedFile]:
    """Hash every source, texture and template file before any of them is opened.

    Also protects these files and the recipes from being overwritten by outputs. A file that changes
    from now on makes the build stale, because the manifest has the hash taken here.

    Raises:
        SourceError: A file is missing, or cannot be read.
    """
    files = inputs_of(loaded.tree)
    staging.protect([*files, *recipe_files(loaded.tree)])
    return list(workers.map(HashedFile.of, files))


def input_files(opened: Opened, loaded: LoadedRecipe) -> tuple[Path, ...]:
    """Return the files of an opened source, in playing order, then the texture of flakes."""
    return (*_first(opened).inputs, *loaded.texture_files.values())


def check_inputs(
    hashed: Sequence[HashedFile],
    opened: Sequence[Path],
    loaded: LoadedRecipe,
    context: BuildContext,
) -> None:
    """Check after all inputs were read that none has changed since it was hashed.

    ``opened`` are the files of all sources, in order. A note names each file that has changed.

    Raises:
        SourceError: Files were added to sources or removed.
    """
    ramps = loaded.heat_ramps, *(part.flame_ramps for part in loaded.parts)
    images = dict.fromkeys(path for found in ramps for path in found.values())
    files = [*opened, *images, *loaded.templates.values()]
    expected = [file.path for file in hashed]
    if files != expected:
        other = next(iter(set(files).symmetric_difference(expected)), loaded.path)
        raise SourceError(f"{other}: was added or removed during the build; build again")
    for file in hashed:
        if not file.is_unchanged():
            context.progress.note(f"{file.path}: changed while it was read; build again")


def _first(opened: Opened) -> "Clip | Sprites":
    """Return the sprites, or the first clip: all of them have the same files and matte."""
    if isinstance(opened, FireInWind):
        return opened.loops[0]
    return next(iter(opened.values())) if isinstance(opened, Mapping) else opened

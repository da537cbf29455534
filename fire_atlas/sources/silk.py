"""Source ``silk``: simulated cloths of fire, rendered as a clip for each view."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.camera import Camera
from fire_atlas.core.clip import Clip, cached
from fire_atlas.core.errors import SourceError
from fire_atlas.core.fire_in_wind import FireInWind, WindChange, change_shares
from fire_atlas.core.picture import brightest, has_transparency, to_light
from fire_atlas.core.pixels import Pixels
from fire_atlas.generators.rendering import rendered_clip
from fire_atlas.generators.settings import GenerationSettings
from fire_atlas.generators.silk.burning_picture import BurningPicture
from fire_atlas.generators.silk.renderer import (
    SilkView,
    changing_silk,
    generate_silk,
    planned_scene,
    silk_camera,
)
from fire_atlas.generators.silk.sheet_textures import check_texture
from fire_atlas.recipe.problem import KeyPath
from fire_atlas.recipe.silk import Arrangement, SilkSource, Texture
from fire_atlas.recipe.source import FramesSource
from fire_atlas.sources import matte
from fire_atlas.sources.frames import Footage, examine_frames, open_frames
from fire_atlas.sources.images import decode, detect_format, read_header
from fire_atlas.sources.reader import OpeningContext

TEXTURE: KeyPath = ("source", "texture", "path")
"""The key of the clip for the textures."""

_SHAPES_ALIKE = 0.02
"""Relative difference of proportions up to which a mask is one of the frame."""

_BURNS = 0.5
"""Opacity, or light, of a mask from which on something burns there."""

_END_ON = np.cos(np.radians(20))
"""Cosine of the angle between a jet and a line of sight from which on hardly anything is seen."""

_OBLIQUE = np.cos(np.radians(50))
"""Cosine of the angle between a mask's normal and a line of sight, below which its fire is thin."""


def open_silk(
    source: SilkSource,
    files: Mapping[KeyPath, Path],
    generation: GenerationSettings,
    context: OpeningContext,
) -> list[Clip]:
    """Simulate the fire once, and return a clip for each view.

    Args:
        source: The recipe's ``source``.
        files: Absolute paths of the files that it names, by their keys: of the clip for the
            textures, if they are not procedural, and of the masks of what burns.
        generation: Seed, wind, timing and views.
        context: Workers, limits, and the encoding in which the client blends.

    Raises:
        SourceError: The clip is missing, broken, or shows no fire; a mask is no image, of other
            proportions than the frame, or empty.
        RecipeError: As in ``generate_silk``.
    """
    texture = files.get(TEXTURE)
    footage = None if texture is None else open_frames(*_footage(texture, context))
    masks = _read_masks(source, files, context)
    renderer = generate_silk(source, generation, footage, masks)
    cameras = _cameras(source, generation)
    seen = [SilkView(renderer, camera, _luminance_matte(context)) for camera in cameras]
    inputs, notes = _inputs(footage, files), tuple(_thin_views(source, cameras))
    return [replace(_clip(view, generation, inputs, context), notes=notes) for view in seen]


def open_silk_in_wind(
    source: SilkSource,
    files: Mapping[KeyPath, Path],
    generation: GenerationSettings,
    context: OpeningContext,
) -> FireInWind:
    """Simulate the fire in each of the winds that it changes between; see ``open_silk``."""
    texture = files.get(TEXTURE)
    footage = None if texture is None else open_frames(*_footage(texture, context))
    masks = _read_masks(source, files, context)
    inputs = _inputs(footage, files)
    camera = silk_camera(source, 0.0, generation.views.elevation, generation.views.distance)
    seen_as = _luminance_matte(context)
    winds = generation.in_each_wind()
    views = [
        SilkView(generate_silk(source, wind_settings, footage, masks), camera, seen_as)
        for wind_settings in winds
    ]
    loops = tuple(
        _clip(view, wind_settings, inputs, context)
        for view, wind_settings in zip(views, winds, strict=True)
    )

    def change(before: int, after: int, start: int, progress: NDArray[np.float64]) -> WindChange:
        return _change(loops[before], views[before], views[after], start, change_shares(progress))

    return FireInWind(loops, change)


def _clip(
    view: SilkView,
    generation: GenerationSettings,
    inputs: tuple[Path, ...],
    context: OpeningContext,
) -> Clip:
    """Return the clip of a view, which knows what stands in its fire."""
    clip = rendered_clip(view, generation, context.blend_space, inputs)
    solids = cached(view.solids, range(clip.count))
    return replace(clip, solids=solids, hidden=view.solid_cover)


def _change(
    loop: Clip, before: SilkView, after: SilkView, start: int, shares: NDArray[np.float64]
) -> WindChange:
    """Return the change from ``loop``, seen in ``before``, with the new wind's ``shares`` (count,).

    The nodes of the sheets go from one simulation to the other at the same moments of both.
    """
    frames, count = loop.count, len(shares)
    share = np.zeros(frames)
    share[(start + 1 + np.arange(count)) % frames] = shares

    @cache  # many changes are compared by their loops, and few are drawn
    def view() -> SilkView:
        return replace(before, renderer=changing_silk(before.renderer, after.renderer, share))

    clip = replace(
        loop,
        count=count,
        picture=lambda k: view().frame((start + 1 + k) % frames),
        solids=lambda k: view().solids((start + 1 + k) % frames),
        hidden=lambda k: view().solid_cover((start + 1 + k) % frames),
        loop=False,
        flow=None,
    )
    return WindChange(clip, shares, (start + 1 + count) % frames)


def examine_silk(
    source: SilkSource,
    files: Mapping[KeyPath, Path],
    generation: GenerationSettings,
    context: OpeningContext,
) -> Footage:
    """Return what is known of the fire before it is simulated; see ``open_silk``.

    Raises:
        SourceError: The clip is missing, broken or too short, or a mask as in ``open_silk``.
        RecipeError: As in ``generate_silk``.
    """
    texture = files.get(TEXTURE)
    footage = None if texture is None else examine_frames(*_footage(texture, context))
    masks = _read_masks(source, files, context)
    for settings in generation.in_each_wind():
        planned_scene(source, settings, masks)
    if footage is not None and footage.exact and isinstance(source.texture, Texture):
        check_texture(source.texture, footage.count)
    return Footage(
        generation.frames,
        (source.width, source.height),
        generation.fps,
        True,
        (
            *(footage.notes if footage else ()),
            *_thin_views(source, _cameras(source, generation)),
        ),
    )


def _cameras(source: SilkSource, generation: GenerationSettings) -> list[Camera]:
    """Return the camera of each view."""
    views = generation.views
    return [
        silk_camera(source, azimuth, views.elevation, views.distance)
        for azimuth in generation.azimuths()
    ]


def _thin_views(source: SilkSource, cameras: Sequence[Camera]) -> Iterator[str]:
    """Yield notes on views in which hardly anything of an arrangement is seen."""
    away = np.array([camera.axes()[2] for camera in cameras])
    for i, entry in enumerate(source.arrangements):
        if not isinstance(entry, Arrangement):
            continue
        key = f"source.sheets.{i}" if isinstance(source.sheets, tuple) else "source.sheets"
        if entry.direction is not None:
            is_end_on = np.abs(away @ entry.direction) > _END_ON * np.linalg.norm(entry.direction)
            if is_end_on.any():
                yield (
                    f"{key}: seen from its end{_in_views(is_end_on)} a jet is next to nothing, as "
                    "its sheets are lines there; change its direction, or views.elevation"
                )
        elif isinstance(entry.on, str) and entry.on != "none":
            is_thin = np.abs(away[:, 1]) < _OBLIQUE
            if is_thin.any():
                yield (
                    f"{key}: what burns on a mask is as flat as it, and thin"
                    f"{_in_views(is_thin)}; what burns on an intruder (on: 0) has depth"
                )


def _in_views(chosen: NDArray[np.bool_]) -> str:
    """Return the names of ``chosen`` views (count,) as the end of a clause; none if all are."""
    names = [f"view_{k}" for k in np.flatnonzero(chosen)]
    return "" if chosen.all() else f" in {', '.join(names)}"


def _footage(texture: Path, context: OpeningContext) -> tuple[FramesSource, Path, OpeningContext]:
    """Return how the clip for the textures is opened."""
    return FramesSource(path=str(texture)), texture, replace(context, blend_space="linear")


def _read_masks(
    source: SilkSource, files: Mapping[KeyPath, Path], context: OpeningContext
) -> dict[int, BurningPicture]:
    """Return the pictures of what burns by the number of the arrangement that burns on each.

    What is opaque in an image burns; if it has no transparency, it is a mask, and what is bright
    burns.
    """
    masks = {}
    for key, path in files.items():
        if key[-1] != "on":
            continue
        if detect_format(path) == "video":
            raise SourceError(f"{path}: is a video, but a mask is an image")
        header = read_header(path, context.max_pixels)
        if abs(header.width / header.height / (source.width / source.height) - 1) > _SHAPES_ALIKE:
            raise SourceError(
                f"{path}: a mask has the proportions of the frame, {source.width}x{source.height} "
                f"px; got {header.width}x{header.height}"
            )
        picture = decode(path, header)
        light = to_light(picture)
        is_mask = not has_transparency(picture)
        burns = brightest(light) if is_mask else light[..., 3]
        if not (burns > _BURNS).any():
            raise SourceError(f"{path}: nothing in it is opaque, or bright, so nothing burns")
        number = key[2] if len(key) == len(("source", "sheets", 0, "on")) else 0
        colours = None if is_mask else light[..., :3]
        masks[int(number)] = BurningPicture(burns > _BURNS, colours)
    return masks


def _inputs(footage: Clip | None, files: Mapping[KeyPath, Path]) -> tuple[Path, ...]:
    """Return the files that were read: of the clip for the textures, and the masks."""
    masks = (path for key, path in files.items() if key != TEXTURE)
    return (*(footage.inputs if footage else ()), *masks)


def _luminance_matte(context: OpeningContext) -> Callable[[NDArray[np.float32]], Pixels]:
    return lambda light: matte.luminance_of_light(light, context.blend_space)

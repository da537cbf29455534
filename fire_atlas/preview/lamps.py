"""The light of the animations of an atlas, by which the preview page lights a scene."""

from collections import deque
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import TypeAlias

from fire_atlas.atlas.sheet import Animation
from fire_atlas.core.errors import SourceError
from fire_atlas.core.pixels import Bytes
from fire_atlas.effect.composition.light import ClipLight, FrameLight
from fire_atlas.formats.atlas.texture_packer import AtlasFile
from fire_atlas.formats.output_names import animation_stem, light_file
from fire_atlas.formats.tracks.light import light_of_frames, read_light
from fire_atlas.preview.blend import as_seen
from fire_atlas.preview.cut_frames import cut_frames, shown_alpha

Lamp: TypeAlias = list[tuple[float, ...]]
"""Of each frame its light r, g, b, linear and 1 in the mean of the brightest channel, and the
middle of it x, y, px of the untrimmed frame. The mean is that of the animation, or of the first
loop of a fire that changes in a game."""


def lamps_of(atlas: AtlasFile) -> list[Lamp]:
    """Return the light of each animation: that of its track, or else that of its pixels.

    Raises:
        SourceError: A file is missing, or is not as the atlas states.
    """
    sheet, frames = atlas.sheet, cut_frames(atlas)
    tracked, measured = dict[str, Lamp](), dict[str, ClipLight]()
    for animation in sheet.animations:
        shown = islice(frames, len(animation.frames))
        if lamp := _tracked(atlas, animation):
            tracked[animation.name] = lamp
        else:
            measured[animation.name] = _measured(atlas, shown)
        deque(shown, maxlen=0)  # skip its frames
    loop = None if sheet.states is None else measured.get(sheet.states.first_loop)
    return [
        tracked.get(each.name)
        or [_of_row(row, 1.0) for row in light_of_frames(measured[each.name], loop)]
        for each in sheet.animations
    ]


def dark(lamp: Lamp) -> Lamp:
    """Return the light of one frame of a fire that is out."""
    return [(0.0, 0.0, 0.0, *lamp[0][3:])]


def has_light_tracks(atlas: AtlasFile) -> bool:
    """Return whether the light of any animation is in a track."""
    return any(_track(atlas, animation).exists() for animation in atlas.sheet.animations)


def _track(atlas: AtlasFile, animation: Animation) -> Path:
    return atlas.path.with_name(light_file(animation_stem(atlas.sheet.title, animation.name)))


def _tracked(atlas: AtlasFile, animation: Animation) -> Lamp | None:
    """Return the lamp in the track of an animation; None without a track."""
    path = _track(atlas, animation)
    rows = read_light(path)
    if rows is None:
        return None
    if len(rows) != len(animation.frames):
        raise SourceError(
            f"{path}: has the light of {len(rows)} frames, but {animation.name} has "
            f"{len(animation.frames)}; build the recipe again"
        )
    return [_of_row(row, atlas.sheet.scale) for row in rows]


def _measured(atlas: AtlasFile, frames: Iterator[Bytes]) -> ClipLight:
    """Return the light of frames."""
    sheet = atlas.sheet
    lights = tuple(
        FrameLight.of(as_seen(frame, shown_alpha(sheet), sheet.blend_space)) for frame in frames
    )
    largest = max(atlas.frames, key=lambda region: region.frame_width * region.frame_height)
    size = largest.frame_width, largest.frame_height
    return ClipLight(sheet.fps, *size, True, lights)


def _of_row(row: dict[str, float], scale: float) -> tuple[float, ...]:
    light = [round(row["intensity"] * row[channel], 4) for channel in "rgb"]
    return (*light, round(scale * row["x"], 1), round(scale * row["y"], 1))

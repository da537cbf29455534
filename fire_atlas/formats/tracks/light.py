"""Write the light that a fire gives in each frame as JSON, to animate a lamp in the game.

``preview`` reads the files back.
"""

import json
from pathlib import Path

import numpy as np

from fire_atlas.core.checks import number
from fire_atlas.core.decimals import plain
from fire_atlas.core.errors import SourceError
from fire_atlas.core.files import MAX_JSON_BYTES, read_file
from fire_atlas.core.output_file import OutputFile
from fire_atlas.core.pixels import REC709
from fire_atlas.effect.composition.light import ClipLight, FrameLight
from fire_atlas.formats.output_names import light_file

_DECIMALS = {
    "t": 6, "intensity": 4, "r": 4, "g": 4, "b": 4, "x": 2, "y": 2, "radius": 2,
    "light": 6,
}  # fmt: skip


_HIGHEST = {"intensity": 1e6, "r": 1.0, "g": 1.0, "b": 1.0}
_FURTHEST = 1e6
"""Limits on what is read: of light, and of places in px."""


def write_light(name: str, light: ClipLight, reference: ClipLight | None = None) -> OutputFile:
    """Return ``name.light.json``: brightness, colour, place and size of the light of each frame.

    Measured in linear light before flakes are clipped to 1; where the footage has an opaque
    background, only the light of the flame and of the flakes that are drawn counts.

    - ``intensity``: relative to the mean of the animation, 1; of a fire that changes in a game to
      that of its first loop, ``reference``. Multiply a lamp's energy by it.
    - ``r g b``: linear colour, scaled so that its brightest channel is 1. intensity · (r, g, b) is
      proportional to the light of the frame.
    - ``x y``: centre of luminance, source px. ``radius``: root mean square distance of the light
      from there, px; for lamps with a size.
    - ``mean``: the same values for the whole animation. Its ``light``, the mean of the brightest
      channel per px of the frame, tells how bright effects are compared with one another.

    A frame without light has intensity 0 and the other values of the mean, so that nothing jumps.
    """
    mean = _mean(light)
    rows = [
        {"i": i, **_rounded({"t": i / light.fps, **frame})}
        for i, frame in enumerate(light_of_frames(light, reference))
    ]
    head = {
        "format": "fire-atlas/light",
        "version": 1,
        "name": name,
        "fps": plain(light.fps, 6),
        "frame_count": len(light.frames),
        "loop": light.loop,
        "size": [light.width, light.height],
        "space": "source pixels, x right, y down, (0,0) top-left corner",
        "units": "px, s; linear rgb, brightest channel 1; intensity 1 is the mean",
        "mean": _rounded(
            {
                "light": float(mean.rgb.max()) / (light.width * light.height),
                **_shape(mean, light),
            }
        ),
    }
    text = json.dumps(head, ensure_ascii=False)[:-1]
    frames = ",\n".join(json.dumps(row) for row in rows)
    return OutputFile(light_file(name), "light", f'{text},\n"frames": [\n{frames}\n]}}\n'.encode())


def light_of_frames(light: ClipLight, reference: ClipLight | None = None) -> list[dict[str, float]]:
    """Return intensity, r, g, b, x, y and radius of each frame; see ``write_light``.

    Intensity is relative to the mean of ``reference``, by default of the animation itself.
    """
    mean_shape = _shape(_mean(light), light)
    brightest = float(_mean(reference or light).rgb.max())
    return [
        {"intensity": float(frame.rgb.max()) / brightest, **_shape(frame, light)}
        if frame.rgb.max() > 0
        else {"intensity": 0.0, **mean_shape}
        for frame in light.frames
    ]


def read_light(path: Path) -> list[dict[str, float]] | None:
    """Read intensity, r, g, b, x and y of each frame from a file; None if there is no such file.

    Raises:
        SourceError: The file was not written by ``write_light``.
    """
    if not path.exists():
        return None
    try:
        document = json.loads(read_file(path, MAX_JSON_BYTES))
        return [
            {key: number(frame[key], 0, high) for key, high in _HIGHEST.items()}
            | {key: number(frame[key], -_FURTHEST, _FURTHEST) for key in "xy"}
            for frame in document["frames"]
        ]
    except OSError as error:
        raise SourceError(f"{path}: the light cannot be read ({error.strerror})") from None
    except (LookupError, TypeError, ValueError, RecursionError) as error:
        raise SourceError(
            f"{path}: is not a file of light that fire-atlas wrote "
            f"({type(error).__name__}: {error}); build the recipe again"
        ) from error


def _mean(light: ClipLight) -> FrameLight:
    """Return the mean light of all frames."""
    total, share = sum(light.frames, FrameLight(np.zeros(3), 0, 0, 0)), 1 / len(light.frames)
    return FrameLight(total.rgb * share, total.x * share, total.y * share, total.square * share)


def _shape(frame: FrameLight, light: ClipLight) -> dict[str, float]:
    """Return colour, centre and radius of a frame's light; white in the middle if it has none."""
    if not frame.rgb.max() > 0:
        return {"r": 1, "g": 1, "b": 1, "x": light.width / 2, "y": light.height / 2, "radius": 0}
    luminance = float((frame.rgb * REC709).sum())
    x, y = frame.x / luminance, frame.y / luminance
    spread = max(frame.square / luminance - x * x - y * y, 0.0)
    colour = (frame.rgb / frame.rgb.max()).tolist()
    return {**dict(zip("rgb", colour, strict=True)), "x": x, "y": y, "radius": spread**0.5}


def _rounded(values: dict[str, float]) -> dict[str, float]:
    return {key: round(float(value), _DECIMALS[key]) for key, value in values.items()}

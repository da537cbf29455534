"""Fire clips to test on: the samples, which everybody has, and real footage where it is."""

import json
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal

import pytest
from _pytest.mark import ParameterSet

from fire_atlas.core.clip import Clip, ProxiedClip
from fire_atlas.core.pixels import Pixels
from fire_atlas.core.shipped import shipped
from fire_atlas.core.workers import Workers
from fire_atlas.generators.profile.learn.fitness import PROXY_SIDE
from fire_atlas.recipe.source import FramesSource
from fire_atlas.sources.frames import open_frames
from fire_atlas.sources.reader import OpeningContext
from fire_atlas.vision.thumbnails import shrunk
from tests.support.requirements import real_clips

SAMPLES: dict[str, dict[str, Any]] = {
    "campfire": {"path": "campfire", "fps": 24.0},
    "candle": {"path": "candle", "fps": 24.0},
    "torch": {"path": "torch.gif", "matte": "luminance"},
    "fireball": {"path": "fireball", "fps": 24.0},
    "explosion": {"path": "explosion", "fps": 24.0},
    "cartoon": {"path": "cartoon_flame.png", "fps": 12.0, "grid": {"columns": 6, "rows": 4}},
    "pixel_art": {"path": "pixel_flame.png", "fps": 10.0, "grid": {"columns": 8, "rows": 1}},
}
"""Sources of the sample clips, as the ready recipes open them."""

RISING_SAMPLES = ("campfire", "candle", "torch", "cartoon", "pixel_art")
"""Samples of a flame that rises."""

RISING = (
    "cartoon_fluent_fire", "cartoon_freedoom_fire", "cartoon_tauran_flame_sheet",
    "cartoon_wesnoth_campfire", "real_candle_red", "real_fireplace_gif", "real_firewall_stock",
    "sim_unity_flame02", "sim_unity_flame03",
)  # fmt: skip
"""Real clips of a flame that rises."""

ALL_CLIPS = (*RISING, "cartoon_wesnoth_fireball_impact")
"""Every real clip: the last is a flash that turns into smoke."""


def real(name: str, *values: object) -> ParameterSet:
    """Return parameters of a test for a real clip, which not everybody has and which takes long."""
    return pytest.param(name, *values, marks=[pytest.mark.clips, pytest.mark.slow])


_HEIGHT = 160
"""Height at which tests look at larger clips, px: what they show is seen there too, in a fourth of
the time."""


@lru_cache(maxsize=16)  # 20 MB each on average
def open_clip(
    name: str, height: int | Literal["source"] | None = None, count: int | None = None
) -> Clip:
    """Return a sample or a real clip by its name, in memory, at its own rate.

    Args:
        name: Its name.
        height: Height of its frames, px; ``"source"``: its own; by default that, or 160 if that is
            more.
        count: Number of its frames, if not all.
    """
    if name in SAMPLES:
        path = shipped("samples") / str(SAMPLES[name]["path"])
        settings = {**SAMPLES[name], "count": count}
    else:
        path = real_clips() / name / "frames"
        meta = json.loads((path.parent / "meta.json").read_text(encoding="utf-8"))
        settings = {"path": str(path), "fps": meta["fps"], "count": count}
    clip = _opened(settings, path, height or "source")
    if height is None and clip.height > _HEIGHT:
        clip = _opened(settings, path, _HEIGHT)
    return kept(clip)


def real_clip(folder: Path, name: str) -> Clip:
    """Return a real clip in ``folder``, in memory, at its own rate and size."""
    meta = json.loads((folder / name / "meta.json").read_text(encoding="utf-8"))
    frames = folder / name / "frames"
    return kept(_opened({"path": str(frames), "fps": meta["fps"]}, frames, "source"))


def _opened(settings: dict[str, Any], path: Path, height: int | Literal["source"]) -> Clip:
    source = FramesSource.model_validate({**settings, "height": height})
    with Workers(1) as workers:
        return open_frames(source, path, OpeningContext("srgb", workers))


def campfire(height: int | Literal["source"] | None = None, count: int | None = None) -> Clip:
    """Return the sample campfire, in memory."""
    return open_clip("campfire", height, count)


def clip_of(frames: Sequence[Pixels], fps: float = 24.0, matte: str = "alpha") -> Clip:
    """Return a clip of frames that are in memory."""
    height, width = frames[0].shape[:2]
    return Clip(
        width, height, fps, len(frames), lambda i: frames[i].copy(), (), "srgb", matte, "made here"
    )


def kept(clip: Clip) -> Clip:
    """Return ``clip`` with all its frames in memory."""
    frames = [clip.read(i) for i in range(clip.count)]
    return replace(clip, picture=lambda i: frames[i].copy())


def proxied(clip: Clip) -> ProxiedClip:
    """Return ``clip`` with the small copy of it by which profiles judge it."""
    height, width = shrunk(clip.read(0), PROXY_SIDE).shape[:2]
    proxy = replace(
        clip, width=width, height=height, picture=lambda i: shrunk(clip.read(i), PROXY_SIDE)
    )
    return ProxiedClip(clip, proxy)


def piece(clip: Clip, start: int, count: int) -> Clip:
    """Return ``count`` frames of ``clip`` from frame ``start`` on, as a clip that is cut out."""
    frames = [clip.read(start + i) for i in range(count)]
    return clip_of(frames, clip.fps, clip.matte)


def looped(clip: Clip, seconds: float) -> Clip:
    """Return ``clip`` played again and again for at least ``seconds``."""
    count = max(clip.count, round(seconds * clip.fps))
    return replace(clip, count=count, picture=lambda i: clip.picture(i % clip.count))

"""Draw a picture of a fire profile that shows at a glance whether it was learnt correctly.

A profile is all that was learnt of a fire from a clip. It sorts the frames into leaning sets, each
for a range of leans (a state) and a period: ``swing`` while the lean changes fast, ``rest`` while
it hardly does.
"""

import io
from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from fire_atlas.atlas.encode import encode_frame
from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import Bytes
from fire_atlas.generators.profile.flame_region import largest_flame
from fire_atlas.generators.profile.learn.features import FireMask, contour
from fire_atlas.generators.profile.model import STATE_EDGES, STATE_WIDTH, Profile, Side
from fire_atlas.preview.blend import blend
from fire_atlas.vision.sampling import evenly_spread

_BACKGROUND, _INK, _DIM = (16, 16, 20), (225, 225, 230), (120, 120, 132)
_ACCENT, _LINE, _POINT = (255, 150, 40), (90, 210, 255), (255, 70, 150)
_FRAMES = 8
_CELL, _GAP, _TEXT = 200, 8, 14
_PANEL = 232

_ORIGINS = {"own": (255, 150, 40), "mirrored": (150, 120, 220), "sheared": (92, 92, 104)}


def profile_picture(profile: Profile, clips: Sequence[Clip]) -> bytes:
    """Return a PNG: outlines and feature points over frames of the ``clips``, the colour table, a
    histogram of the lean, the origin of the frames of each leaning set, and figures."""
    samples = [_frames(clip, side) for clip, side in zip(clips, profile.sides, strict=False)]
    panels = [_table(profile), _leans(profile.front), _sets(profile.front), _figures(profile)]
    row = _beside(panels)
    width = max(image.width for image in (*samples, row)) + 2 * _GAP
    height = sum(image.height + _GAP for image in (*samples, row)) + _GAP
    picture, top = Image.new("RGB", (width, height), _BACKGROUND), _GAP
    for image in (*samples, row):
        picture.paste(image, (_GAP, top))
        top += image.height + _GAP
    file = io.BytesIO()
    picture.save(file, "PNG")
    return file.getvalue()


def _frames(clip: Clip, side: Side) -> Image.Image:
    """Draw frames spread over the clip, cropped to the fire, with outline and feature points."""
    mask = FireMask.of(clip, side.threshold)
    numbers = evenly_spread(0, clip.count - 1, _FRAMES)
    xs = np.array([point[0] for points in side.points for point in points])
    ys = np.array([point[1] for points in side.points for point in points])
    room = 0.35 * side.statistics.height.median
    left, right = max(int(xs.min() - room), 0), min(int(xs.max() + room), clip.width)
    top, bottom = max(int(ys.min() - room), 0), min(int(ys.max() + room / 3), clip.height)
    scale = _CELL / max(right - left, bottom - top)
    return _beside([
        _frame(clip, mask, side, i, (left, top, right, bottom), scale) for i in numbers
    ])  # fmt: skip


def _frame(
    clip: Clip, mask: FireMask, side: Side, i: int, box: tuple[int, int, int, int], scale: float
) -> Image.Image:
    left, top, right, bottom = box
    pixels = clip.read(i)
    shown = blend(encode_frame(pixels, "straight", "srgb"), _BACKGROUND, "straight", "srgb")
    size = max(1, round((right - left) * scale)), max(1, round((bottom - top) * scale))
    enlarged = cv2.resize(shown[top:bottom, left:right], size, interpolation=cv2.INTER_CUBIC)
    edge = contour(largest_flame(mask.binarized(pixels)))[top:bottom, left:right]
    image = Image.fromarray(_marked(np.asarray(enlarged, np.uint8), edge))
    draw = ImageDraw.Draw(image)
    for x, y in side.points[i]:
        at_x, at_y = (x - left) * scale, (y - top) * scale
        draw.ellipse((at_x - 3, at_y - 3, at_x + 3, at_y + 3), fill=_POINT, outline=_INK)
    label = f"{i}  {side.leans[i]:+.0f}°"
    draw.text((3, 2), label, fill=_INK)
    return image


def _marked(picture: Bytes, edge: NDArray[np.bool_]) -> Bytes:
    """Draw an outline, a mask of the original frame's pixels, over the enlarged frame."""
    size = picture.shape[1], picture.shape[0]
    line = cv2.resize(edge.astype(np.float32), size, interpolation=cv2.INTER_LINEAR) > 0.45
    marked = picture.copy()
    marked[line] = (0.35 * picture[line] + 0.65 * np.array(_LINE)).astype(np.uint8)
    return marked


def _beside(images: Sequence[Image.Image]) -> Image.Image:
    width = sum(image.width + _GAP for image in images) - _GAP
    whole = Image.new("RGB", (width, max(image.height for image in images)), _BACKGROUND)
    left = 0
    for image in images:
        whole.paste(image, (left, 0))
        left += image.width + _GAP
    return whole


def _panel(title: str) -> tuple[Image.Image, ImageDraw.ImageDraw]:
    image = Image.new("RGB", (_PANEL, _PANEL), (24, 24, 29))
    draw = ImageDraw.Draw(image)
    draw.text((8, 6), title, fill=_INK)
    return image, draw


def _table(profile: Profile) -> Image.Image:
    image, draw = _panel("colour table")
    table, top = profile.front.colours, 26
    size = (_PANEL - top - 8) / len(table.colours)
    for row, colours in enumerate(table.colours):
        for column, colour in enumerate(colours):
            x, y = 8 + column * size, top + row * size
            share = float(np.sqrt(table.coverage[row, column]))
            half, cx, cy = share * (size - 2) / 2, x + size / 2, y + size / 2
            if half >= 1:
                box = (cx - half, cy - half, cx + half, cy + half)
                draw.rectangle(box, fill=tuple(map(int, colour)))
    return image


def _leans(side: Side) -> Image.Image:
    image, draw = _panel("lean of every frame, degrees")
    # Leans beyond the range count in the outermost bins.
    counts, edges = np.histogram(np.clip(side.leans, -39.9, 39.9), bins=40, range=(-40, 40))
    floor, tall = _PANEL - 28, _PANEL - 64
    step = (_PANEL - 16) / len(counts)
    for i, count in enumerate(counts):
        high = tall * count / max(int(counts.max()), 1)
        if count:
            x = 8 + i * step
            draw.rectangle((x, floor - high, x + step - 1, floor), fill=_ACCENT)
    for lean in STATE_EDGES:
        x = 8 + (lean - edges[0]) / (edges[-1] - edges[0]) * (_PANEL - 16)
        draw.line((x, 40, x, floor), fill=(52, 52, 60))
        draw.text((x, floor + 6), f"{lean:.0f}", fill=_DIM, anchor="ma")
    return image


def _sets(side: Side) -> Image.Image:
    image, draw = _panel("leaning sets: frames, whose")
    width, height = (_PANEL - 60) / 2, (_PANEL - 60) / (len(STATE_EDGES) - 1)
    for i, leaning in enumerate(side.sets):
        state, column = divmod(i, 2)
        x, y = 52 + column * width, 42 + state * height
        if state == 0:
            draw.text((x + 2, 26), leaning.period, fill=_DIM)
        if column == 0:
            label = f"{leaning.low:.0f}..{leaning.high:.0f}"
            draw.text((46, y + height / 2), label, fill=_DIM, anchor="rm")
        draw.rectangle((x, y, x + width - 3, y + height - 3), fill=_ORIGINS[leaning.origin])
        count = f"{len(leaning.frames)} {leaning.origin}"
        draw.text((x + 5, y + height / 2 - 1), count, fill=_BACKGROUND, anchor="lm")
    return image


def _figures(profile: Profile) -> Image.Image:
    image, draw = _panel("what was learnt")
    side, detail = profile.front, profile.front.detail
    statistics = side.statistics
    lines = [
        f"{detail.count} frames at {side.fps:g} fps{', a closed loop' if side.closed else ''}",
        f"flame: brighter than {side.threshold:.0f} of 255",
        f"height {statistics.height.median:.0f} px, width {statistics.width.median:.0f} px",
        f"lean {statistics.lean.median:+.1f}°, from {statistics.lean.low:+.0f}° to"
        f" {statistics.lean.high:+.0f}°",
        f"rises {profile.rise_speed:.1f} heights per second",
        f"detail {detail.scores.shape[2]} x {detail.scores.shape[1]} cells",
        f"states of {STATE_WIDTH:.0f}°: {sum(s.origin == 'own' for s in side.sets)} of 12 its own",
        "seen from two sides" if profile.side else "seen from one side",
    ]
    for i, line in enumerate(lines):
        draw.text((8, 30 + i * (_TEXT + 6)), line, fill=_DIM)
    return image

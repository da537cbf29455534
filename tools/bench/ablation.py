"""What each part of Kim & Lee's effect does, in pictures and figures: the page docs/ablation.md.

Run it from the checkout: ``python -m tools.bench.ablation [--write] [SECTION ...]``.

A section is of one part of the paper. The effect is run on a sample with that part at several
values. A table has figures of each, the mean of three seeds, and a picture shows the first seed.
What a section says in words of its table is checked: the script fails where it no longer holds.

To add one: a ``Section`` in ``SECTIONS``. ``--write`` writes the page and its pictures.
"""

import argparse
import sys
import textwrap
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import yaml
from PIL import Image, ImageDraw, ImageFont

from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import Bytes, Plane, as_plane, encode_bytes
from fire_atlas.effect.field.forcing import cell_means
from fire_atlas.effect.flame.features import (
    difference_of_gaussians,
    feature_vectors,
    gradient_magnitude,
)
from fire_atlas.preview.field_marks import LONGEST, RAMP, MarkGrid, Marks, sizes_of
from fire_atlas.recipe.effect import MotionBlur
from tests.support.clip_motion import Flow, correlation, dis_flow, flows_of, in_the_flame
from tests.support.clips import open_clip
from tests.support.effect import AGE, ID, Array, X, Y, run_effect
from tests.support.promises.of_effect import (
    ALIVE,
    BIRTH_HEIGHT,
    BIRTHS,
    LIGHT_SPREAD,
    OUTWARD,
    RISE,
    SHARPNESS,
    SPEED,
    STREAK,
    Seen,
)
from tests.support.promises.promise import Figure, Unit

DOCS = Path(__file__).parents[2] / "docs"

PAGE = DOCS / "ablation.md"

SEEDS = (0, 1, 2)

LINE = 112
"""Maximum number of characters in a line of the page's prose."""

Keys = Mapping[str, Any]


_FLOWS: dict[bytes, list[Flow]] = {}
"""The optical flow of each clip, by its first frame."""


def _followed(seen: Seen) -> tuple[float, float, float]:
    """Return how embers in the moving flame follow the clip's optical flow there: the correlation
    of their velocities sideways and upwards, and their median speed, all in % (of the flow's)."""
    clip = seen.clip
    first = clip.picture(0).tobytes()
    if first not in _FLOWS:
        _FLOWS[first] = flows_of(clip, dis_flow)
    places = in_the_flame(seen.effect, _FLOWS[first], _FLOWS[first])
    speed = float(np.median(np.hypot(*places.flakes.T))) if len(places.flakes) else float("nan")
    if not speed > 0:
        return float("nan"), float("nan"), speed
    x, y = correlation(places.flakes, places.flow)
    return 100 * x, 100 * y, 100 * speed / float(np.median(np.hypot(*places.flow.T)))


def _end_higher(seen: Seen) -> float:
    return 100 * float(np.mean([f[-1, Y] < f[0, Y] for f in seen.effect.flights(2)]))


def _kept(seen: Seen) -> float:
    """Return which part of the length of feature vectors the means of the field's cells keep, %."""
    analyser, cell = seen.analyser(), seen.effect.analysis.field.cell
    kept = whole = 0.0
    for i in seen.frames:
        features = analyser.features(i)
        means = [cell_means(plane, cell) for plane in (features.x, features.y)]
        kept += float(np.hypot(*means).sum())
        whole += float(cell_means(as_plane(np.hypot(features.x, features.y)), cell).sum())
    return 100 * kept / whole


def _speeds(seen: Seen) -> Plane:
    """Return the speed of the field in all cells of all frames, heights/s."""
    field = seen.effect.analysis.field
    return as_plane(np.hypot(field.u, field.v) / seen.clip.height)


def _in_flame(seen: Seen, values: Plane) -> Plane:
    return as_plane(values[seen.effect.analysis.field.brightness > 128])


def _sinking(seen: Seen) -> float:
    down = seen.effect.analysis.field.v / np.float32(seen.clip.height)
    return 100 * float((_in_flame(seen, down) > 0.02).mean())


def _sinking_at_all(seen: Seen) -> float:
    return 100 * float((_in_flame(seen, seen.effect.analysis.field.v) > 0).mean())


def _convergence(seen: Seen) -> float:
    """Return how fast the air closes in where flakes are, 1/s: minus the mean divergence."""
    field, found = seen.effect.analysis.field, []
    rows, columns = field.u.shape[1:]
    for i, flakes in enumerate(seen.effect.tracks.frames):
        apart = (np.gradient(field.u[i], axis=1) + np.gradient(field.v[i], axis=0)) / field.cell
        row = np.clip(flakes[:, Y] / field.cell, 0, rows - 1).astype(int)
        column = np.clip(flakes[:, X] / field.cell, 0, columns - 1).astype(int)
        found.append(-apart[row, column])
    return float(np.concatenate(found).mean())


def _turned(seen: Seen) -> float:
    """Return the mean angle between Fv* and ∇f κ, degrees."""
    analyser, found = seen.analyser(), []
    features, study = analyser.recipe.features, analyser.study
    for i in seen.frames:
        refined = analyser.features(i)
        x, y = feature_vectors(
            refined.brightness, features.sigma, features.kernel, study.fires.epsilon(), study.kappa
        )
        there = refined.strength > 0
        dot = (x * refined.x + y * refined.y)[there].astype(np.float64)
        cross = (x * refined.y - y * refined.x)[there].astype(np.float64)
        found.append(np.degrees(np.abs(np.arctan2(cross, dot))))
    return float(np.concatenate(found).mean())


def _features(seen: Seen) -> float:
    """Return the part of the frame in which ‖∇f‖ exceeds ε, thousandths."""
    features, found = seen.effect.recipe.features, []
    epsilon = seen.effect.study.fires.epsilon()
    for i in seen.frames:
        bright = seen.clip.brightness(i)
        slope = gradient_magnitude(bright, features.sigma, features.kernel)
        found.append((slope > epsilon).mean())
    return 1000 * float(np.mean(found))


def _candidates(seen: Seen) -> float:
    """Return the part of the frame that candidates are, thousandths."""
    analyser, clip = seen.analyser(), seen.clip
    count = [len(analyser.candidates(analyser.features(i)).places) for i in seen.frames]
    return 1000 * float(np.mean(count)) / (clip.width * clip.height)


def _smear(seen: Seen) -> float:
    """Return the length, px, that a tenth of the flame's cells are blurred over or more."""
    blur = seen.effect.recipe.motion_blur
    if not isinstance(blur, MotionBlur) or not blur.flame:
        return 0.0
    weight = cell_means(seen.effect.study.kappa, seen.effect.analysis.field.cell)
    path = _in_flame(seen, as_plane(_speeds(seen) * weight)) * seen.clip.height
    longest = float(np.quantile(path, 0.9)) / seen.clip.fps
    return longest * blur.shutter * blur.exaggeration


SIDEWAYS = Figure("correlation with the flow, sideways", Unit.SHARE, lambda s: _followed(s)[0])
UPWARDS = Figure("the same, upwards", Unit.SHARE, lambda s: _followed(s)[1])
OF_FLOW = Figure("speed in the flame, of the flow's", Unit.SHARE, lambda s: _followed(s)[2])
END_HIGHER = Figure("flakes that end higher than they began", Unit.SHARE, _end_higher)
KEPT = Figure("length of vectors kept by the mean of 4 × 4 px", Unit.SHARE, _kept)
IN_FLAME = Figure(
    "median speed of the air in the flame, heights/s",
    Unit.NUMBER,
    lambda s: float(np.median(_in_flame(s, _speeds(s)))),
)
SINKING = Figure("flame whose air sinks faster than 0.02 heights/s", Unit.SHARE, _sinking)
SINKING_AT_ALL = Figure("flame whose air sinks at all", Unit.SHARE, _sinking_at_all)
CONVERGENCE = Figure("convergence of the air where flakes are, 1/s", Unit.NUMBER, _convergence)
FASTEST = Figure("fastest air, heights/s", Unit.NUMBER, lambda s: float(_speeds(s).max()))
FAST = Figure(
    "99 % of the air is slower, heights/s",
    Unit.NUMBER,
    lambda s: float(np.quantile(_speeds(s), 0.99)),
)
TURNED = Figure("mean angle between Fv* and ∇f κ", Unit.DEGREES, _turned)
FEATURES = Figure("gradients that exceed ε, thousandths of the frame", Unit.NUMBER, _features)
CANDIDATES = Figure("candidates, thousandths of the frame", Unit.NUMBER, _candidates)
SMEAR = Figure("path of the flame's blur, of which 90 % are shorter", Unit.PX, _smear)


@dataclass(frozen=True)
class Variant:
    """The effect with some keys.

    Attributes:
        label: What the table calls it, in Markdown.
        keys: The recipe's.
        clip: The sample that it is run on.
    """

    label: str
    keys: Keys
    clip: str = "campfire"

    def seen(self, seed: int = SEEDS[0]) -> Seen:
        """Return the effect, run with a seed."""
        return _seen(self.clip, yaml.safe_dump({**self.keys, "seed": seed}))


@cache
def _seen(clip: str, keys: str) -> Seen:
    effect = run_effect(open_clip(clip, "source"), yaml.safe_load(keys))
    return Seen(effect, effect.simulated)


def _with(keys: Keys, **blocks: Any) -> Keys:
    """Return ``keys`` with those of ``blocks`` added or changed."""
    changed = {
        name: {**keys.get(name, {}), **block} if isinstance(block, dict) else block
        for name, block in blocks.items()
    }
    return {**keys, **changed}


@dataclass(frozen=True)
class Table:
    """The figures of the variants of a section."""

    variants: Sequence[Variant]
    figures: Sequence[Figure]
    values: Array

    @classmethod
    def measured(cls, variants: Sequence[Variant], figures: Sequence[Figure]) -> "Table":
        """Measure the variants, over the seeds."""
        values = [
            np.mean([[f.of(variant.seen(seed)) for f in figures] for seed in SEEDS], axis=0)
            for variant in variants
        ]
        return cls(variants, figures, np.array(values))

    def of(self, figure: Figure) -> list[float]:
        """Return a figure of all variants, in their order."""
        found: list[float] = self.values[:, list(self.figures).index(figure)].tolist()
        return found

    def markdown(self) -> str:
        """Return the table as it is on the page."""
        units = [f"{f.name}, {f.unit.value}" if f.unit.value else f.name for f in self.figures]
        rows = [["keys", *units], ["---"] * (len(units) + 1)]
        for variant, values in zip(self.variants, self.values, strict=True):
            rows.append([variant.label, *map(_number, values)])
        return "\n".join(f"| {' | '.join(row)} |" for row in rows)


def _number(value: float) -> str:
    if np.isnan(value):
        return "–"
    text = f"{value:.0f}" if abs(value) >= 100 else f"{value:.{2 if abs(value) < 1 else 3}g}"
    return text.replace("-", "−")


def _rises(values: Sequence[float]) -> bool:
    return all(later > earlier for earlier, later in pairwise(values))


_BACKGROUND, _INK, _DIM = (16, 16, 20), (228, 228, 232), (158, 158, 170)

_GAP, _LINE, _FONT = 6, 17, 13

_QUALITY = 86
"""Of the WebP files."""

_FINE = 3
"""Marks are drawn this many times as large, and reduced: OpenCV draws small dots as crosses."""

_SHIFT = 4
"""Binary digits behind the point in the coordinates that OpenCV draws."""

_WHITE = (255.0, 255.0, 255.0)


@dataclass(frozen=True)
class View:
    """A part of the frame, px, and how many times as large it is shown."""

    left: int
    top: int
    width: int
    height: int
    zoom: float

    @property
    def fine(self) -> "View":
        """The view in which marks are drawn."""
        return replace(self, zoom=self.zoom * _FINE)

    def of(self, picture: Bytes) -> Bytes:
        """Return this part of a picture (H, W, 3), enlarged."""
        part = picture[self.top : self.top + self.height, self.left : self.left + self.width]
        size = round(self.width * self.zoom), round(self.height * self.zoom)
        return np.ascontiguousarray(cv2.resize(part, size, interpolation=cv2.INTER_CUBIC), np.uint8)

    def at(self, x: float, y: float) -> tuple[int, int]:
        """Return where a place of the frame, px, is drawn, in fixed point."""
        right, down = (x - self.left) * self.zoom - 0.5, (y - self.top) * self.zoom - 0.5
        return round(right * 2**_SHIFT), round(down * 2**_SHIFT)

    def inside(self, marks: Marks) -> Marks:
        """Return the marks that lie in it."""
        x, y = marks[:, 0] - self.left, marks[:, 1] - self.top
        return marks[(x >= 0) & (x < self.width) & (y >= 0) & (y < self.height)]


@dataclass(frozen=True)
class Cell:
    """A picture with what is written under it, one or two lines."""

    picture: Bytes
    caption: str


def strip(rows: Sequence[Sequence[Cell]]) -> Image.Image:
    """Return rows of pictures side by side, each with its caption under it.

    Captions have the letters of Pillow's own font: no Greek ones.
    """
    font = ImageFont.load_default(_FONT)
    tall = [max(each.picture.shape[0] for each in row) for row in rows]
    lines = [max(each.caption.count("\n") + 1 for each in row) for row in rows]
    height = sum(tall) + sum(lines) * _LINE + (2 * len(rows) + 1) * _GAP
    width = _GAP + max(sum(each.picture.shape[1] + _GAP for each in row) for row in rows)
    whole = Image.new("RGB", (width, height), _BACKGROUND)
    draw, top = ImageDraw.Draw(whole), _GAP
    for n, row in enumerate(rows):
        left = _GAP
        for each in row:
            whole.paste(Image.fromarray(each.picture), (left, top))
            middle = left + each.picture.shape[1] // 2
            for line, text in enumerate(each.caption.split("\n")):
                place = middle, top + tall[n] + 3 + line * _LINE
                draw.text(place, text, fill=_DIM if line else _INK, font=font, anchor="ma")
            left += each.picture.shape[1] + _GAP
        top += tall[n] + lines[n] * _LINE + 2 * _GAP
    return whole


def finished(seen: Seen, i: int, view: View) -> Bytes:
    """Return frame ``i`` as it goes onto the page, over black."""
    return view.of(encode_bytes(as_plane(seen.finished(i)[..., :3])))


def _darkened(clip: Clip, i: int) -> Bytes:
    """Return a frame without flakes, so dark and pale that marks stand out on it."""
    shown = encode_bytes(as_plane(clip.read(i)[..., :3])).astype(np.float32)
    pale = (shown + shown.mean(axis=2, keepdims=True)) * 0.22
    return np.asarray(np.rint(pale), np.uint8)


def _reduced(picture: Bytes) -> Bytes:
    """Return a picture of a fine view as it is shown."""
    height, width = (side // _FINE for side in picture.shape[:2])
    return np.asarray(cv2.resize(picture, (width, height), interpolation=cv2.INTER_AREA), np.uint8)


def _colour(part: float) -> tuple[float, float, float]:
    """Return the colour of the ramp at ``part``, 0..1."""
    stops = np.linspace(0, 1, len(RAMP))
    r, g, b = (float(np.interp(part, stops, each)) for each in zip(*RAMP, strict=True))
    return r, g, b


def _dot(picture: Bytes, place: tuple[int, int], colour: tuple[float, float, float]) -> None:
    radius = round(1.4 * _FINE * 2**_SHIFT)
    cv2.circle(picture, place, radius, colour, cv2.FILLED, cv2.LINE_AA, _SHIFT)


def _with_arrows(
    seen: Seen, i: int, view: View, arrows: Marks, spacing: int
) -> tuple[Bytes, float]:
    """Return a frame with arrows, and the length of long ones, of which few are drawn shorter than
    they are: it is drawn a little longer than the arrows are apart."""
    fine, arrows = view.fine, view.inside(arrows)
    picture = fine.of(_darkened(seen.clip, i))
    sizes = sizes_of(arrows)
    longest = float(np.quantile(sizes, 0.97)) if len(sizes) else 0.0
    for n in np.argsort(sizes, kind="stable"):
        part = min(float(sizes[n]) / max(longest, 1e-9), 1.0)
        drawn = part * spacing * LONGEST
        if drawn * view.zoom < 2:
            continue
        x, y, dx, dy = (float(each) for each in arrows[n])
        step = drawn / float(np.hypot(dx, dy))
        start, end = fine.at(x, y), fine.at(x + dx * step, y + dy * step)
        tip = min(5.5 / (drawn * view.zoom), 0.5)
        cv2.arrowedLine(picture, start, end, _colour(part), 4, cv2.LINE_AA, _SHIFT, tip)
    return _reduced(picture), longest


def vectors(seen: Seen, i: int, view: View, spacing: int) -> tuple[Bytes, float]:
    """Return a frame with Fv*, of each square of ``spacing`` px the longest; and how long the long
    ones are."""
    analyser = seen.analyser()
    features, window = analyser.features(i), analyser.window
    grid = MarkGrid(spacing, 1)
    arrows = grid.strongest(features.x, features.y, (window.left, window.top))
    return _with_arrows(seen, i, view, arrows, spacing)


def air(seen: Seen, i: int, view: View, spacing: int) -> tuple[Bytes, float]:
    """Return a frame with Bv, the mean of each square of ``spacing`` px; and how fast the fast air
    is, heights/s."""
    field = seen.effect.analysis.field
    arrows = MarkGrid(spacing, 1).means(field.u[i], field.v[i], field.cell)
    picture, longest = _with_arrows(seen, i, view, arrows, spacing)
    return picture, longest / seen.clip.height


def ways(seen: Seen, i: int, view: View, seconds: float = 0.5) -> Bytes:
    """Return a frame with the way of each flake up to it, coloured by speed: yellow is 1 height/s
    or more."""
    clip, frames, fine = seen.clip, seen.effect.tracks.frames, view.fine
    picture = fine.of(_darkened(clip, i))
    for j in range(max(0, i - round(seconds * clip.fps)), i):
        before, after = frames[j], frames[j + 1]
        # The same flake, a frame older: one that outlives a loop is in it twice.
        ages = [np.rint(rows[:, AGE] * clip.fps) for rows in (before, after)]
        keys = before[:, ID] * 4096 + ages[0] + 1, after[:, ID] * 4096 + ages[1]
        _, here, there = np.intersect1d(*keys, return_indices=True)
        for one, other in zip(before[here], after[there], strict=True):
            speed = float(np.hypot(*(other[[X, Y]] - one[[X, Y]]))) * clip.fps / clip.height
            start, end = (fine.at(float(row[X]), float(row[Y])) for row in (one, other))
            cv2.line(picture, start, end, _colour(min(speed, 1.0)), 4, cv2.LINE_AA, _SHIFT)
    for row in frames[i]:
        _dot(picture, fine.at(float(row[X]), float(row[Y])), _WHITE)
    return _reduced(picture)


def births(seen: Seen, i: int, view: View) -> Bytes:
    """Return a frame with its candidates, blue, and the places of all births of the clip."""
    analyser, shown = seen.analyser(), _darkened(seen.clip, i)
    candidates, window = analyser.candidates(analyser.features(i)), analyser.window
    row, column = np.divmod(candidates.places, candidates.width)
    shown[row + window.top, column + window.left] = np.array(RAMP[0]) * 0.7
    picture = view.fine.of(shown)
    for x, y in seen.effect.births:
        _dot(picture, view.fine.at(float(x), float(y)), RAMP[2])
    return _reduced(picture)


def edges(seen: Seen, i: int, view: View) -> Bytes:
    """Return f of eq. 1 in a frame: grey is 0."""
    features = seen.effect.recipe.features
    found = difference_of_gaussians(seen.clip.brightness(i), features.sigma, features.kernel)
    part = found[view.top : view.top + view.height, view.left : view.left + view.width]
    return view.of(_grey(as_plane(0.5 + 0.5 * found / np.abs(part).max())))


def _grey(plane: Plane) -> Bytes:
    """Return a plane, 0..1, as a picture."""
    shown = np.rint(np.clip(plane, 0, 1) * 255).astype(np.uint8)
    return np.ascontiguousarray(np.repeat(shown[..., None], 3, axis=2), np.uint8)


PAPER: Keys = {"features": {"preset": "paper"}}
PAPER_120 = _with(PAPER, flakes={"rate": 120})
DEFAULTS_120: Keys = {"flakes": {"rate": 120}}

FRAME = 16
"""Of the campfire: its flame is tall."""

LATER = 40
"""Another one, half a loop and more after flakes began to fly."""

TIP = View(96, 76, 72, 100, 3)
"""The upper half of the flame in ``FRAME``."""


@dataclass(frozen=True)
class Section:
    """A part of the paper.

    Attributes:
        name: Of its picture.
        title: Its heading.
        paper: What the paper says of it.
        variants: What is compared.
        figures: Of each.
        draw: Draws the rows of its picture.
        alt: What the picture is of, in words.
        seen: What is seen.
        holds: Whether the table is as ``seen`` says.
    """

    name: str
    title: str
    paper: str
    variants: Sequence[Variant]
    figures: Sequence[Figure]
    draw: Callable[[Sequence[Seen]], Sequence[Sequence[Cell]]]
    alt: str
    seen: str
    holds: Callable[[Table], bool]

    @property
    def picture(self) -> Path:
        return DOCS / f"ablation-{self.name}.webp"

    def write_picture(self) -> None:
        """Draw the picture, of the first seed."""
        rows = self.draw([variant.seen() for variant in self.variants])
        strip(rows).save(self.picture, quality=_QUALITY, method=6)

    def markdown(self, number: int, table: Table) -> str:
        """Return the section as it is on the page."""
        return "\n\n".join(
            [
                f"## {number}. {self.title}",
                _wrapped(f"Paper: {self.paper}"),
                f"![{self.alt}]({self.picture.name})",
                table.markdown(),
                _wrapped(f"Seen: {self.seen}"),
            ]
        )


def _wrapped(text: str) -> str:
    return textwrap.fill(text, LINE, break_long_words=False, break_on_hyphens=False)


def _draw_whole(runs: Sequence[Seen]) -> list[list[Cell]]:
    campfire, cartoon = View(20, 8, 216, 300, 1), View(10, 0, 108, 150, 2)
    rows = []
    for name, pair, frames, view in (
        ("campfire", runs[:2], (FRAME, LATER), campfire),
        ("cartoon", runs[2:], (8, 20), cartoon),
    ):
        rows.append(
            [
                Cell(finished(seen, i, view), f"{label}\n{name}, frame {i}")
                for seen, label in zip(pair, ("preset: paper", "defaults"), strict=True)
                for i in frames
            ]
        )
    return rows


def _draw_kernels(runs: Sequence[Seen]) -> list[list[Cell]]:
    cells = []
    for seen in runs:
        kernel = f"kernel: {seen.effect.recipe.features.kernel}"
        cells.append(Cell(edges(seen, FRAME, TIP), f"{kernel}\nf of eq. 1, grey is 0"))
        picture, longest = vectors(seen, FRAME, TIP, 6)
        cells.append(Cell(picture, f"{kernel}\nFv*, the longest {longest:.2g}"))
    return [cells]


def _draw_weights(runs: Sequence[Seen]) -> list[list[Cell]]:
    view, cells = View(56, 62, 136, 220, 1.5), []
    bar = replace(view, width=6)
    for seen in runs:
        picture, longest = air(seen, FRAME, view, 8)
        weight = bar.of(_grey(seen.effect.study.kappa))
        picture = np.hstack([weight, np.zeros_like(weight[:, :3]), picture])
        n = f"n = {seen.effect.recipe.features.n:g}"
        cells.append(Cell(picture, f"{n}\nthe fastest {longest:.2g} heights/s"))
    return [cells]


def _draw_betas(runs: Sequence[Seen]) -> list[list[Cell]]:
    cells = []
    for seen in runs:
        picture, longest = vectors(seen, FRAME, TIP, 6)
        beta = f"beta = {seen.effect.recipe.features.beta:g}"
        cells.append(Cell(picture, f"{beta}\nthe longest {longest:.2g}"))
    return [cells]


def _draw_alphas(runs: Sequence[Seen]) -> list[list[Cell]]:
    view, above, below = View(20, 20, 216, 284, 1), [], []
    for seen in runs:
        flakes = seen.effect.recipe.flakes
        assert flakes != "none"
        alpha = f"alpha = {flakes.alpha:g}"
        above.append(Cell(births(seen, FRAME, view), f"{alpha}\ncandidates and births"))
        below.append(Cell(finished(seen, LATER, view), f"{alpha}, finished"))
    return [above, below]


def _draw_forces(runs: Sequence[Seen]) -> list[list[Cell]]:
    view, above, below = View(20, 4, 216, 288, 4 / 3), [], []
    for seen in runs:
        force = seen.effect.recipe.buoyancy.feature_force
        label = f"feature_force: {force if force == 'auto' else f'{force:g}'}"
        above.append(Cell(finished(seen, LATER, view), f"{label}, finished"))
        below.append(Cell(ways(seen, LATER, view), f"{label}, ways in half a second"))
    return [above, below]


def _draw_blurs(runs: Sequence[Seen]) -> list[list[Cell]]:
    view = View(104, 4, 64, 64, 4.5)
    labels = [
        f"{keys}, {blur}"
        for keys in ("preset: paper", "defaults")
        for blur in ("motion_blur: none", "eq. 17", "exaggeration: 8")
    ]
    cells = [
        Cell(finished(seen, LATER, view), label) for seen, label in zip(runs, labels, strict=True)
    ]
    return [cells[:3], cells[3:]]


def _draw_steps(runs: Sequence[Seen]) -> list[list[Cell]]:
    view = View(42, 4, 172, 300, 1)
    steps = {
        0: "preset: paper",
        2: "+ kernel, constants",
        4: "+ optical flow",
        7: "+ air and own motion",
        10: "= defaults",
    }
    above = [Cell(finished(runs[n], LATER, view), step) for n, step in steps.items()]
    below = [Cell(ways(runs[n], LATER, view), "ways in half a second") for n in steps]
    return [above, below]


def _added_one_by_one() -> list[Variant]:
    """Return the preset, and with it what the defaults add, one after the other."""
    adapted = {"epsilon": "auto", "n": 1.5, "kappa_over": "flame"}
    look = {"colors": "auto", "edge": "fade"}
    added: Sequence[tuple[str, Keys]] = (
        ("`kernel: unit`", {"features": {"kernel": "unit"}}),
        (
            "`epsilon`, `alpha`: `auto`; `n: 1.5`; `kappa_over: flame`",
            {"features": adapted, "flakes": {"alpha": "auto"}},
        ),
        (
            "`stretch: 0`; `scatter: 0.9998`",
            {"flakes": {"stretch": 0.0, "scatter": 0.9998}},
        ),
        ("`motion: flow`", {"buoyancy": {"motion": "flow"}}),
        ("`lift`, `drag`", {"buoyancy": {"lift": "auto", "drag": 2.0}}),
        ("`turbulence`", {"buoyancy": {"turbulence": 0.2}}),
        ("`own_motion`, `lag`", {"flakes": {"own_motion": 1.0, "lag": 0.006}}),
        ("`bursts`, `sparks`", {"flakes": {"bursts": "auto", "sparks": "auto"}}),
        (
            "`colors`, `edge`; `shutter: 0.7`",
            {"flakes": look, "motion_blur": {"flame": False, "shutter": 0.7}},
        ),
        ("`preset: auto`: the defaults", {"features": {"preset": "auto"}}),
    )
    variants = [Variant("`preset: paper`", PAPER_120)]
    for label, blocks in added:
        variants.append(Variant(f"+ {label}", _with(variants[-1].keys, **blocks)))
    return variants


def _of_blurs() -> list[Variant]:
    blurs: Mapping[str, Any] = {
        "`motion_blur: none`": "none",
        "`flame: true`, `shutter: 1`, `exaggeration: 1` (eq. 17)": {
            "flame": True,
            "shutter": 1.0,
            "exaggeration": 1.0,
        },
        "the same, `exaggeration: 8`": {"flame": True, "shutter": 1.0, "exaggeration": 8.0},
    }
    return [
        Variant(f"{name}, {label}", _with(keys, motion_blur=blur))
        for name, keys in (("`preset: paper`", PAPER_120), ("defaults", DEFAULTS_120))
        for label, blur in blurs.items()
    ]


SECTIONS = (
    Section(
        "paper",
        "The paper beside the defaults",
        "one set of constants serves all of its scenes but one (section IV).",
        [
            Variant(f"{label}, {clip}", keys, clip)
            for clip in ("campfire", "cartoon")
            for label, keys in (("`preset: paper`", PAPER), ("defaults", {}))
        ],
        (ALIVE, BIRTH_HEIGHT, RISE, END_HIGHER, SIDEWAYS, UPWARDS, OF_FLOW, LIGHT_SPREAD),
        _draw_whole,
        "Two frames of the campfire and two of the cartoon, with the preset and by default.",
        "with the preset more flakes are alive, nearly equal in light, and the redder the slower "
        "they are. In the campfire they leave the flame at its sides, at a ninth of the speed of "
        "the flow; in the cartoon they are more than twice as fast as the flow and hardly follow "
        "it. By default flakes rise two to four times as far and follow the flow, in the cartoon "
        "at more than twice its speed as well.",
        lambda t: (
            t.of(SIDEWAYS)[0] < 0 < 60 < min(t.of(UPWARDS)[1], t.of(UPWARDS)[3])
            and t.of(OF_FLOW)[0] < 15
            and min(t.of(OF_FLOW)[2:]) > 200
            and t.of(UPWARDS)[2] < 40
            and 4 > t.of(RISE)[1] / t.of(RISE)[0] > t.of(RISE)[3] / t.of(RISE)[2] > 1.8
        ),
    ),
    Section(
        "kernel",
        "The kernel of eq. 1",
        "edges are a difference of Gaussians with the factor 1 / (√(2π) σ); the gradient of the "
        "edges looks like a normal vector (eq. 1, 2; Figure 2c).",
        [
            Variant(f"`kernel: {kernel}`", _with(PAPER_120, features={"kernel": kernel}))
            for kernel in ("unit", "printed")
        ],
        (OUTWARD, KEPT, FEATURES, IN_FLAME, SPEED),
        _draw_kernels,
        "Edges and feature vectors at the tip of the flame, with both kernels.",
        "with the kernel as printed, f is the flame's negative, and nearly all strong vectors "
        "lead out of the flame; with Gaussians of sum 1 they stand on both sides of an edge, three "
        "in ten lead back, a sixth as many exceed ε, and the air in the flame is a tenth as fast.",
        lambda t: (
            t.of(OUTWARD)[1] > 95
            and 65 < t.of(OUTWARD)[0] < 75
            and 5 < t.of(FEATURES)[1] / t.of(FEATURES)[0] < 7
            and 8 < t.of(IN_FLAME)[1] / t.of(IN_FLAME)[0] < 13
        ),
    ),
    Section(
        "kappa",
        "The height weight κ and its exponent n",
        "κ = (y / height)ⁿ, with n = 5, makes feature vectors larger towards the top; without it "
        "the field flows downwards (eq. 2; Figures 4, 5, 8).",
        [Variant(f"`n: {n}`", _with(PAPER_120, features={"n": n})) for n in (0, 1, 5, 10)],
        (SINKING, SINKING_AT_ALL, IN_FLAME, BIRTH_HEIGHT, END_HIGHER),
        _draw_weights,
        "The field Bv of the campfire with four exponents.",
        "as the paper says, air sinks in two fifths of the flame without κ (`n: 0`). `n: 1` does "
        "not prevent it; with `n: 5` it sinks slowly in a sixth of the flame, hardly anywhere "
        "faster, and its speed is a seventieth. With `n: 10` the air in the flame is still, and "
        "what remains of the field is above it.",
        lambda t: (
            min(t.of(SINKING)[:2]) > 38
            and max(t.of(SINKING)[2:]) < 0.1
            and 60 < t.of(IN_FLAME)[0] / t.of(IN_FLAME)[2] < 80
            and t.of(IN_FLAME)[3] < 0.001
            and 10 < t.of(SINKING_AT_ALL)[2] < 25
        ),
    ),
    Section(
        "beta",
        "The buoyancy direction in Fv* and its weight β",
        "F_buoyancy ‖∇f κ‖ β, with β = 0.02, refines the vectors, whose direction may differ from "
        "that of buoyancy, to move along the flame (eq. 3; Figure 6).",
        [
            Variant(f"`beta: {b}`", _with(PAPER_120, features={"beta": b}))
            for b in (0, 0.02, 0.2, 2)
        ],
        (TURNED, RISE, IN_FLAME),
        _draw_betas,
        "Feature vectors at the tip of the flame with four weights.",
        "0.02 turns vectors by less than a degree, which the arrows do not show; 0.2 turns them by "
        "8°, and 2, a hundred times the paper's, upright. Flakes rise the further the larger β is.",
        lambda t: (
            t.of(TURNED)[1] < 1
            and 7 < t.of(TURNED)[2] < 8.5 < 60 < t.of(TURNED)[3]
            and _rises(t.of(RISE))
        ),
    ),
    Section(
        "alpha",
        "The threshold of candidates α",
        "flakes are born where the length of Fv* exceeds α = 0.03; the smaller α, the wider this "
        "region and the more flakes (Figures 7b, 22).",
        [Variant(f"`alpha: {a}`", _with(PAPER_120, flakes={"alpha": a})) for a in (0, 0.03, 3, 30)],
        (CANDIDATES, BIRTHS, BIRTH_HEIGHT, ALIVE),
        _draw_alphas,
        "Candidates, births, and finished frames, with four thresholds.",
        "births are in proportion to the candidates, whose region shrinks from the whole flame to "
        "its tips; with `alpha: 30` fewer than one flake a second is born.",
        lambda t: (
            _rises(t.of(CANDIDATES)[::-1])
            and _rises(t.of(BIRTH_HEIGHT))
            and t.of(BIRTHS)[3] < 1
            and max(
                abs(b / t.of(BIRTHS)[1] - c / t.of(CANDIDATES)[1])
                for b, c in zip(t.of(BIRTHS), t.of(CANDIDATES), strict=True)
            )
            < 0.1
        ),
    ),
    Section(
        "force",
        "Fv* as the force of the field",
        "Fv* is the force U_buoyancy of the Navier-Stokes equation (eq. 12; Figure 7a); its unit "
        "is not stated.",
        [
            Variant(f"`feature_force: {f}`", _with(PAPER_120, buoyancy={"feature_force": f}))
            for f in (0, "auto", 256)
        ],
        (SPEED, RISE, FASTEST, FAST, CONVERGENCE),
        _draw_forces,
        "Finished frames, and the ways of flakes, with three forces.",
        "without it nothing moves. Four times the force makes the fastest air four times as fast, "
        "most of it twice, and flakes not twice. Flakes leave the flame to both sides, and gather "
        "where the air converges with the largest force, in rows.",
        lambda t: (
            t.of(SPEED)[0] == 0
            and 3.5 < t.of(FASTEST)[2] / t.of(FASTEST)[1] < 4.5
            and 1.8 < t.of(FAST)[2] / t.of(FAST)[1] < 2.5
            and t.of(SPEED)[2] < 1.9 * t.of(SPEED)[1]
            and t.of(CONVERGENCE)[2] > 1
        ),
    ),
    Section(
        "blur",
        "Artificial motion blur",
        "light is gathered along the path Bv κ while the shutter is open, in the words of section "
        "III-D an exaggeration of the motion (eq. 14-17; Figure 11).",
        _of_blurs(),
        (STREAK, SMEAR, SHARPNESS),
        _draw_blurs,
        "A tip of the flame without blur, with that of eq. 17, and with one eight times as long.",
        "with the paper's constants eq. 17 makes flakes half a px longer and moves nine tenths of "
        "the flame by less than a twentieth of a px, so that only its fastest tips soften. Eight "
        "times as long, it draws a tip out of which the air leads to both sides into two bands, "
        "with a sharp line between them. In the faster field of the defaults eq. 17 itself is "
        "seen in flakes and flame, and eight times its length dissolves the tips.",
        lambda t: (
            0 < t.of(STREAK)[1] - t.of(STREAK)[0] < 0.8
            and t.of(SMEAR)[1] < 0.05
            and t.of(SMEAR)[4] > 3
            and t.of(SHARPNESS)[1] > 0.98 * t.of(SHARPNESS)[0]
            and t.of(SHARPNESS)[4] < 0.93 * t.of(SHARPNESS)[3]
            and t.of(SHARPNESS)[5] < 0.7 * t.of(SHARPNESS)[3]
        ),
    ),
    Section(
        "steps",
        "What is added here",
        "nothing of this. From its preset to the defaults, one addition after the other; each row "
        "has all of those above it.",
        _added_one_by_one(),
        (SIDEWAYS, UPWARDS, OF_FLOW, RISE, END_HIGHER, LIGHT_SPREAD, STREAK),
        _draw_steps,
        "Finished frames and the ways of flakes at five of these steps.",
        "it is the optical flow with which flakes follow the flame, at its speed, and rise out of "
        "it. What comes after it lowers the correlation: `lift` makes flakes in the flame faster "
        "than the flow, their own motion and sparks spread them, and sparks fall. Their light "
        "differs by the last step alone.",
        lambda t: (
            t.of(SIDEWAYS)[3] < 20 < 80 < t.of(SIDEWAYS)[4]
            and max(t.of(UPWARDS)[:4]) + 5 < t.of(UPWARDS)[4]
            and t.of(UPWARDS)[4] == max(t.of(UPWARDS))
            and t.of(SIDEWAYS)[4] == max(t.of(SIDEWAYS))
            and abs(t.of(OF_FLOW)[4] - 100) < 5 < t.of(OF_FLOW)[5] - 100
            and t.of(RISE)[4] > 2 * max(t.of(RISE)[:4])
            and t.of(END_HIGHER)[8] < 95 < min(t.of(END_HIGHER)[:8])
            and t.of(LIGHT_SPREAD)[10] > 5 * max(t.of(LIGHT_SPREAD)[:10])
        ),
    ),
)

HEAD = """\
# What each part of Kim & Lee's effect does

<!-- Written by python -m tools.bench.ablation --write: do not edit by hand. -->
"""

ABOUT = """\
The parts of the first of [the three papers](papers.md#kim--lee-fire-flakes), each taken out or set
to other values, on the sample campfire (256 × 320 px, 24 frames a second), in section 1 also on the
cartoon (128 × 160 px, 12 frames a second). `preset: paper` is `features: {preset: paper}`: the
paper's constants, and nothing of what is added here ([reference](recipe.md)). Section 1 has the
automatic rate of births, all others have `flakes: {rate: 120}`.
"""

READING = """\
Figures are the mean of three seeds; pictures show the first. A height is that of the frame. The
flame is where the field's cells are at least half as bright as flame. The flow is the clip's, by
dense inverse search; flakes are held to it where the flame moves, without sparks, which fly on
their own. Arrows are coloured and scaled by their length, blue for short and yellow for long ones,
each picture by a scale of its own, which its caption states. Ways of flakes are coloured by speed,
blue for slow and yellow for 1 height a second or more; white dots are where the flakes are. In
section 3 the bar at the left of each picture is κ, white where it is 1; in section 5 the candidates
of a frame are blue, and all births of the clip yellow.
"""


def page(tables: Sequence[Table]) -> str:
    """Return docs/ablation.md."""
    parts = [HEAD.strip(), _wrapped(" ".join(ABOUT.split())), _wrapped(" ".join(READING.split()))]
    parts += [
        section.markdown(number, table)
        for number, (section, table) in enumerate(zip(SECTIONS, tables, strict=True), 1)
    ]
    return "\n\n".join(parts) + "\n"


def main() -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("sections", nargs="*", metavar="SECTION", help="only these")
    parser.add_argument("--write", action="store_true", help="write docs/ablation.md")
    args = parser.parse_args()
    chosen = [s for s in SECTIONS if not args.sections or s.name in args.sections]
    tables, failed = list[Table](), 0
    for section in chosen:
        tables.append(Table.measured(section.variants, section.figures))
        print(f"{section.title}\n{tables[-1].markdown()}", flush=True)
        if not section.holds(tables[-1]):
            failed += 1
            print(f"does not hold: {section.seen}", file=sys.stderr)
        if args.write:
            section.write_picture()
    if args.write and len(chosen) == len(SECTIONS):
        PAGE.write_text(page(tables), encoding="utf-8")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())

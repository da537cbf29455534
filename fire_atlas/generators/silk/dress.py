"""What is on the sheets: which images, at which phase, and the light they give."""

from collections.abc import Sequence as Several
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.chance import Stage, generator
from fire_atlas.core.pixels import REC709
from fire_atlas.generators.silk.raster import Triangles
from fire_atlas.generators.silk.simulation import Recording
from fire_atlas.generators.silk.texture import Sequence
from fire_atlas.generators.silk.tint import Tint

_DARK = 1e-4


@dataclass(frozen=True, slots=True)
class Dress:
    """Images on sheets.

    Attributes:
        sequences: All of one shape.
        worn: (sheets,) which sequence each sheet wears.
        mirrored: (sheets,) whether it is worn the other way round.
        phase: (frames, sheets), images.
        rate: (frames, sheets), images/s.
        tint: From images to light.
        v_rms: (frames, sheets), heights/s.
    """

    sequences: tuple[Sequence, ...]
    worn: NDArray[np.intp]
    mirrored: NDArray[np.bool_]
    phase: NDArray[np.float64]
    rate: NDArray[np.float64]
    tint: Tint
    v_rms: NDArray[np.float64]

    @property
    def shape(self) -> tuple[int, int]:
        """(height, width) of an image, px."""
        height, width = self.sequences[0].images.shape[1:3]
        return height, width

    def light(self, i: int, sheets: slice) -> NDArray[np.float32]:
        """Light of some sheets in frame ``i``, one image above the other: (n·height, width, 3)."""
        return np.concatenate([self._light(i, s) for s in range(sheets.start, sheets.stop)])

    def flowing(self, i: int, sheets: slice) -> NDArray[np.float32]:
        """Luminance, and motion to the right and down in texels/s, of some sheets, likewise."""
        return np.concatenate([self._flowing(i, s) for s in range(sheets.start, sheets.stop)])

    def grid(self, sheets: slice, rows: int, columns: int) -> NDArray[np.float64]:
        """Texel (sheets, rows, columns, 2) that each node shows, in what ``light`` returns."""
        height, width = self.shape
        grid = np.empty((sheets.stop - sheets.start, rows, columns, 2))
        grid[..., 0] = np.linspace(0, width - 1, columns)
        grid[..., 1] = np.linspace(height - 1, 0, rows)[:, None]
        grid[..., 1] += (np.arange(len(grid)) * height)[:, None, None]
        return grid

    def lit(self, light: NDArray[np.float32], triangles: Triangles, sheets: slice) -> Triangles:
        """The triangles on which any light is; most of a sheet is dark."""
        place = triangles.texel[..., :2]
        low = np.floor(place.min(axis=1)).astype(np.intp)
        high = np.ceil(place.max(axis=1)).astype(np.intp) + 1
        # Of a table of sums over all texels above and to the left, four tell the sum of any box.
        red, green, blue = (light[..., c] for c in range(3))  # numpy is slow along a short axis
        bright = (np.maximum(np.maximum(red, green), blue) > _DARK).astype(np.int32)
        table = np.zeros((bright.shape[0] + 1, bright.shape[1] + 1), np.int32)
        np.cumsum(np.cumsum(bright, axis=0), axis=1, out=table[1:, 1:])
        x0, y0 = low[:, 0], low[:, 1]
        x1, y1 = np.minimum(high[:, 0], bright.shape[1]), np.minimum(high[:, 1], bright.shape[0])
        is_lit = table[y1, x1] - table[y0, x1] - table[y1, x0] + table[y0, x0] > 0
        return Triangles(triangles.place[is_lit], triangles.texel[is_lit])

    def _light(self, i: int, sheet: int) -> NDArray[np.float32]:
        image = self.sequences[self.worn[sheet]].at(float(self.phase[i, sheet]))
        if self.mirrored[sheet]:
            image = np.ascontiguousarray(image[:, ::-1])
        return self.tint.light(image, float(self.v_rms[i, sheet]))

    def _flowing(self, i: int, sheet: int) -> NDArray[np.float32]:
        sequence, phase = self.sequences[self.worn[sheet]], float(self.phase[i, sheet])
        motion = sequence.motion_at(int(np.floor(phase)) % len(sequence))
        motion = motion * np.float32(self.rate[i, sheet])
        if self.mirrored[sheet]:
            motion = motion[:, ::-1] * np.array([-1, 1], np.float32)
        luminance = np.einsum("hwc,c->hw", self._light(i, sheet), REC709)
        return np.concatenate([luminance[..., None], motion], axis=-1)


def dress(
    sequences: Several[Sequence], told: Recording, tint: Tint, seed: int, fps: float, loops: bool
) -> Dress:
    """Give every sheet a sequence, and a random image of it to begin with (section 4).

    In a loop each sheet plays its sequence a whole number of times, so its speed is changed by as
    little as that takes.
    """
    sheets = told.rate.shape[1]
    images = len(sequences[0])
    chance = generator(seed, Stage.SHEETS, 1)
    # No two sheets begin alike: starts are spread evenly over the sequence, and then shuffled.
    start = (chance.permutation(sheets) + chance.uniform(0, 0.8, sheets)) / sheets * images
    rate = told.rate.copy()
    if loops:
        once = rate[:-1].sum(axis=0) / fps
        rate *= np.maximum(np.rint(once / images), 1) * images / once
    passed = np.concatenate([np.zeros((1, sheets)), np.cumsum(rate[:-1], axis=0) / fps])
    phase = np.mod(start + passed, images)
    if loops:
        # Sums of rounded numbers do not come out even to the last bit.
        phase[-1] = phase[0]
    return Dress(
        sequences=tuple(sequences),
        worn=np.arange(sheets) % len(sequences),
        mirrored=np.asarray(chance.random(sheets) < 0.5),
        phase=phase,
        rate=rate,
        tint=tint,
        v_rms=told.v_rms,
    )


def images_of_a_loop(told: Recording, fps: float, loops: bool) -> float:
    """How many images the sheets play in all their frames, on average."""
    frames = len(told.rate) - 1 if loops else len(told.rate)
    return float(told.rate[:frames].sum(axis=0).mean()) / fps

"""The marks of an analysis as data of the preview page, which draws them itself."""

import base64
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import srgb_to_hex
from fire_atlas.preview.field_marks import (
    LAYERS,
    LONGEST,
    RAMP,
    SHORTEST,
    FieldLayer,
    FieldMarks,
    Marks,
    size_text,
    sizes_of,
)

_SIZE = 4096
"""What the page reads as the length of the longest mark."""

_FINEST = 4
"""Maximum number of steps per px in the places that the page reads."""


@dataclass(frozen=True, slots=True)
class FieldData:
    """The marks of the animations of a page, by name; none where the page has an atlas alone."""

    marks: Mapping[str, FieldMarks]

    def choices(self, names: Iterable[str]) -> dict[str, Any]:
        """Return what the page's HTML needs: layers to choose from, and rows by animation.

        ``names``: of the animations, in order.
        """
        known = {layer for marks in self.marks.values() for layer in marks.longest}
        return {
            "layers": {layer: text.word for layer, text in LAYERS.items() if layer in known},
            "colours": [srgb_to_hex(colour) for colour in RAMP],
            "rows": [_rows(self.marks[name]) for name in names if name in self.marks],
        }

    def of(self, name: str) -> dict[str, Any] | None:
        """Return what the page's script needs to draw an animation's rows; None without any."""
        if name not in self.marks:
            return None
        marks = self.marks[name]
        return {
            "colours": [srgb_to_hex(colour) for colour in RAMP],
            "units": (_steps_per_px(marks), _SIZE),
            "reach": marks.grid.spacing * LONGEST,
            "block": marks.grid.block,
            "layers": {
                layer: {
                    "title": LAYERS[layer].title,
                    "longest": size_text(longest, layer),
                    "counts": [len(_drawn(marks, layer, i)) for i in range(len(marks.frames))],
                }
                for layer, longest in marks.longest.items()
            },
        }


def _steps_per_px(marks: FieldMarks) -> int:
    """Return how finely places are stated: in frames so large that int16 could not hold them, less
    finely."""
    furthest = max(
        layer[:, :2].max(initial=1) for frame in marks.frames for layer in frame.values()
    )
    return min(_FINEST, int(np.iinfo(np.int16).max / furthest))


def _rows(marks: FieldMarks) -> str:
    """Return all marks, layer after layer and frame after frame, as base64 of int16.

    A row is x, y and the vector or, of a candidate, x, y, its weight and 0.
    """
    steps = _steps_per_px(marks)
    rows = [
        _row_values(marks, layer, i, steps)
        for layer in marks.longest
        for i in range(len(marks.frames))
    ]
    return base64.b64encode(np.concatenate(rows).astype("<i2").tobytes()).decode()


def _row_values(marks: FieldMarks, layer: FieldLayer, i: int, steps: int) -> NDArray[np.float64]:
    """Return the rows of a frame's marks, whose places are stated in ``steps`` per px."""
    drawn: Marks = marks.frames[i][layer][_drawn(marks, layer, i)]
    size = sizes_of(drawn)
    vectors = np.zeros((len(drawn), 2))
    vectors[:, : drawn.shape[1] - 2] = drawn[:, 2:]
    vectors *= _SIZE / np.maximum(np.maximum(size, marks.longest[layer]), 1e-12)[:, None]
    return np.asarray(np.rint(np.column_stack([drawn[:, :2] * steps, vectors])))


def _drawn(marks: FieldMarks, layer: FieldLayer, i: int) -> NDArray[np.intp]:
    """Return which of a frame's marks are long enough to be drawn, the longest last."""
    size = sizes_of(marks.frames[i][layer])
    order = np.argsort(size, kind="stable")
    if layer == "candidates":
        return order
    return order[size[order] / (marks.longest[layer] or 1.0) >= SHORTEST]

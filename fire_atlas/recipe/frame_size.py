"""Sizes of frames by their names, as ``source.size`` of generated fire states them."""

from typing import Any, Literal, Self

from pydantic import Field, model_validator

from fire_atlas.recipe.base import Settings
from fire_atlas.recipe.problem import ContradictionError, Problem

FrameSize = Literal["draft", "game", "hero"]

LONGER_SIDE: dict[FrameSize, int] = {"draft": 192, "game": 384, "hero": 512}
"""Length of a frame's longer side, px, from the smallest size to the largest."""


def frame_of(size: FrameSize, aspect: float) -> tuple[int, int]:
    """Return the width and height, px, of a frame that is ``aspect`` times as wide as high."""
    side = LONGER_SIDE[size]
    return (side, round(side / aspect)) if aspect > 1 else (round(side * aspect), side)


_SIDE = 256
"""Width and height of a frame by default, px."""

_SIDES = ("width", "height")

_LEAST_ASPECT, _MOST_ASPECT = 0.25, 4


def _frame(stated: dict[str, Any]) -> tuple[int, int]:
    """Return the width and height, px, that follow from the keys ``stated`` above them."""
    size = stated.get("size")
    return frame_of(size, stated.get("aspect") or 1) if size else (_SIDE, _SIDE)


class SizedFrame(Settings):
    """The frame of a fire that is simulated: a named size and a shape, or both sides."""

    size: FrameSize | None = None
    """Length of a frame's longer side: ``draft`` 192 px, ``game`` 384 px, ``hero`` 512 px. Default:
    ``width`` and ``height`` state both sides; beside ``size`` they are refused."""
    aspect: float | None = Field(default=None, ge=_LEAST_ASPECT, le=_MOST_ASPECT)
    """Width of a frame divided by its height, for ``size`` alone. Default: 1, a square."""
    width: int = Field(
        default_factory=lambda stated: _frame(stated)[0], ge=16, le=4096,
        json_schema_extra={"default": _SIDE},
    )  # fmt: skip
    """Width of a frame, px."""
    height: int = Field(
        default_factory=lambda stated: _frame(stated)[1], ge=16, le=4096,
        json_schema_extra={"default": _SIDE},
    )  # fmt: skip
    """Height of a frame, px."""

    @model_validator(mode="after")
    def _states_its_frame_once(self) -> Self:
        sides = [key for key in _SIDES if key in self.model_fields_set]
        if self.size is not None and sides:
            raise ContradictionError(Problem(("size",), self._frame_stated_twice(self.size, sides)))
        if self.size is None and self.aspect is not None:
            raise ContradictionError(
                Problem(
                    ("aspect",),
                    "is the shape of a frame whose longer side is a size, and there is none; "
                    "remove it and state width and height, or those and write size: game",
                )
            )
        return self

    def _frame_stated_twice(self, size: FrameSize, sides: list[str]) -> str:
        """Return advice that keeps the proportion of the frame with the stated ``sides``."""
        width, height = (getattr(self, key) if key in sides else _SIDE for key in _SIDES)
        aspect = self.aspect or min(max(width / height, _LEAST_ASPECT), _MOST_ASPECT)
        shaped = f" and write aspect: {aspect:.4g}" if aspect not in (self.aspect, 1) else ""
        named = "size" if self.aspect is None else "size and aspect"
        width, height = frame_of(size, aspect)
        return (
            f"says how large a frame is, as {' and '.join(sides)} would; remove "
            f"{' and '.join(sides)}{shaped}, or remove {named} and write width: {width} and "
            f"height: {height}"
        )

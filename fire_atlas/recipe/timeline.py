"""Recipe block ``timeline``: length, frame rate and looping of the result."""

from collections.abc import Iterator
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from fire_atlas.recipe.base import NUMBER, OFF, SWITCH, Auto, Settings, either
from fire_atlas.recipe.problem import ContradictionError, Problem

Overlap = Annotated[
    Auto | Annotated[int, Field(ge=1, le=240), NUMBER], either("`auto` or a whole number")
]
Tail = Annotated[
    Annotated[bool, SWITCH] | Annotated[float, Field(ge=0, le=60), NUMBER],
    either("true, false or a number of seconds"),
]


class Timeline(Settings):
    """Length, frame rate and looping of the result."""

    loop: Annotated[Literal["auto", "none", "crossfade", "pingpong"], OFF] = "auto"
    """``auto``: a clip that loops already is kept as it is; one that starts from nothing or fades
    to nothing plays once; any other is cut where its end matches its beginning best, and
    cross-faded there (a short clip keeps at least half of its frames); flat art is never faded,
    but cut hard or played there and back. ``crossfade``: the whole clip, its end faded into its
    beginning. ``pingpong``: forwards, then backwards. ``none``: play once. Generated fire (source
    ``silk``, ``fluid`` or ``profile``) loops, but for what burns out: ``auto`` or ``none``."""
    frames: int | None = Field(default=None, ge=1, le=10_000)
    """Number of frames of the result. If it exceeds the clip's, the clip is extended by transitions
    between moments that look alike. One, two or three images are animated instead: each turns into
    the next, and the flame sways and breathes (with ``loop: auto`` or ``none``).
    Default: as the best cut gives; 48 for generated fire."""
    fps: float | None = Field(default=None, ge=0.01, le=240)
    """Frames per second of the result. The fire keeps its speed. Frames in between are
    interpolated, but a drawing that the clip holds for several frames stays until the next one.
    Default: the clip's; 24 for generated fire."""
    overlap: Overlap = "auto"
    """Length of the cross-fade, frames of the clip. ``auto``: a third of a second, less if the clip
    is short; whole drawings if the clip holds each for several frames."""
    tail: Tail = False
    """Append frames to a clip that plays once until all flakes have burnt out, while its last frame
    fades. A number is the maximum length, s."""

    @model_validator(mode="after")
    def _refuse_contradictions(self) -> Self:
        if problems := tuple(self._contradictions()):
            raise ContradictionError(*problems)
        return self

    def _contradictions(self) -> Iterator[Problem]:
        if self.tail and self.loop in ("crossfade", "pingpong"):
            yield Problem(
                ("tail",),
                f"lets flakes burn out after a clip that plays once, and loop: {self.loop} never "
                f"ends; leave tail out, or use loop: none",
            )
        if self.overlap != "auto" and self.loop in ("none", "pingpong") and not self._may_extend:
            yield Problem(
                ("overlap",),
                f"is the length of a cross-fade, but loop: {self.loop} has none; leave overlap "
                f"out, or use loop: crossfade",
            )
        if self.loop == "pingpong" and self.fps is None and self.frames and self.frames % 2:
            yield Problem(
                ("frames",),
                f"a pingpong has an even number of frames; frames: {self.frames + 1} or "
                f"{max(self.frames - 1, 2)} would be one",
            )

    @property
    def keeps_all_frames(self) -> bool:
        """Whether all frames are shown as they are: at most ``loop: auto`` or ``none`` is set."""
        return self in (Timeline(), Timeline(loop="none"))

    @property
    def _may_extend(self) -> bool:
        """Whether ``frames`` might exceed the frames of a clip that plays once."""
        return self.loop == "none" and self.frames is not None

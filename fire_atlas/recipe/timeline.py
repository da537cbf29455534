"""Recipe block ``timeline``: how the clip plays."""

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
    """How the clip plays."""

    loop: Annotated[Literal["auto", "none", "crossfade", "pingpong"], OFF] = "auto"
    """``auto``: a clip whose end meets its beginning plays round and round as it is; another is cut
    where its end meets its beginning best, and cross-faded there (a short one keeps at least half
    of its frames); one that flares up from nothing, or fades to nothing, plays once.
    ``crossfade``: the whole clip, its end faded into its beginning. ``pingpong``: forwards, then
    backwards. ``none``: once. Generated fire (source ``silk`` or ``profile``) loops already:
    ``auto`` or ``none``."""
    frames: int | None = Field(default=None, ge=1, le=10_000)
    """How many frames result. More than the clip has: fire goes on by passing between moments of
    the clip that look alike. Default: as many as suit the cut; 48 of generated fire."""
    fps: float | None = Field(default=None, ge=0.01, le=240)
    """Frames per second of the result; fire keeps its speed. Default: those of the clip; 24 of
    generated fire."""
    overlap: Overlap = "auto"
    """Frames of the clip over which its end passes into its beginning. ``auto``: a third of a
    second, less where the clip is short."""
    tail: Tail = False
    """Goes on after a clip that plays once until its flakes have burnt out, while its last frame
    fades; a number is the most seconds to add."""

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
                f"is for an end that is faded into a beginning, which loop: {self.loop} does not "
                f"do; leave overlap out, or use loop: crossfade",
            )
        if self.loop == "pingpong" and self.fps is None and self.frames and self.frames % 2:
            yield Problem(
                ("frames",),
                f"a pingpong has an even number of frames; frames: {self.frames + 1} or "
                f"{max(self.frames - 1, 2)} would be one",
            )

    @property
    def keeps_frames(self) -> bool:
        """Whether the frames of the clip play as they are: nothing but ``loop`` is set."""
        return self in (Timeline(), Timeline(loop="none"))

    @property
    def _may_extend(self) -> bool:
        """Whether a clip that plays once is extended: ``frames`` may be more than it has."""
        return self.loop == "none" and self.frames is not None

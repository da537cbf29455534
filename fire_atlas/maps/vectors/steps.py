"""The motion between frames of one animation, by one method: each step is estimated once."""

from collections.abc import Callable, Iterable, Sequence

from fire_atlas.core.pixels import Bytes
from fire_atlas.core.workers import Workers
from fire_atlas.maps.vectors.flow import Method, StepMotion, step_motion

Step = tuple[int, int]
"""Numbers of the frames that a step leads from and to."""


class Steps:
    """Motion from frame to frame of an animation, as far as it is known."""

    def __init__(
        self, pictures: Sequence[Bytes], loop: bool, method: Method, workers: Workers
    ) -> None:
        """Begin without any step.

        Args:
            pictures: Every frame, (h, w, 4) uint8.
            loop: Whether the first frame follows the last: frames are then numbered on and on.
            method: How optical flow is estimated.
            workers: Estimate it in parallel.
        """
        self._pictures, self._loop, self._method, self._workers = pictures, loop, method, workers
        self._known: dict[Step, StepMotion] = {}

    def picture(self, i: int) -> Bytes:
        """Return frame ``i``; beyond the ends of what plays once, the frame at that end."""
        return self._pictures[self._number(i)]

    def motion(self, step: Step) -> StepMotion | None:
        """Return the motion of a step that was estimated; None beyond the ends of what plays
        once."""
        return self._known[self._inside(step)] if self._exists(step) else None

    def estimate(self, steps: Iterable[Step], advance: Callable[[], None] = lambda: None) -> None:
        """Estimate the motion of these ``steps``, as far as they exist and are not known, in
        parallel; ``advance`` is called after each."""
        wanted = dict.fromkeys(self._inside(step) for step in steps if self._exists(step))
        missing = [step for step in wanted if step not in self._known]
        for _ in range(len(wanted) - len(missing)):
            advance()
        found = self._workers.map(
            lambda step: step_motion(
                self._pictures[step[0]], self._pictures[step[1]], self._method
            ),
            missing,
        )
        for step, motion in zip(missing, found, strict=True):
            self._known[step] = motion
            advance()

    def forget_all_but(self, steps: Iterable[Step]) -> None:
        """Free the memory of what is known of other steps."""
        kept = {self._inside(step) for step in steps}
        self._known = {step: motion for step, motion in self._known.items() if step in kept}

    def played(self) -> list[Step]:
        """Return the step out of each frame, as they are played; that out of the last frame exists
        in loops alone."""
        return [(i, i + 1) for i in range(len(self._pictures))]

    def _number(self, i: int) -> int:
        count = len(self._pictures)
        return i % count if self._loop else min(max(i, 0), count - 1)

    def _inside(self, step: Step) -> Step:
        return self._number(step[0]), self._number(step[1])

    def _exists(self, step: Step) -> bool:
        count = len(self._pictures)
        return count > 1 and (self._loop or (step[0] >= 0 and step[1] < count))

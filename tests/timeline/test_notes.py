"""What the build says it did to a clip, and why."""

import re
from typing import Any

import numpy as np
import pytest

from fire_atlas.core.clip import Clip
from fire_atlas.core.workers import Workers
from fire_atlas.recipe.timeline import Timeline
from fire_atlas.timeline.arrange import arrange
from tests.support.clips import clip_of
from tests.timeline.moving import Notes, arranged, blob, circling, moving, steps, turbulent

_SEAM = re.compile(r"the step from its last frame to its first is ([\d.]+) times the median step")


def noted(clip: Clip, **keys: Any) -> tuple[Clip, str]:
    """Return the arranged clip and all notes on it."""
    progress = Notes()
    made = arranged(clip, progress, **keys)
    return made, "; ".join(progress.notes)


@pytest.mark.parametrize(
    ("clip", "keys", "said"),
    [
        (circling(24, 24), {}, "the clip loops as it is"),
        (turbulent(40), {}, "a loop of {count} frames from frame "),
        (turbulent(40), {"frames": 20}, "a loop of 20 frames from frame "),
        (turbulent(40), {"frames": 20}, "(timeline.frames)"),
        (turbulent(40), {"frames": 90}, "jumps between similar moments"),
        (turbulent(40), {"loop": "crossfade"}, "a loop of {count} frames, its end cross-faded"),
        (turbulent(40), {"loop": "pingpong"}, "a loop of 78 frames, forwards and backwards"),
        (turbulent(40), {"loop": "none"}, "the clip plays once, 40 frames (timeline.loop: none)"),
        (turbulent(40), {"loop": "none", "frames": 9}, "the clip plays once, 9 frames"),
        (turbulent(40), {"loop": "none", "frames": 70}, "40 frames go on to 70 (timeline.frames)"),
        (turbulent(2), {}, "the clip plays once: a loop has at least 3 frames, and it has 2"),
        (turbulent(5), {}, "so it plays once"),
    ],
)
def test_every_treatment_has_its_line(clip: Clip, keys: dict[str, Any], said: str) -> None:
    made, notes = noted(clip, **keys)
    assert said.format(count=made.count) in notes
    assert "become" not in notes


@pytest.mark.parametrize("keys", [{}, {"loop": "crossfade", "overlap": 6}])
def test_a_cut_is_explained_by_the_step_that_it_saves(keys: dict[str, Any]) -> None:
    clip = turbulent(40)
    made, notes = noted(clip, **keys)
    found = _SEAM.search(notes)
    assert found and "uncut" in notes
    shown = clip if not keys else clip_of([clip.read(i) for i in range(made.count)])
    frames = [shown.read(i) for i in (-1, 0)]
    seam = np.sqrt(np.mean((frames[0] - frames[1]) ** 2))
    assert float(found[1]) == pytest.approx(seam / np.median(steps(shown)), rel=0.1)


@pytest.mark.parametrize(
    ("clip", "keys", "said"),
    [
        (
            circling(24, 24),
            {"fps": 48},
            "24 frames at 24 fps become 48 at 48: those between two are",
        ),
        (circling(24, 24), {"fps": 12}, "24 frames at 24 fps become 12 at 12"),
        (circling(24, 24), {"fps": 24.2, "frames": 24}, "become 24 at 24.2: each is shown"),
        (
            clip_of([np.full((8, 8, 4), i % 2, np.float32) for i in range(12)]),
            {"fps": 48, "loop": "none"},
            "the nearest are shown, as it has too few colours",
        ),
    ],
)
def test_another_rate_has_its_line(clip: Clip, keys: dict[str, Any], said: str) -> None:
    assert said in noted(clip, **keys)[1]


def test_the_clips_own_rate_is_no_change() -> None:
    assert "fps" not in noted(circling(24, 24), fps=24)[1]


@pytest.mark.parametrize(
    ("clip", "said"),
    [
        (circling(24, 24), "packed as they are, and loop: the step from its last frame"),
        (circling(24, 13), "packed as they are, and play once: the step from its last frame"),
        (
            clip_of([blob(48, 48, light=v) for v in (0.0, 0.5, 1.0, 0.8, 0.0)]),
            "and play once: the fire flares up from nothing and fades to nothing",
        ),
        (moving(lambda i: (48, 48), 5), "and loop: most of its frames are equal"),
    ],
)
def test_frames_that_are_only_packed_have_their_line(clip: Clip, said: str) -> None:
    progress = Notes()
    with Workers(2) as workers:
        arrange(clip, Timeline(), 0.0, workers, progress, only_packs=True)
    assert said in "; ".join(progress.notes)

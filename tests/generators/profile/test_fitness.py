"""Which clips are refused, why, and where the advice leads."""

import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fire_atlas.core.clip import Clip, Window, cropped
from fire_atlas.core.errors import SourceError
from fire_atlas.core.pixels import Pixels, linear_to_srgb
from fire_atlas.core.shipped import shipped
from fire_atlas.core.workers import Workers
from fire_atlas.generators.profile.learn.fitness import refuse_unfit, size_advice
from fire_atlas.vision.sampling import evenly_spread
from tests.generators.profile.flames import (
    BASE,
    FOOT,
    HEIGHT,
    TIP,
    WIDTH,
    clip_of,
    kite,
    painted,
    swaying,
)
from tests.generators.profile.test_recipe import run, save
from tests.support.clips import open_clip, piece, proxied, real
from tests.support.likeness import learnt, learnt_from

DOZEN = evenly_spread(0, 47, 12)
"""The frames of a clip of 48 that are looked at first."""


def judged(clip: Clip, threshold: float | None = None) -> str | None:
    """Return why a clip is refused; None if it is not."""
    with Workers(2) as workers:
        try:
            refuse_unfit(proxied(clip).proxy, "clip", threshold, workers)
        except SourceError as error:
            return str(error).removeprefix("clip: ")
    return None


def frames_of(clip: Clip) -> list[Pixels]:
    return [clip.read(i) for i in range(clip.count)]


def advised_part(why: str, clip: Clip) -> Clip:
    """Return the part of a clip that a message advises to use."""
    start = re.search(r"source\.start (\d+) higher", why)
    count = re.search(r"source\.count to (\d+)", why)
    assert count is not None, why
    return piece(clip, int(start[1]) if start else 0, int(count[1]))


# On the first dozen only what is gross is refused.


def test_a_frame_that_is_like_many_others_is_not_refused_for_the_few_that_are_seen_first() -> None:
    """A flame is a fifth shorter in a third of its frames, of which one is of the first dozen."""
    clip, _ = swaying(48, reach=1.0)
    frames = frames_of(clip)
    short = [*[i for i in range(48) if i not in DOZEN][:15], 47]
    for i in short:
        frames[i][: int(TIP + 0.4 * (BASE - TIP))] = 0
    assert judged(clip_of(frames)) is None


def test_a_second_flame_in_most_of_the_first_dozen_is_not_one_in_most_of_the_clip() -> None:
    clip, _ = swaying(48, half=12.0)
    frames = frames_of(clip)
    for i in DOZEN[2:10]:
        frames[i] += np.roll(frames[i], 45, axis=1)
    assert judged(clip_of(frames)) is None


def test_what_all_of_a_dozen_frames_show_is_refused_without_a_look_at_the_others() -> None:
    clip, _ = swaying(48, half=12.0)
    frames = [frame + np.roll(frame, 45, axis=1) for frame in frames_of(clip)]
    read: set[int] = set()

    def picture(i: int) -> Pixels:
        read.add(i)
        return frames[i]

    with Workers(1) as workers, pytest.raises(SourceError, match="several flames side by side"):
        refuse_unfit(replace(clip, picture=picture), "clip", None, workers)
    assert read == set(DOZEN)


def _out(frame: Pixels) -> None:
    frame[:] = 0


def test_counts_are_those_of_the_whole_clip() -> None:
    clip, _ = swaying(48)
    frames = frames_of(clip)
    for i in range(21):
        _out(frames[i])
    why = judged(clip_of(frames))
    assert why is not None and why.startswith("the flame goes out in 21 of 48 frames;")


@pytest.mark.clips
@pytest.mark.slow
def test_counts_of_a_real_flash_are_those_of_its_sixteen_frames() -> None:
    why = judged(open_clip("cartoon_wesnoth_fireball_impact"))
    assert why is not None
    broken = sum(int(count) for count in re.findall(r"in (\d+) of 16 frames", why))
    broken += len(re.findall(r"\d+(?=,| and|;)", re.sub(r"in \d+ of 16 frames", "", why)))
    assert broken == 11, why
    assert "source.kind: frames" in why and "it grows in them (2.26 times the size)" in why


# What is wrong is told apart.


def _nearly_out(frame: Pixels) -> None:
    frame[: int(BASE) - 30] = 0


def _in_pieces(frame: Pixels) -> None:
    frame[135:140] = 0


def _without_tip(frame: Pixels) -> None:
    frame[: int(TIP) + 60] = 0


def _without_base(frame: Pixels) -> None:
    frame[int(BASE) - 62 :] = 0


def _aside(frame: Pixels) -> None:
    frame[:] = np.roll(frame, 45, axis=1)


def _to_the_edge(frame: Pixels) -> None:
    frame[:] = np.roll(frame, -30, axis=1)


def _aslant(frame: Pixels) -> None:
    frame[:] = painted(kite(20.0))


def _swollen(frame: Pixels) -> None:
    frame[90:120] = np.maximum(frame[90:120], np.roll(frame, 14, axis=1)[90:120])


@pytest.mark.parametrize(
    ("breaks", "told", "wanted"),
    [
        (_out, "goes out", "burns in every frame"),
        (_nearly_out, "is far smaller than usual", "stays about as large"),
        (_in_pieces, "breaks up", "stays in one piece"),
        (_without_tip, "loses a part of itself", "keeps all its parts"),
        (_to_the_edge, "is cut off at the side of the frame", "has room at its sides"),
        (_without_base, "leaves its base", "stays on its base"),
        (_aside, "jumps elsewhere", "stays in one place"),
        (_aslant, "leans out of its usual place", "sways in one place"),
        (_swollen, "gains a part for a moment", "changes evenly"),
    ],
)
def test_each_way_to_break_is_told_with_what_would_be_right(
    breaks: Callable[[Pixels], None], told: str, wanted: str
) -> None:
    clip, _ = swaying(48, reach=1.0)
    frames = frames_of(clip)
    for i in (15, 31):
        breaks(frames[i])
    # Its left edge is 10 px beside the flame.
    broken = clip_of([np.ascontiguousarray(frame[:, 50:]) for frame in frames])
    why = judged(broken)
    assert why is not None
    assert why.startswith(
        f"the flame {told} in frames 15, 31; a profile is of a flame that {wanted}: set source."
    )
    assert judged(advised_part(why, broken)) is None


def test_a_clip_that_breaks_in_several_ways_counts_each() -> None:
    clip, _ = swaying(48, reach=1.0)
    frames = frames_of(clip)
    for i in range(20, 27):
        _out(frames[i])
    for i in (30, 31, 36):
        _aside(frames[i])
    _in_pieces(frames[40])
    broken = clip_of(frames)
    why = judged(broken)
    assert why is not None
    assert why.startswith(
        "the flame goes out in 7 of 48 frames, jumps elsewhere in frames 30, 31, 36 and breaks up "
        "in frame 40; a profile is of a flame that burns in every frame, stays in one place and "
        "stays in one piece: set source.count to 20 for frames 0 to 19, which show it whole, or"
    )
    assert judged(advised_part(why, broken)) is None


def test_a_lower_threshold_is_advised_where_it_helps() -> None:
    """A hot core in a cooler flame; in two frames a part of both is dimmer than counts as flame."""
    frames = []
    for i in range(48):
        lean = float(np.sin(i / 3))
        core = kite(lean, 14.0)
        frames.append(painted(kite(lean), (220, 90, 10)))
        frames[i][core] = painted(core, (255, 235, 170))[core]
    for i in (15, 31):
        frames[i][135:139, :, :3] *= 0.05
    clip = clip_of(frames)
    why = judged(clip)
    assert why is not None and why.startswith("the flame breaks up in frames 15, 31;")
    lower = re.search(r"or set source\.threshold to (\d+) instead of (\d+), or use", why)
    assert lower is not None and int(lower[1]) < int(lower[2])
    assert judged(clip, float(lower[1])) is None


def test_a_threshold_that_is_worse_than_none_is_advised_to_be_left_out() -> None:
    clip, _ = swaying(32)
    why = judged(clip, threshold=250.0)
    assert why is not None and "leave source.threshold out, so that 12 is chosen" in why
    assert "set source.threshold" not in why and judged(clip) is None


def test_a_threshold_that_does_not_help_is_not_advised() -> None:
    frames = frames_of(swaying(32, reach=1.0)[0])
    _in_pieces(frames[9])
    why = judged(clip_of(frames))
    assert why is not None and "breaks up in frame 9" in why
    assert "source.threshold" not in why


def test_where_no_part_is_whole_the_clip_is_for_frames() -> None:
    frames = frames_of(swaying(32)[0])
    for i in range(0, 32, 3):
        frames[i] = np.roll(frames[i], 58, axis=1)
    why = judged(clip_of(frames))
    assert why is not None and "jumps elsewhere in 11 of 32 frames" in why
    assert why.endswith(": use the clip as it is with source.kind: frames")


# A size that drifts.


def _of_sizes(sizes: Sequence[float]) -> list[Pixels]:
    """A flame of these sizes, which also flickers a little."""
    rows, columns = np.mgrid[0:HEIGHT, 0:WIDTH] + 0.5
    frames = []
    for i, size in enumerate(sizes):
        up = (BASE - rows) / (size * (130 + 6 * (i % 2)))
        half = 25 * size * np.clip(1 - up, 0, 1)
        frames.append(painted((up >= 0) & (up <= 1) & (np.abs(columns - FOOT) <= half)))
    return frames


GROWS = [0.75] * 4 + [0.8, 0.85, 0.9, 0.95] + [1.0] * 4


@pytest.mark.parametrize(
    ("sizes", "what", "drift"),
    [
        (GROWS, "grows: a flash, not a fire", 1 / 0.75**2),
        (GROWS[::-1], "shrinks: a fire that dies", 0.75**2),
    ],
)
def test_a_flame_that_grows_or_shrinks_is_no_fire_that_burns_on(
    sizes: Sequence[float], what: str, drift: float
) -> None:
    advice = size_advice(learnt(clip_of(_of_sizes(sizes))).front)
    assert advice is not None and advice.startswith(what)
    figure = re.search(r"is ([\d.]+) times that in the first", advice)
    assert figure is not None and float(figure[1]) == pytest.approx(drift, rel=0.03)
    assert "--set start=N and --set count=N, or use the clip as it is with source.kind" in advice


@pytest.mark.parametrize("sizes", [np.linspace(0.9, 1.0, 12).tolist(), [*GROWS, *GROWS[::-1]]])
def test_a_flame_that_grows_a_little_or_shrinks_again_burns_on(sizes: Sequence[float]) -> None:
    assert size_advice(learnt(clip_of(_of_sizes(sizes))).front) is None


def test_a_wick_that_leaves_the_flame_does_not_shrink_it(tmp_path: Path) -> None:
    """On black the foot of the candle is dim: in some frames its wick is all that is joined."""
    candle = open_clip("candle")
    for i in range(candle.count):
        shown = np.rint(255 * linear_to_srgb(candle.read(i)[..., :3])).astype(np.uint8)
        Image.fromarray(shown).save(tmp_path / f"{i:04}.png")
    code, said = run("learn", tmp_path, "-o", tmp_path / "x.profile.json")
    assert code == 0 and "shrinks" not in said, said


@pytest.mark.parametrize(
    "name",
    [
        "candle",
        "torch",
        "campfire",
        real("cartoon_fluent_fire"),
        real("cartoon_tauran_flame_sheet"),
        real("real_candle_red"),
        real("real_fireplace_gif"),
        real("sim_unity_flame02"),
        real("sim_unity_flame03"),
    ],
)
def test_a_fire_that_burns_on_is_learnt_and_keeps_its_size(name: str) -> None:
    assert size_advice(learnt_from(name).front) is None


def test_learn_notes_a_flame_that_grows(tmp_path: Path) -> None:
    clip = save(clip_of(_of_sizes(GROWS)), tmp_path / "flash")
    code, said = run("learn", clip, "-o", tmp_path / "x.profile.json")
    assert code == 0 and f"{clip}: grows: a flash, not a fire" in said, said
    steady = save(swaying(12)[0], tmp_path / "steady")
    code, said = run("learn", steady, "-o", tmp_path / "y.profile.json")
    assert code == 0 and "grows" not in said and "shrinks" not in said, said


@pytest.mark.parametrize(
    ("name", "start", "count", "note"),
    [
        ("explosion", 3, 7, "grows: a flash, not a fire"),
        real("cartoon_wesnoth_fireball_impact", 0, 5, "grows: a flash, not a fire"),
        real("cartoon_freedoom_fire", 0, 5, "shrinks: a fire that dies"),
    ],
)
def test_a_part_of_a_flash_is_learnt_with_a_note(
    tmp_path: Path, name: str, start: int, count: int, note: str
) -> None:
    part = save(piece(open_clip(name), start, count), tmp_path / "part")
    code, said = run("learn", part, "-o", tmp_path / "x.profile.json")
    assert code == 0 and note in said, said


# The rate of the frames.


def test_learn_says_which_rate_it_assumes(tmp_path: Path) -> None:
    clip = save(swaying(12)[0], tmp_path / "clip")
    out = ("-o", tmp_path / "x.profile.json", "--overwrite")
    assumed = "24 frames a second assumed; say --set fps=N"
    assert assumed in run("learn", clip, *out)[1]
    code, said = run("learn", clip, *out, "--set", "fps=12")
    assert code == 0 and "assumed" not in said, said


def test_learn_assumes_no_rate_of_a_file_that_states_one(tmp_path: Path) -> None:
    out = ("-o", tmp_path / "x.profile.json", "--overwrite")
    torch = shipped("samples") / "torch.gif"
    code, said = run("learn", torch, *out)
    assert code == 0 and "assumed" not in said, said
    # Its side does not.
    side = save(open_clip("torch"), tmp_path / "side")
    assert "24 frames a second assumed" in run("learn", torch, "--side", side, *out)[1]


# A wall of fire.


def _wall_of_fire(count: int = 24) -> Clip:
    """Tongues that flicker, side by side from edge to edge; each is hotter towards its base."""
    columns = np.arange(WIDTH) + 0.5
    frames = []
    for i in range(count):
        tops = 90 + 25 * np.abs(np.sin(columns * np.pi / 40)) + 12 * np.sin(i + columns // 40)
        heat = np.clip((BASE + 20 - np.arange(HEIGHT))[:, None] / tops, 0, None)
        frame = painted(heat <= 1.0)
        frame[..., :3] *= np.clip(1.2 - heat, 0, 1)[..., None] ** 2
        frames.append(frame)
    return clip_of(frames)


@pytest.mark.parametrize("threshold", [None, 60.0, 120.0, 180.0, 252.0])
def test_a_wall_of_fire_is_called_so_at_any_threshold(threshold: float | None) -> None:
    why = judged(_wall_of_fire(), threshold)
    assert why is not None
    assert why.startswith("this is a wall of fire, as wide as the frame")
    assert "crop a tongue" in why and why.endswith("source.kind: frames")
    assert "source.threshold" not in why


@pytest.mark.parametrize(
    ("name", "threshold"),
    [real("real_firewall_stock", each) for each in (None, 100.0, 140.0, 200.0, 220.0, 240.0)],
)
def test_a_real_wall_of_fire_is_called_so_at_any_threshold(
    name: str, threshold: float | None
) -> None:
    why = judged(open_clip(name), threshold)
    assert why is not None and why.startswith("this is a wall of fire")
    assert "source.threshold" not in why


@pytest.mark.clips
@pytest.mark.slow
def test_what_is_advised_for_a_wall_of_fire_leads_to_an_end(tmp_path: Path) -> None:
    wall = open_clip("real_firewall_stock", "source")
    assert judged(cropped(wall, Window(60, 60, 260, 200))) is None
    save(wall, tmp_path / "wall")
    recipe = tmp_path / "wall.yaml"
    recipe.write_text("{source: {kind: profile, path: wall}, flakes: none, motion_blur: none}")
    code, said = run("build", recipe)
    assert code == 1 and "use the clip as it is with source.kind: frames" in said
    recipe.write_text("{source: {kind: frames, path: wall}, flakes: none, motion_blur: none}")
    code, said = run("build", recipe)
    assert code == 0, said


def test_two_flames_apart_are_no_wall() -> None:
    frames = []
    for i in range(24):
        flame = kite(4.0 * np.sin(i), 12.0)
        frames.append(painted(np.roll(flame, -50, axis=1) | np.roll(flame, 50, axis=1)))
    why = judged(clip_of(frames))
    assert why is not None and why.startswith("shows several flames side by side")
    assert "crop the clip to one" in why and "wall" not in why


# One picture.


def test_one_picture_may_be_a_sheet_and_the_hint_leads_to_its_profile(tmp_path: Path) -> None:
    sheet, out = shipped("samples") / "cartoon_flame.png", tmp_path / "x.profile.json"
    code, said = run("learn", sheet, "-o", out)
    assert code == 1 and "has 1 frame;" in said
    assert "if it is a sheet of frames, set source.grid: {columns: N, rows: N}" in said
    code, said = run("learn", sheet, "-o", out, "--set", "grid={columns: 6, rows: 4}")
    assert code == 0 and out.is_file(), said


def test_three_pictures_are_no_sheet() -> None:
    why = judged(piece(swaying()[0], 0, 3))
    assert why is not None and why.startswith("has 3 frames;") and "grid" not in why

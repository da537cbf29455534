"""Read videos: which frames are kept, when they are shown, and at which size."""

from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path

from fire_atlas.core.clip import Window
from fire_atlas.core.errors import SourceError
from fire_atlas.core.picture import Picture
from fire_atlas.core.workload import MAX_FRAMES, check_workload
from fire_atlas.recipe.source import FramesSource
from fire_atlas.sources import matte
from fire_atlas.sources.frame_store import FrameStore
from fire_atlas.sources.framing import (
    FlameExtent,
    Framing,
    describe_crop,
    frame_video,
    small_copy,
    stated_box,
)
from fire_atlas.sources.listing import frame_range, sample_numbers
from fire_atlas.sources.reader import FrameReader, OpeningContext
from fire_atlas.sources.timing import Timing, time_drawings
from fire_atlas.sources.video_stream import DecodedFrame, VideoScan, decode_video, scan_video

_WAITING_BYTES = 48 << 20
"""Limit on the decoded frames that wait to be converted and reduced, bytes."""


@dataclass(frozen=True, slots=True)
class _Plan:
    """What is kept of a video.

    Attributes:
        timing: Which frame of the file is shown when.
        chosen: Numbers of the shown frames that the recipe uses.
        samples: Numbers of those by which the matte is chosen.
        framing: The part of each frame that is kept, and its size.
        deinterlaced: Whether the two fields of a frame become one picture.
    """

    timing: Timing
    chosen: range
    samples: tuple[int, ...]
    framing: Framing
    deinterlaced: bool

    @property
    def kept(self) -> frozenset[int]:
        """Numbers of the frames of the file that are kept."""
        return frozenset(self.timing.shown[i] for i in (*self.chosen, *self.samples))


@dataclass(frozen=True, slots=True)
class _Video:
    """A video to open, and how it is used."""

    path: Path
    settings: FramesSource
    context: OpeningContext


def open_video(path: Path, settings: FramesSource, context: OpeningContext) -> FrameReader:
    """Open the frames of a video at a constant rate, as ``source.crop`` and ``height`` say.

    Only those that the recipe uses are kept. The packets of the file tell which, without decoding.
    If the decoder contradicts them, for some files hide frames, the video is decoded once more.

    Raises:
        SourceError: The file is cut short, cannot be decoded or is too large; or the settings do
            not suit it.
    """
    video = _Video(path, settings, context)
    scan, box = _scan(video)
    size, notes, choice, fade = scan.look.size, list[str](), None, None
    if settings.crop == "auto":
        scan, extent = _find_flame(video, scan)
        choice = matte.choose(settings.matte, settings.black, extent.samples(), str(path))
        crop = extent.crop(size, choice)
        box, fade = crop.box, crop.fade
        notes.append(describe_crop(crop, size))
    plan = _plan(video, scan, box)
    frames, decoded = _keep(video, scan, plan)
    if (correct := _plan(video, decoded, box)) != plan:
        plan = correct
        frames, _ = _keep(video, decoded, plan)
        scan = decoded
    reader = _reader(video, scan, plan, notes)
    shown = plan.timing.shown
    return replace(reader, read=lambda i: frames.read(shown[i]), matte=choice, fade=fade)


def examine_video(
    path: Path, settings: FramesSource, context: OpeningContext
) -> tuple[FrameReader, range]:
    """Return what the packets of a video tell of its frames, none of which can be read, and the
    numbers of those to use; see ``open_video``."""
    video = _Video(path, settings, context)
    scan, box = _scan(video)
    plan = _plan(video, scan, box)
    return _reader(video, scan, plan, []), plan.chosen


def _scan(video: _Video) -> tuple[VideoScan, Window]:
    """Return what the packets of a video tell, and the part of its frames that is stated."""
    settings, path, max_pixels = video.settings, video.path, video.context.max_pixels
    scan = scan_video(path, max_pixels)
    box = stated_box(settings, scan.look.size, path)
    taken = scan.count if settings.crop == "auto" else 1 + max(_plan(video, scan, box).kept)
    check_workload(taken, scan.look.size, max_pixels, "source.start and count", path=path)
    return scan, box


def _reader(video: _Video, scan: VideoScan, plan: _Plan, notes: Sequence[str]) -> FrameReader:
    """Return a reader of the frames that ``plan`` keeps, which cannot be read yet."""
    return FrameReader(
        width=plan.framing.width,
        height=plan.framing.height,
        fps=plan.timing.rate,
        count=len(plan.timing.shown),
        read=_unread,
        inputs=(video.path,),
        notes=(
            *scan.look.notes_on(video.path),
            *scan.notes,
            *plan.timing.notes,
            *notes,
            *filter(None, [plan.framing.reason]),
        ),
    )


def _unread(i: int) -> Picture:
    raise ValueError(f"frame {i} is not decoded")


def _plan(video: _Video, scan: VideoScan, box: Window) -> _Plan:
    """Return what to keep of a video that has the frames of ``scan``."""
    settings = video.settings
    timing = time_drawings(scan.delays, settings.fps, video.path, scan.fps)
    chosen = frame_range(settings, len(timing.shown), video.path)
    is_matte_stated = settings.matte == "none" or (
        settings.matte == "luminance" and settings.black != "auto"
    )
    return _Plan(
        timing,
        chosen,
        () if is_matte_stated else tuple(sample_numbers(len(timing.shown))),
        frame_video(settings, box, len(chosen), timing.rate, video.context.page),
        scan.look.deinterlaced,
    )


def _keep(video: _Video, scan: VideoScan, plan: _Plan) -> tuple[FrameStore, VideoScan]:
    """Decode a video; return what ``plan`` keeps of it, and ``scan`` corrected by what came."""
    store, seen = FrameStore(video.path), list[tuple[Fraction | None, bool]]()

    def kept(decoded: DecodedFrame) -> Picture:
        return plan.framing.apply(scan.look.picture(decoded.frame))

    frames = _frames(video, scan, plan.kept, seen)
    pictures = video.context.workers.map(kept, frames, _ahead(video, scan))
    video.context.progress.stage("decode", len(plan.kept))
    # A decoder that contradicts the packets may have fewer frames than are to be kept.
    for picture, i in zip(pictures, sorted(plan.kept), strict=False):
        store.add(i, picture)
        video.context.progress.advance()
    return store, _corrected(scan, seen)


def _find_flame(video: _Video, scan: VideoScan) -> tuple[VideoScan, FlameExtent]:
    """Decode a video; return ``scan`` corrected by what came, and where the flame is."""
    extent = FlameExtent(sample_numbers(scan.count))
    seen = list[tuple[Fraction | None, bool]]()

    def small(decoded: DecodedFrame) -> Picture:
        return small_copy(scan.look.picture(decoded.frame))

    frames = _frames(video, scan, None, seen)
    video.context.progress.stage("look for the flame", scan.count)
    for i, copy in enumerate(video.context.workers.map(small, frames, _ahead(video, scan))):
        extent.add(i, copy)
        video.context.progress.advance()
    return _corrected(scan, seen), extent


def _ahead(video: _Video, scan: VideoScan) -> int:
    """Return how many frames may wait for a worker: few, if they are large."""
    width, height = scan.look.stored
    return max(1, min(2 * video.context.workers.jobs, _WAITING_BYTES // (3 * width * height)))


def _frames(
    video: _Video,
    scan: VideoScan,
    kept: frozenset[int] | None,
    seen: list[tuple[Fraction | None, bool]],
) -> Generator[DecodedFrame]:
    """Yield the frames that are ``kept`` (None: all). Append to ``seen`` the time of each frame
    that is decoded, and whether it is interlaced.

    After the last one that is kept, decoding stops if the file's packets were right so far.

    Raises:
        SourceError: The video ends early, or a frame cannot be used.
    """
    path = video.path
    last = scan.count - 1 if kept is None else max(kept)
    threads, max_pixels = video.context.workers.jobs, video.context.max_pixels
    for i, decoded in enumerate(decode_video(path, scan, threads, max_pixels)):
        expected = scan.stamps[i] if i < len(scan.stamps) else None
        seen.append((expected if decoded.stamp is None else decoded.stamp, decoded.interlaced))
        if kept is None or i in kept:
            yield decoded
        if i == last and (not scan.stamps or tuple(t for t, _ in seen) == scan.stamps[: i + 1]):
            rest = scan.stamps[i + 1 :] if scan.stamps else (None,) * (scan.count - i - 1)
            seen += [(stamp, False) for stamp in rest]
            return
    if not seen:
        raise SourceError(f"{path}: no frame of this video can be decoded; export it again")
    # Edit lists may hide a frame or two at the ends. If more are missing, the file is damaged.
    if len(seen) + 2 < scan.count <= MAX_FRAMES:
        raise SourceError(
            f"{path}: frame {len(seen)} of {scan.count} cannot be decoded; export it again"
        )


def _corrected(scan: VideoScan, seen: list[tuple[Fraction | None, bool]]) -> VideoScan:
    """Return ``scan`` with the frames that the decoder has ``seen``."""
    stamps = [stamp for stamp, _ in seen if stamp is not None]
    interlaced = scan.look.deinterlaced or any(interlaced for _, interlaced in seen)
    return replace(
        scan,
        count=len(seen),
        stamps=tuple(stamps) if len(stamps) == len(seen) else (),
        look=replace(scan.look, deinterlaced=interlaced),
    )

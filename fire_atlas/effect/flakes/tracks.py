"""Flake tracks: tables of the place, velocity and look of every flake in every frame."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.camera import Camera

COLUMNS = (
    "id", "x", "y", "vx", "vy", "size", "stretch", "rotation", "r", "g", "b", "a", "age", "life",
    "kind", "blur", "tail",
)  # fmt: skip
"""Columns of ``Tracks.frames``, in px, px/s, s and rad; rgb is linear light and may exceed 1."""

SPAWN_COLUMNS = ("id", "t", "life", "x", "y", "vx", "vy", "size", "wraps")
"""Columns of ``Tracks.spawns``, in px, px/s and s; ``wraps`` (0 or 1): seen past the loop's end."""

DEPTH_COLUMNS = ("z", "vz")
"""Further columns of frames and of spawns, the last, of a fire with depth: place towards the viewer
from the plane through the middle of the fire, px, and velocity, px/s; in perspective, px there."""

Table = NDArray[np.float64]
"""(rows, columns)."""

RowNumbers = tuple[NDArray[np.int64], ...]
"""One array (rows,) per frame: a number for each row of its table."""

_ID, _AGE = COLUMNS.index("id"), COLUMNS.index("age")
_SPAWN_DATA = [SPAWN_COLUMNS.index(name) for name in ("life", "x", "y", "vx", "vy", "size")]
_T, _WRAPS = SPAWN_COLUMNS.index("t"), SPAWN_COLUMNS.index("wraps")


@dataclass(frozen=True, slots=True)
class TrackTexture:
    """The texture that the flakes of some tracks show.

    Attributes:
        frames: Names of its cells in the atlas.
        tinted: Whether the cells are masks of the flakes' light, or are shown as painted.
        cells: For each row of each frame, the index in ``frames`` of the cell that it shows.
    """

    frames: tuple[str, ...]
    tinted: bool
    cells: RowNumbers


_MIN_VISIBLE = 0.001
"""Light up to which a flake is invisible: 3 of 255 in sRGB."""


@dataclass(frozen=True, slots=True)
class Tracks:
    """All flakes of a build.

    A flake is a streak that tapers and fades towards its ends, size·stretch px long and size px
    wide, centred on (x, y) and along ``rotation`` (clockwise from +x on screen). With u and v, -1
    to 1 from end to end along it and across, its light is rgb·a · (1 − |u|³ − v²)³ where that is
    above 0, times a factor that rises linearly from ``tail`` at u = −1 to 1 at u = 1, its head.
    Around it is a halo (``drawing.HALO_LIGHT``, ``HALO_WIDTH``): the same with ``HALO_LIGHT`` of
    the light, ``HALO_WIDTH`` times as wide, and longer by as many px as it is wider. ``size`` is
    the width as drawn: it has the reach of a pixel in it, and ``blur``, the px by which a flake out
    of focus is wider. ``kind`` is 0 for an ember that the gas carries, and 1 for a spark that is
    thrown. The light of all flakes of a frame is summed, linear; what is shown is x / (1 + x) of it
    in each channel.

    If ``hard``, a flake is a square of ``size`` whole px that all have the light rgb·a, at the
    nearest whole px; where squares overlap, each channel is that of the brighter one.

    With a ``texture``, a flake is a picture instead, without halo and tail: ``texture.py`` says how
    it lies in a rectangle of ``size`` · ``stretch`` by ``size`` px, and what its light is.

    A flight is the unbroken life of one flake, from the first frame that shows it to the last. In a
    loop it continues from the last frame into frame 0. A loop no longer than a flight shows several
    parts of it in one frame; the flake then changes its id on the way, so that no id is in a frame
    twice (``fold_into_loop``). Rows of one flake therefore share a flight, not always an id.

    Flakes of a fire that tiles fly on beyond the sides of the frame, over the tiles beside it.

    Attributes:
        fps: Frames per second of the animation.
        width, height: Frame size, px.
        loop: Whether frame 0 follows the last frame.
        seed: The recipe's seed.
        spawns: (ids, 9) float64, columns ``SPAWN_COLUMNS``, sorted by id.
        frames: One (rows, 17) float64 table per frame, columns ``COLUMNS``, sorted by id. If the
            fire has depth, ``DEPTH_COLUMNS`` follow, here and in ``spawns``.
        flights: Flight of each row of each frame, identified by the first id of its flake.
        flight_frames: For each row of each frame, number of frames since its flight began.
        hard: Whether flakes are hard squares.
        rounds: Number of rounds of the animation that the frames cover: flakes of a short loop
            repeat after several of its rounds.
        texture: The picture that flakes show; None for streaks or squares.
        camera: The camera that sees the flakes, if the fire has depth.
    """

    fps: float
    width: int
    height: int
    loop: bool
    seed: int
    spawns: Table
    frames: tuple[Table, ...]
    flights: RowNumbers
    flight_frames: RowNumbers
    hard: bool = False
    rounds: int = 1
    texture: TrackTexture | None = None
    camera: Camera | None = None

    @classmethod
    def one_shot(
        cls, fps: float, size: tuple[int, int], seed: int, spawns: Table, frames: Sequence[Table],
        hard: bool = False, texture: TrackTexture | None = None, camera: Camera | None = None,
    ) -> Self:  # fmt: skip
        """Return tracks that play once: each id is one flight.

        ``size`` is the width and height of a frame, px; the other arguments are attributes.
        """
        flights = tuple(rows[:, _ID].astype(np.int64) for rows in frames)
        since_first = _frames_since_first(flights)
        return cls(
            fps, *size, False, seed, spawns, tuple(frames), flights, since_first, hard,
            texture=texture, camera=camera,
        )  # fmt: skip

    @classmethod
    def of_tables(
        cls, fps: float, size: tuple[int, int], loop: bool, seed: int, spawns: Table,
        frames: Sequence[Table], rounds: int = 1, texture: TrackTexture | None = None,
        camera: Camera | None = None,
    ) -> Self:  # fmt: skip
        """Return tracks of tables read from a file; flights are recomputed from spawns and ages.

        Ids whose spawn data differ only in time are one flake; the smallest id names its flight.

        Raises:
            KeyError: A row has an id that was never spawned.
        """
        rows, ends = np.concatenate(frames), np.cumsum([len(table) for table in frames])[:-1]
        spawn_data = map(tuple, spawns[:, _SPAWN_DATA].tolist())
        first = dict[tuple[float, ...], float]()
        known = zip(spawns[:, 0].tolist(), spawn_data, strict=True)
        flight = {number: first.setdefault(data, number) for number, data in known}
        flights = np.array([flight[number] for number in rows[:, _ID].tolist()], np.int64)
        ages, (_, which) = rows[:, _AGE] * fps, np.unique(flights, return_inverse=True)
        youngest = np.full(len(flights), np.inf)
        np.minimum.at(youngest, which, ages)
        since_first = np.asarray(np.rint(ages - youngest[which]), np.int64)
        return cls(
            fps, *size, loop, seed, spawns, tuple(frames),
            tuple(np.split(flights, ends)), tuple(np.split(since_first, ends)), rounds=rounds,
            texture=texture, camera=camera,
        )  # fmt: skip

    @property
    def tiles(self) -> bool:
        """Whether flakes that fly on beyond a side of the frame enter at the other."""
        return self.camera is not None and self.camera.tiles

    @property
    def columns(self) -> tuple[str, ...]:
        """Columns of ``frames``."""
        return COLUMNS + DEPTH_COLUMNS * (self.camera is not None)

    @property
    def spawn_columns(self) -> tuple[str, ...]:
        """Columns of ``spawns``."""
        return SPAWN_COLUMNS + DEPTH_COLUMNS * (self.camera is not None)

    @property
    def round_frames(self) -> int:
        """Number of frames of the animation, which is one round."""
        return len(self.frames) // self.rounds

    @property
    def frame_numbers(self) -> NDArray[np.intp]:
        """The frame number of each row, (all rows,)."""
        return np.repeat(np.arange(len(self.frames)), [len(rows) for rows in self.frames])

    def with_cell_names(self, names: tuple[str, ...]) -> Self:
        """Return the tracks with the names that the cells of their texture have in the atlas."""
        return replace(self, texture=self.texture and replace(self.texture, frames=names))

    def following_rows(self) -> NDArray[np.int64]:
        """Return for each row the index, among all rows, of its flake in the next frame, or -1."""
        count, frame = len(self.frames), self.frame_numbers
        following = np.full(len(frame), -1)
        # A number that is unique in its frame; the same flake has the next one a frame later.
        numbers = (np.concatenate(self.flights) << 32) + np.concatenate(self.flight_frames)
        begins = np.searchsorted(frame, np.arange(count + 1))
        for i in range(count if self.loop else count - 1):
            here = slice(*begins[i : i + 2])
            after = (i + 1) % count
            there = slice(*begins[after : after + 2])
            _, rows, next_rows = np.intersect1d(
                numbers[here] + 1, numbers[there], assume_unique=True, return_indices=True
            )
            following[here.start + rows] = there.start + next_rows
        return following

    def unlooped_ids(self) -> NDArray[np.float64]:
        """Return an id for each row, (all rows,), that changes where a flake passes the loop's end.

        Each of these ids is in successive frames of the loop only. Rows that continue a flight from
        the last frame in frame 0 get new ids: their flight began a whole loop earlier than that of
        other rows of their id.
        """
        ids = np.concatenate(self.frames)[:, _ID]
        began = self.frame_numbers - np.concatenate(self.flight_frames)
        _, which = np.unique(ids, return_inverse=True)
        latest = np.full(len(ids), np.iinfo(np.int64).min)
        np.maximum.at(latest, which, began)
        return np.asarray(ids + (began < latest[which]) * (ids.max(initial=0) + 1), np.float64)


def by_column(rows: Table) -> dict[str, NDArray[np.float64]]:
    """Return the columns of a table of ``Tracks.frames`` by name."""
    return dict(zip((COLUMNS + DEPTH_COLUMNS)[: rows.shape[1]], rows.T, strict=True))


def _frames_since_first(flights: RowNumbers) -> RowNumbers:
    """Return for each row the number of frames since its flight began."""
    counts = [len(rows) for rows in flights]
    frame = np.repeat(np.arange(len(counts)), counts)
    _, first, flight = np.unique(np.concatenate(flights), return_index=True, return_inverse=True)
    return tuple(np.split(frame - frame[first][flight], np.cumsum(counts)[:-1]))


def fold_into_loop(tracks: Tracks, count: int, rounds: int = 1) -> Tracks:
    """Fold one-shot tracks of more than ``count`` frames into a loop of ``count`` frames, which are
    ``rounds`` rounds of the animation.

    A flake keeps its id across the end of the loop. One that is seen in as many frames as the loop
    has, or more, would be in a frame twice; it changes its id every ``count - 1`` frames, so that
    neither happens: an id twice in a frame, or on two flakes in neighbouring frames.
    """
    frame = tracks.frame_numbers
    rows, since_first = np.concatenate(tracks.frames), np.concatenate(tracks.flight_frames)
    spawns = tracks.spawns.copy()
    spawns[:, _WRAPS] = np.isin(spawns[:, 0], rows[frame >= count, _ID])
    part = since_first // max(count - 1, 1)
    id_step = rows[:, _ID].max(initial=0) + 1  # keeps the ids of parts apart
    rows[:, _ID] += part * id_step
    spawns = _with_parts(spawns, int(part.max(initial=0)), id_step, count / tracks.fps)
    order = np.lexsort((rows[:, _ID], frame % count))
    bounds = np.searchsorted(frame[order] % count, np.arange(1, count))
    return replace(
        tracks,
        loop=True,
        rounds=rounds,
        spawns=spawns[np.isin(spawns[:, 0], rows[:, _ID])],
        frames=tuple(np.split(rows[order], bounds)),
        flights=tuple(np.split(np.concatenate(tracks.flights)[order], bounds)),
        flight_frames=tuple(np.split(since_first[order], bounds)),
        texture=_folded(tracks.texture, order, bounds),
    )


def _folded(
    texture: TrackTexture | None, order: NDArray[np.intp], bounds: NDArray[np.intp]
) -> TrackTexture | None:
    """Return the texture with its cells in the order of the rows of other frames."""
    if texture is None:
        return None
    cells = np.concatenate(texture.cells)[order]
    return replace(texture, cells=tuple(np.split(cells, bounds)))


def _with_parts(spawns: Table, parts: int, id_step: float, period: float) -> Table:
    """Return the spawns with a copy per further part of a flight, each a ``period`` (s) earlier."""
    copies = [spawns]
    for part in range(1, parts + 1):
        copy = spawns.copy()
        copy[:, 0] += part * id_step
        copy[:, _T] -= part * period
        copies.append(copy)
    return np.concatenate(copies)


def visible_count(rows: Table) -> int:
    """Return how many flakes of a frame's table are bright enough to be visible."""
    column = by_column(rows)
    brightest = np.maximum.reduce([column["r"], column["g"], column["b"]]) * column["a"]
    return int(np.count_nonzero(brightest > _MIN_VISIBLE))


def first_frames(tracks: Tracks, count: int) -> Tracks:
    """Return the tracks of the first ``count`` frames and of the flakes in them."""
    frames = tracks.frames[:count]
    seen = np.isin(tracks.spawns[:, 0], np.concatenate([rows[:, _ID] for rows in frames]))
    return replace(
        tracks,
        spawns=tracks.spawns[seen],
        frames=frames,
        flights=tracks.flights[:count],
        flight_frames=tracks.flight_frames[:count],
        texture=tracks.texture and replace(tracks.texture, cells=tracks.texture.cells[:count]),
    )


def as_drawn(tracks: Tracks) -> Tracks:
    """Return tracks with hard flakes as they are drawn: on whole px, unrotated, without velocity.

    Soft flakes are drawn as the tracks have them.
    """
    return replace(tracks, frames=tuple(map(_snapped, tracks.frames))) if tracks.hard else tracks


def _snapped(rows: Table) -> Table:
    column = by_column(rows)
    half, still = column["size"] / 2, np.zeros(len(rows))
    column |= {axis: np.rint(column[axis] - half) + half for axis in "xy"}
    column |= dict.fromkeys(("vx", "vy", "rotation"), still)
    return np.stack([*column.values()]).T

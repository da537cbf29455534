"""Keep decoded frames out of memory: a file that is decoded forwards is decoded only once."""

import tempfile
import threading
import weakref
from pathlib import Path

import numpy as np

from fire_atlas.core.errors import SourceError
from fire_atlas.core.picture import Picture

MEMORY_BYTES = 32 << 20
"""Limit on the frames that are kept in memory, bytes, whatever the length of a clip."""


class FrameStore:
    """Frames by their number, in memory while they are few, else in a temporary file.

    The operating system removes the temporary file however the program ends: on POSIX it has no
    name.
    """

    def __init__(self, path: Path) -> None:
        """Keep no frame yet; ``path`` is the file they come from, for error messages."""
        self._path = path
        self._file = tempfile.SpooledTemporaryFile(max_size=MEMORY_BYTES)  # noqa: SIM115
        self._places = dict[int, tuple[int, np.dtype[np.generic], tuple[int, ...]]]()
        self._lock = threading.Lock()
        weakref.finalize(self, self._file.close)

    def add(self, i: int, picture: Picture) -> None:
        """Keep ``picture`` as frame i.

        Raises:
            SourceError: The temporary file cannot be written: mostly, its disk is full.
        """
        with self._lock:
            try:
                start = self._file.seek(0, 2)
                self._file.write(np.ascontiguousarray(picture).data)
            except OSError as error:
                raise SourceError(
                    f"{self._path}: its frames cannot be kept in {tempfile.gettempdir()} "
                    f"({error.strerror}); make room there, or set TMPDIR to another folder"
                ) from error
            self._places[i] = start, picture.dtype, picture.shape

    def read(self, i: int) -> Picture:
        """Return frame i, read-only. Several threads may call this at once."""
        start, dtype, shape = self._places[i]
        with self._lock:
            self._file.seek(start)
            stored = self._file.read(int(np.prod(shape)) * dtype.itemsize)
        return np.frombuffer(stored, dtype).reshape(shape)

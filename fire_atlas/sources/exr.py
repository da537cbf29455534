"""Read OpenEXR files (linear light, premultiplied by convention) with the package ``OpenEXR``.

The package prints errors on stdout and stderr and cannot be silenced. So it runs in separate
processes (``exr_decoder.py``), one for each thread that reads EXR.
"""

import importlib.util
import json
import subprocess
import sys
import threading
import weakref
from pathlib import Path

import numpy as np

from fire_atlas.core.errors import SourceError
from fire_atlas.core.picture import Picture
from fire_atlas.sources.broken import BrokenFileError

_PROGRAM = str(Path(__file__).with_name("exr_decoder.py"))
_of_thread = threading.local()


def require_openexr(path: Path) -> None:
    """Raise ``SourceError`` if ``OpenEXR``, which the file ``path`` needs, is not installed."""
    if importlib.util.find_spec("OpenEXR") is None:
        raise SourceError(
            f"{path}: reading EXR needs OpenEXR; install it with: pip install 'fire-atlas[exr]'"
        )


def exr_size(head: bytes) -> tuple[int, int]:
    """Return the width and height of the display window, px, from the first bytes of a file.

    Raises:
        BrokenFileError: The header is cut short or damaged, or lists no colour channels.
    """
    (height, width), _ = _reply(head, header_only=True)
    return width, height


def decode_exr(data: bytes) -> Picture:
    """Return the picture in an EXR file, float32 (H, W, 3) or (H, W, 4), its values unchanged.

    Raises:
        BrokenFileError: The file is cut short or damaged, or has no colour channels.
    """
    shape, pixels = _reply(data, header_only=False)
    return np.frombuffer(pixels, np.float32).reshape(shape)


def _reply(data: bytes, *, header_only: bool) -> tuple[tuple[int, ...], bytes]:
    """Return shape and pixels from this thread's decoder, which is started on first use."""
    if not hasattr(_of_thread, "decoder"):
        _of_thread.decoder = _Decoder()
    try:
        reply, pixels = _of_thread.decoder.ask(data, header_only)
    except (OSError, ValueError) as error:
        del _of_thread.decoder
        raise BrokenFileError("this EXR ended the process that decodes it") from error
    if "error" in reply:
        raise BrokenFileError(f"the file is truncated or damaged ({reply['error']})")
    return tuple(reply["shape"]), pixels


class _Decoder:
    """A process that decodes EXR files. It ends with this object or with the build."""

    def __init__(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-P", _PROGRAM],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            start_new_session=True,  # Ctrl-C must not reach it
        )
        weakref.finalize(self, self._process.communicate)

    def ask(self, data: bytes, header_only: bool) -> tuple[dict[str, list[int]], bytes]:
        """Return the reply to a request; raise OSError or ValueError if the process has ended."""
        requests, replies = self._process.stdin, self._process.stdout
        assert requests is not None
        assert replies is not None
        request = {"length": len(data), "header_only": header_only}
        requests.write(json.dumps(request).encode() + b"\n" + data)
        requests.flush()
        reply = json.loads(replies.readline())
        size = 0 if header_only or "error" in reply else 4 * int(np.prod(reply["shape"]))
        return reply, replies.read(size)

"""PyAV, the optional extra that reads what OpenCV's wheels cannot."""

from pathlib import Path
from typing import Any

from fire_atlas.core.errors import SourceError


def load_pyav(what: str, path: Path | str) -> Any:
    """Return the module ``av``, silenced; FFmpeg's complaints come back as exceptions.

    Raises:
        SourceError: It is not installed.
    """
    try:
        import av
        import av.logging
    except ImportError as error:
        raise SourceError(
            f"{path}: reading {what} needs PyAV; install it with: pip install 'fire-atlas[video]'"
        ) from error
    av.logging.set_level(None)
    return av

"""The folders of recipes, templates and samples that are installed with the tool."""

from pathlib import Path
from typing import Literal

_PACKAGE = Path(__file__).resolve().parent.parent


def shipped(kind: Literal["recipes", "templates", "samples"]) -> Path:
    """Return the folder of ``kind``: inside the installed package, or beside it in a checkout."""
    installed = _PACKAGE / "shipped" / kind
    return installed if installed.is_dir() else _PACKAGE.parent / kind

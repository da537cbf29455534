"""fire-atlas: fire in, finished sprite atlases with flying fire-flakes out.

The functions are imported when they are first used, so that importing the package is quick.
"""

from typing import TYPE_CHECKING, Any

from fire_atlas.core.errors import FireAtlasError, OutputError, RecipeError, SourceError
from fire_atlas.core.version import __version__

if TYPE_CHECKING:
    from fire_atlas.api import build, check, inspect_atlas, load_recipe, write_preview

__all__ = [
    "FireAtlasError",
    "OutputError",
    "RecipeError",
    "SourceError",
    "__version__",
    "build",
    "check",
    "inspect_atlas",
    "load_recipe",
    "write_preview",
]


def __getattr__(name: str) -> Any:
    """Import a function of the package when it is first used."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from fire_atlas import api

    return getattr(api, name)


def __dir__() -> list[str]:
    """List the functions too that are not imported yet."""
    return sorted({*globals(), *__all__})

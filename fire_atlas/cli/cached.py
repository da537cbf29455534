"""The cache that builds use: where their options say it is, and taking outputs from it.

What only a build with a cache needs is imported when it is used: most have none.
"""

import os
from argparse import Namespace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from fire_atlas.cli.progress import BuildView
from fire_atlas.core.errors import RecipeError
from fire_atlas.core.progress import StageTimer
from fire_atlas.outputs.outcome import Outcome

if TYPE_CHECKING:
    from fire_atlas.outputs.cache.build_cache import BuildCache
    from fire_atlas.pipeline.input.check import CheckedRecipe

_MODES = ("read", "read-write")


def cache_of(args: Namespace) -> "BuildCache | None":
    """Return the cache that the options of a build, or else the environment, name; None without.

    Raises:
        RecipeError: The mode is invalid.
    """
    location = os.environ.get("FIRE_ATLAS_CACHE", "") if args.cache is None else args.cache
    mode = args.cache_mode or os.environ.get("FIRE_ATLAS_CACHE_MODE") or "read-write"
    if mode not in _MODES:
        raise RecipeError(f"FIRE_ATLAS_CACHE_MODE: must be {' or '.join(_MODES)}; got {mode}")
    secret = os.environ.get("FIRE_ATLAS_CACHE_KEY", "")
    return _opened(location, mode == "read-write", secret) if location else None


@cache
def _opened(location: str, writes: bool, secret: str) -> "BuildCache":
    """Return the one cache of this process with these settings; it remembers what has failed."""
    from fire_atlas.outputs.cache.build_cache import BuildCache

    return BuildCache(location, writes, secret.encode() or None)


def restored(
    loaded: "CheckedRecipe", cache: "BuildCache", out: Path, args: Namespace, view: BuildView
) -> Outcome | None:
    """Take the outputs of a recipe from a cache; return None if they are not there."""
    from fire_atlas.outputs.cache.archive import CacheMissError
    from fire_atlas.outputs.cache.key import CacheKey
    from fire_atlas.pipeline.files.restore import restore

    timer, key = StageTimer(), CacheKey.of_tree(loaded.tree)
    try:
        with timer.measure("cache"):
            found = restore(loaded, key, cache, out, args.overwrite, view.note)
    except CacheMissError as miss:
        view.cache("miss", f"{miss}: {key}")
        return None
    view.cache("hit", str(key))
    return Outcome(list(found.files), timer.seconds, found.statistics)

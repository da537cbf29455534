"""The command ``cache``: describe a cache of builds, or remove entries from it."""

import os
import re
import time
from argparse import Namespace

from fire_atlas.cli.text import printable
from fire_atlas.core.errors import OutputError, RecipeError
from fire_atlas.outputs.cache.store import Store, StoredEntry, StoreError, open_store

_BYTES = {"": 1, "K": 1 << 10, "M": 1 << 20, "G": 1 << 30, "T": 1 << 40}
_SECONDS = {"h": 3600, "d": 24 * 3600, "w": 7 * 24 * 3600}


def run(args: Namespace) -> int:
    """Describe a cache, or remove entries from it."""
    location = args.location or os.environ.get("FIRE_ATLAS_CACHE")
    if not location:
        raise RecipeError("name the cache, a folder or a URL, or set FIRE_ATLAS_CACHE")
    limits = _size(args.max_size), _age(args.older_than)
    if (args.action == "prune") == (limits == (None, None)):
        wrong = "needs" if args.action == "prune" else "removes nothing, and takes no"
        raise RecipeError(f"{args.action} {wrong} --max-size or --older-than")
    try:
        store = open_store(location)
        entries = sorted(store.entries(), key=_age_order)
        lines = _describe(entries) if args.action == "info" else _prune(store, entries, *limits)
    except StoreError as error:
        raise OutputError(str(error)) from error
    for line in lines if not args.quiet else ():
        print(printable(line))
    return 0


def _age_order(entry: StoredEntry) -> float:
    return entry.used or 0.0


def _describe(entries: list[StoredEntry]) -> list[str]:
    """Return lines about ``entries``, the oldest first."""
    lines = [f"entries: {len(entries)}", f"bytes: {sum(entry.size for entry in entries)}"]
    known = [entry.used for entry in entries if entry.used is not None]
    named = {"oldest": known[:1], "newest": known[-1:]}
    return lines + [f"{name}: {_day(time_)}" for name, times in named.items() for time_ in times]


def _day(seconds: float) -> str:
    return time.strftime("%Y-%m-%d %H:%M UTC", time.gmtime(seconds))


def _prune(
    store: Store, entries: list[StoredEntry], max_bytes: int | None, max_age: int | None
) -> list[str]:
    """Remove entries, the oldest first, until both limits hold; return a line about that."""
    size, removed = sum(entry.size for entry in entries), 0
    oldest = 0.0 if max_age is None else time.time() - max_age
    for entry in entries:
        is_old = entry.used is not None and entry.used < oldest
        if is_old or (max_bytes is not None and size > max_bytes):
            store.remove(entry.digest)
            size, removed = size - entry.size, removed + 1
    store.remove_drafts()
    return [f"removed {removed} of {len(entries)} entries; {size} bytes are left"]


def _size(text: str | None) -> int | None:
    """Return a size like 500M or 2G in bytes.

    Raises:
        RecipeError: It is no such size.
    """
    if text is None:
        return None
    if match := re.fullmatch(r"([0-9]+)([KMGT]?)(?:i?B)?", text, re.IGNORECASE):
        return int(match[1]) * _BYTES[match[2].upper()]
    raise RecipeError(f"--max-size: must be a size like 500M or 2G; got {text}")


def _age(text: str | None) -> int | None:
    """Return an age like 12h, 30d or 4w in seconds.

    Raises:
        RecipeError: It is no such age.
    """
    if text is None:
        return None
    if match := re.fullmatch(r"([0-9]+)([hdw])", text):
        return int(match[1]) * _SECONDS[match[2]]
    raise RecipeError(f"--older-than: must be an age like 12h, 30d or 4w; got {text}")

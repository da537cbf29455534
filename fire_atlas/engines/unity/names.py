"""What things are called in Unity: files, sprites, states, and the class of the player."""

import hashlib
import re
import unicodedata
from collections.abc import Iterable, Sequence

from fire_atlas.core.errors import OutputError

_UNFIT = re.compile(r'[\x00-\x1f\x7f<>:"/\\|?*\ud800-\udfff]')
"""What no file of a Unity project may be called on some system."""

_LONGEST = 100
"""Bytes of an animation's name in that of a file: a file system takes 255 for the whole."""


def sprite_names(frames: Iterable[str]) -> dict[str, str]:
    """Return what the sprite of each frame is called: ``campfire_0000``.

    A slash would make submenus of it wherever the editor lists sprites.
    """
    return _told_apart({frame: _UNFIT.sub("_", frame) for frame in frames}, "frames")


def state_names(animations: Sequence[str]) -> dict[str, str]:
    """Return what an Animator calls each animation; dots and slashes part layers from states."""
    names = {each: _UNFIT.sub("_", each).replace(".", "_") for each in animations}
    return _told_apart(names, "animations")


def file_stems(title: str, animations: Sequence[str]) -> dict[str, str]:
    """Return the file stem of each animation of the build ``title``: its own for the only one."""
    names = {each: _stem(title, each) for each in animations}
    return _told_apart(names, "animations")


def player_name(title: str) -> str:
    """Return the name of the class, and so of the file, that plays the flakes of ``title``.

    No two recipes share one: whatever is no part of a C# name is told by a hash.
    """
    plain = re.sub(r"[^A-Za-z0-9_]", "_", title)
    plain = f"_{plain}" if plain[0].isdigit() else plain
    return f"{plain}_flakes" + (f"_{_digest(title)}" if plain != title else "")


def _stem(title: str, animation: str) -> str:
    if animation == title:
        return title
    plain = _UNFIT.sub("_", animation.removeprefix(f"{title}/").replace("/", "."))
    if len(plain.encode()) > _LONGEST:
        kept = plain.encode()[:_LONGEST].decode(errors="ignore")
        plain = f"{kept}-{_digest(animation)}"
    return f"{title}.{plain}"


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode(errors="surrogatepass")).hexdigest()[:8]


def _told_apart(names: dict[str, str], what: str) -> dict[str, str]:
    """Refuse names that are one on a system that tells neither case nor Unicode forms apart."""
    taken: dict[str, str] = {}
    for name, made in names.items():
        other = taken.setdefault(unicodedata.normalize("NFC", made).casefold(), name)
        if other != name:
            raise OutputError(
                f"exports: unity cannot tell the {what} {other!r} and {name!r} apart: both would "
                f"be called {made!r} there; rename the files of one of them"
            )
    return names

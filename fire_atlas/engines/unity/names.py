"""Names and ids in Unity: of files, sprites, animator states, and the classes that play a fire.

All are derived from names in the build, so that rebuilding does not change them.
"""

import hashlib
import re
from collections.abc import Iterable, Sequence
from typing import Literal

from fire_atlas.core.errors import OutputError
from fire_atlas.core.output_file import as_file_name

_FORBIDDEN = re.compile(r'[\x00-\x1f\x7f<>:"/\\|?*\ud800-\udfff]')
"""Characters that some operating system forbids in file names."""

_MAX_NAME_BYTES = 100
"""Maximum length of an animation's name in a file name, which may have 255 bytes."""

_GUID = re.compile(r"^guid: ([0-9a-f]{32})\s*$", re.MULTILINE)

Played = Literal["flakes", "heat", "start"]
"""What scripts of a build play: flakes, pages of heat, and the start of a loop."""

CONTROLLER_ENDING, PREFAB_ENDING, META_ENDING = ".controller", ".prefab", ".meta"
"""File name endings of animator controllers, prefabs, and the import settings of a file."""

CLIP_ENDING, MATERIAL_ENDING, SHADER_ENDING = ".anim", ".mat", ".shader"
SCRIPT_ENDING, ASSEMBLY_ENDING, TABLE_ENDING = ".cs", ".asmdef", ".bytes"
"""Those of further assets; tables hold flakes."""


def sprite_names(frames: Iterable[str]) -> dict[str, str]:
    """Return the name of each frame's sprite, such as ``campfire_0000``.

    Slashes are replaced, because Unity's editor would make submenus of them.
    """
    return _require_distinct({frame: _FORBIDDEN.sub("_", frame) for frame in frames}, "frames")


def state_names(animations: Sequence[str]) -> dict[str, str]:
    """Return the name of each animation's animator state, without dots, which separate layers."""
    names = {name: _FORBIDDEN.sub("_", name).replace(".", "_") for name in animations}
    return _require_distinct(names, "animations")


def file_stems(title: str, animations: Sequence[str]) -> dict[str, str]:
    """Return the file stem of each animation; one called ``title`` has the stem of the build."""
    names = {name: _stem(title, name) for name in animations}
    return _require_distinct(names, "animations")


def player_name(title: str, played: Played = "flakes") -> str:
    """Return the name of the C# class, and of its file, that plays a part of build ``title``.

    No two builds share one: where ``title`` is not a C# identifier, a hash of it is appended.
    """
    plain = re.sub(r"[^A-Za-z0-9_]", "_", title)
    plain = f"_{plain}" if plain[0].isdigit() else plain
    return f"{plain}_{played}" + (f"_{_digest(title)}" if plain != title else "")


def guid_of(namespace: str, file: str) -> str:
    """Return the GUID of a file, 32 hexadecimal digits; it does not depend on the folder."""
    return hashlib.md5(f"fire-atlas/unity/{namespace}/{file}".encode()).hexdigest()


def local_file_id(kind: str, name: str) -> int:
    """Return the local file id, a signed 64-bit number, of an object called ``name`` in a file."""
    digest = hashlib.sha256(f"{kind}/{name}".encode()).digest()
    return int.from_bytes(digest[:8], "little", signed=True) or 1


def sprite_guid(name: str) -> str:
    """Return the GUID of a sprite in Unity's Sprite Editor."""
    return hashlib.md5(f"sprite/{name}".encode()).hexdigest()


def guids_in(meta: str) -> list[str]:
    """Return the GUIDs in a ``.meta``; a valid one has exactly one."""
    return _GUID.findall(meta)


def _stem(title: str, animation: str) -> str:
    if animation == title:
        return title
    plain = _FORBIDDEN.sub("_", animation.removeprefix(f"{title}/").replace("/", "."))
    if len(plain.encode()) > _MAX_NAME_BYTES:
        kept = plain.encode()[:_MAX_NAME_BYTES].decode(errors="ignore")
        plain = f"{kept}-{_digest(animation)}"
    return f"{title}.{plain}"


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode(errors="surrogatepass")).hexdigest()[:8]


def _require_distinct(names: dict[str, str], what: str) -> dict[str, str]:
    """Return ``names`` if they differ even when case and Unicode form are ignored.

    Raises:
        OutputError: Two of them are equal then.
    """
    taken: dict[str, str] = {}
    for name, made in names.items():
        other = taken.setdefault(as_file_name(made), name)
        if other != name:
            raise OutputError(
                f"unity cannot tell the {what} {other!r} and {name!r} apart: both would "
                f"be called {made!r} there; rename the files of one of them"
            )
    return names

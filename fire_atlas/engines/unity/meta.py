"""Update ``.meta`` files: the settings with which Unity imports a file, and its GUID.

Unity and the user edit these files too, and their edits are kept. The YAML is handled as lines, so
that one key can be replaced without changing any other byte. The lines of a key are its own and
those after it that are indented deeper; items of a list are indented like the key they belong to.
"""

import re
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple, TypeAlias

from fire_atlas.core.errors import OutputError
from fire_atlas.engines.unity.names import guids_in

YamlPath: TypeAlias = tuple[str, ...]
"""The keys that lead to a value, outermost first."""

_TEXTURE = "TextureImporter"

TEXTURE_KEYS: tuple[YamlPath, ...] = (
    (_TEXTURE, "internalIDToNameTable"),
    (_TEXTURE, "mipmaps", "sRGBTexture"),
    (_TEXTURE, "nPOTScale"),
    (_TEXTURE, "spriteMode"),
    (_TEXTURE, "spritePixelsToUnits"),
    (_TEXTURE, "alphaIsTransparency"),
    (_TEXTURE, "textureType"),
    (_TEXTURE, "spriteSheet", "sprites"),
    (_TEXTURE, "spriteSheet", "nameFileIdTable"),
)
"""Keys that every build overwrites in the ``.meta`` of a page; all others are kept."""

SECONDARY_TEXTURES: YamlPath = (_TEXTURE, "spriteSheet", "secondaryTextures")
"""The key that builds overwrite as well if the page has motion vectors."""

MESH_TYPE: YamlPath = (_TEXTURE, "spriteMeshType")
"""The key that builds overwrite as well if frames have meshes."""

_CONFLICT = re.compile(r"^(<{7}|>{7}) ", re.MULTILINE)


class LineSpan(NamedTuple):
    """Lines ``start`` to ``stop`` (excluded)."""

    start: int
    stop: int


def read_meta(file: str, data: bytes | None) -> str | None:
    """Return the text of the ``.meta`` called ``file``; None if there is none, or none with a GUID.

    Raises:
        OutputError: It is not text or has merge conflicts: its GUID, by which other files refer to
            the asset, would be lost.
    """
    if data is None:
        return None
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise OutputError(
            f"{file}: is not text, so that its GUID cannot be kept; restore it, or remove it "
            f"if nothing refers to it"
        ) from None
    guids = set(guids_in(text))
    if _CONFLICT.search(text) or len(guids) > 1:
        raise OutputError(f"{file}: two versions were merged into it; resolve that first")
    return text if guids else None


def merged(old: str | None, fresh: str, owned: Sequence[YamlPath]) -> str:
    """Return the ``.meta`` to write: ``old`` with the keys ``owned`` from ``fresh``.

    If ``old`` is for another importer, only its GUID and labels are kept.
    """
    if old is None:
        return fresh
    ends = "\r\n" if "\r\n" in old else "\n"
    kept, new = _lines(old), _lines(fresh)
    if _find(kept, _importer(new)) is None:
        kept, new, owned = _with_block(new, kept, ("labels",)), kept, [("guid",)]
    for path in owned:
        kept = _with_block(kept, new, path)
    return ends.join([*kept, ""])


def with_max_size(meta: str, needed: int) -> str:
    """Return the ``.meta`` of a page with every ``maxTextureSize`` at least ``needed`` px.

    A size that the user set for one platform is kept, even if it is smaller.
    """
    lines = meta.split("\n")
    spans = [_find(lines, (_TEXTURE, "maxTextureSize")), *_platforms(lines)]
    for span in filter(None, spans):
        inside = range(*span)
        if any(re.match(r" *overridden: 1", lines[i]) for i in inside):
            continue
        for i in inside:
            if found := re.match(r"( *maxTextureSize: )(\d+)", lines[i]):
                size = max(int(found[2]), needed)
                lines[i] = f"{found[1]}{size}{lines[i][found.end() :]}"
    return "\n".join(lines)


def _importer(lines: Sequence[str]) -> YamlPath:
    """Return the key of the importer in a ``.meta``."""
    return next((line[:-1],) for line in lines if re.fullmatch(r"\w+Importer:", line))


def _lines(text: str) -> list[str]:
    """Return the lines without their ends."""
    return text.rstrip("\r\n").replace("\r\n", "\n").split("\n")


def _platforms(lines: Sequence[str]) -> list[LineSpan]:
    """Return the span of each platform's settings."""
    block = _find(lines, (_TEXTURE, "platformSettings"))
    if block is None:
        return []
    starts = [i for i in range(*block) if re.match(r" *- ", lines[i])]
    return [LineSpan(*bounds) for bounds in zip(starts, [*starts[1:], block.stop], strict=True)]


def _find(lines: Sequence[str], path: YamlPath) -> LineSpan | None:
    """Return the lines of the key at ``path``; None if there is no such key."""
    span = LineSpan(-1, len(lines))
    for key in path:
        inner = LineSpan(span.start + 1, span.stop)
        matching = (found for name, found in _keys(lines, inner) if name == key)
        found = next(matching, None)
        if found is None:
            return None
        span = found
    return span


def _with_block(old: Sequence[str], new: Sequence[str], path: YamlPath) -> list[str]:
    """Return ``old`` with its lines at ``path`` replaced by those of ``new``, indented alike.

    If ``old`` lacks the key, it is added at the end of its parent; a missing or empty parent is
    replaced as a whole.
    """
    source, target = _find(new, path), _find(old, path)
    if source is None:
        return list(old)
    if target is None:
        block = _find(old, path[:-1])
        if block is None or block.stop - block.start == 1:
            return _with_block(old, new, path[:-1])
        target = LineSpan(block.stop, block.stop)
    return [*old[: target.start], *new[source.start : source.stop], *old[target.stop :]]


def _keys(lines: Sequence[str], inside: LineSpan) -> Iterator[tuple[str, LineSpan]]:
    """Yield the outermost keys in the lines ``inside``, with the span of each."""
    if inside.start >= inside.stop:
        return
    depth = _depth(lines[inside.start])
    key = re.compile(rf" {{{depth}}}([^\s:-][^:]*):(?: |$)")
    starts = [(i, found[1]) for i in range(*inside) if (found := key.match(lines[i]))]
    for (start, name), (stop, _) in pairwise([*starts, (inside.stop, "")]):
        yield name, LineSpan(start, stop)


def _depth(line: str) -> int:
    return len(line) - len(line.lstrip(" "))

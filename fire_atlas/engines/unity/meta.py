"""``.meta`` files: Unity and people write into them too, and what is theirs stays theirs."""

import re
from collections.abc import Sequence

from fire_atlas.core.errors import OutputError
from fire_atlas.engines.unity.blocks import Path, Span, find, replaced
from fire_atlas.engines.unity.identity import guids_in

_TEXTURE = "TextureImporter"

TEXTURE_KEYS: tuple[Path, ...] = (
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
"""What a build decides about a page, whoever wrote its ``.meta`` since. All else is kept."""

SECONDARY: Path = (_TEXTURE, "spriteSheet", "secondaryTextures")
"""What else it decides where a page has motion vectors."""

_CONFLICT = re.compile(r"^(<{7}|>{7}) ", re.MULTILINE)


def read_meta(file: str, data: bytes | None) -> str | None:
    """Return the text of the ``.meta`` called ``file``; None where there is none to be kept.

    Raises:
        OutputError: It is none, or two at once: its GUID, which others refer to, cannot be told.
    """
    if data is None:
        return None
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise OutputError(
            f"{file}: is no text, so that the GUID in it cannot be kept; restore it, or remove it "
            f"if nothing refers to it"
        ) from None
    guids = set(guids_in(text))
    if _CONFLICT.search(text) or len(guids) > 1:
        raise OutputError(f"{file}: two versions were merged into it; resolve that first")
    return text if guids else None


def merged(old: str | None, fresh: str, owned: Sequence[Path]) -> str:
    """Return the ``.meta`` to write: ``old`` with what is ``owned`` from ``fresh``, if it fits.

    An old one of another importer only leaves its GUID and labels.
    """
    if old is None:
        return fresh
    ends = "\r\n" if "\r\n" in old else "\n"
    kept, new = _lines(old), _lines(fresh)
    if find(kept, _importer(new)) is None:
        kept, new, owned = replaced(new, kept, ("labels",)), kept, [("guid",)]
    for path in owned:
        kept = replaced(kept, new, path)
    return ends.join([*kept, ""])


def with_max_size(meta: str, needed: int) -> str:
    """Return the ``.meta`` of a page with import limits of at least ``needed`` px.

    What a person set for one platform stays, smaller or not.
    """
    lines = meta.split("\n")
    spans = [find(lines, (_TEXTURE, "maxTextureSize")), *_platforms(lines)]
    for span in filter(None, spans):
        inside = range(*span)
        if any(re.match(r" *overridden: 1", lines[i]) for i in inside):
            continue
        for i in inside:
            if found := re.match(r"( *maxTextureSize: )(\d+)", lines[i]):
                size = max(int(found[2]), needed)
                lines[i] = f"{found[1]}{size}{lines[i][found.end() :]}"
    return "\n".join(lines)


def _importer(lines: Sequence[str]) -> Path:
    """Return the key of the importer that a ``.meta`` configures."""
    return next((line[:-1],) for line in lines if re.fullmatch(r"\w+Importer:", line))


def _lines(text: str) -> list[str]:
    """Return the lines, the last of which ends as the others do."""
    return text.rstrip("\r\n").replace("\r\n", "\n").split("\n")


def _platforms(lines: Sequence[str]) -> list[Span]:
    """Return the lines of each platform's settings."""
    block = find(lines, (_TEXTURE, "platformSettings"))
    if block is None:
        return []
    starts = [i for i in range(*block) if re.match(r" *- ", lines[i])]
    return [Span(*each) for each in zip(starts, [*starts[1:], block.stop], strict=True)]

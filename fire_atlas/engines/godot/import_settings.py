"""``.import`` files: the settings with which Godot imports a page.

Godot and the user write into these files as well. A new file gets settings for finished pixels: no
compression, no mipmaps, and no "fixing" of colours under low alpha. In an existing file only the
keys are changed without which the page would be shown wrongly.
"""

import re
from collections.abc import Mapping

_BORDER, _PREMULTIPLY = "process/fix_alpha_border", "process/premult_alpha"
_LIMIT = "process/size_limit"
_TYPE = 'type="CompressedTexture2D"'
_DEFAULTS = {
    "compress/mode": "0", "mipmaps/generate": "false", "detect_3d/compress_to": "0",
    _BORDER: "false", _PREMULTIPLY: "false", _LIMIT: "0",
}  # fmt: skip

KEEP = b'[remap]\n\nimporter="keep"\n'
"""Settings of a file that Godot must not import."""


def import_settings(existing: bytes | None, alpha: str, uid: str) -> bytes:
    """Return the ``.import`` file of a page.

    Args:
        existing: Content of the file, if there is one.
        alpha: How the page stores coverage, as in the recipe.
        uid: Of the page.
    """
    text = _decoded(existing)
    importer = re.search(r'^importer\s*=\s*"(.*)"', text, re.MULTILINE)
    if importer and importer[1] not in ("", "texture"):
        return existing or b""  # the user imports the page as something else
    if not importer or _TYPE not in text:
        return _new(uid).encode()
    text = _with(text, "remap", {"uid": f'"{uid}"'})
    return _with(text, "params", _needed(alpha)).encode()


def _new(uid: str) -> str:
    head = ["[remap]", "", 'importer="texture"', _TYPE, f'uid="{uid}"']
    return "\n".join([*head, "", "[params]", "", *(f"{k}={v}" for k, v in _DEFAULTS.items()), ""])


def _needed(alpha: str) -> dict[str, str]:
    """Return the settings without which a page would be shown wrongly.

    A size limit would shrink it, so that regions do not fit; premultiplied light must neither be
    multiplied by alpha again nor be replaced where alpha is low.
    """
    limit = {_LIMIT: "0"}
    return limit if alpha == "straight" else {_BORDER: "false", _PREMULTIPLY: "false", **limit}


def _decoded(existing: bytes | None) -> str:
    try:
        return (existing or b"").decode()
    except UnicodeDecodeError:
        return ""


def _with(text: str, section: str, values: Mapping[str, str]) -> str:
    """Return ``text`` with ``values`` set in ``[section]`` and all else unchanged."""
    newline = "\r\n" if "\r\n" in text else "\n"
    head = re.search(rf"^\[{section}\][^\S\n]*\n?", text, re.MULTILINE)
    if head is None:
        text = f"{text.rstrip()}{newline}{newline}[{section}]{newline}{newline}"
        return _with(text, section, values)
    following = re.compile(r"^\[\w+\]", re.MULTILINE).search(text, head.end())
    end = following.start() if following else len(text)
    body = text[head.end() : end]
    for key, value in values.items():
        line = re.compile(rf"^{re.escape(key)}[^\S\n]*=[^\r\n]*", re.MULTILINE)
        body, found = line.subn(f"{key}={value}", body)
        if not found:
            kept = body.rstrip()
            body = f"{kept}{newline}{key}={value}{body[len(kept) :] or newline}"
    return text[: head.end()] + body + text[end:]

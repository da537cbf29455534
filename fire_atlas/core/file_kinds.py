"""Recognise what lies under the name of an image, a video or a recipe without being one."""

_BEGINNINGS = {
    b"version https://git-lfs": "a Git LFS pointer, not the file: run `git lfs pull`",
    b"\x00\x05\x16\x07": "a file in which macOS keeps notes about another: leave it out",
    b"8BPS": "a Photoshop file: export PNG from it",
    b"gimp xcf": "a GIMP file: export PNG from it",
    b"BLENDER": "a Blender file: render it to PNG or EXR",
    b"RIFX": "an After Effects project: render it to PNG, EXR or ProRes 4444",
    b"PK\x03\x04": "a ZIP archive, as Krita's files are: unpack it, or export PNG from it",
    b"\x1f\x8b": "compressed by gzip: unpack it",
    b"\x28\xb5\x2f\xfd": "compressed by Zstandard, as Blender files are: render it to PNG or EXR",
    b"Rar!": "a RAR archive: unpack it",
    b"7z\xbc\xaf": "a 7z archive: unpack it",
    b"%PDF": "a PDF: export PNG from it",
    b"%!PS": "PostScript: export PNG from it",
}

_TEXTS = {
    (b"<!doctype html", b"<html"): "a web page, not the file: download the file itself",
    (b"<",): "XML, such as a server's answer, or SVG: download it again, or export PNG from it",
    (b"{", b"["): "JSON, not a picture",
}
"""What text is that begins so, in small letters."""

_ASEPRITE, _ASEPRITE_AT = b"\xe0\xa5", 4
HEIC_BRANDS = (b"heic", b"heix", b"hevc", b"mif1", b"msf1")
"""What stands in photos of phones where videos have ``isom``, ``qt`` and others."""


def misnamed(head: bytes, *, may_be_json: bool = False) -> str | None:
    """Return what a file is that begins with ``head``, and what to do; None if it may be what its
    name says.

    ``head`` has 32 bytes or more if the file has them, and is not empty.
    """
    if head == bytes(len(head)):
        return "only zeros, as a cloud drive leaves for what it has not downloaded: download it"
    for mark, what in _BEGINNINGS.items():
        if head.startswith(mark):
            return what
    if head[_ASEPRITE_AT : _ASEPRITE_AT + 2] == _ASEPRITE and len(head) >= 8:
        return "an Aseprite file: export GIF, PNG, or a sheet with its JSON from it"
    if head[4:8] == b"ftyp" and head[8:12] in HEIC_BRANDS:
        return "a HEIC photo: export PNG or JPEG from it"
    if may_be_json or b"\0" in head:
        return None
    text = head.removeprefix(b"\xef\xbb\xbf").lstrip().lower()
    return next((what for marks, what in _TEXTS.items() if text.startswith(marks)), None)

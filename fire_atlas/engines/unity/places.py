"""Find where files lie that a user has renamed or moved in Unity's editor: by their GUIDs.

The editor moves a file together with its ``.meta``, which holds the GUID by which all else refers
to it. What is in the folder may come from anyone: links are not followed, of a ``.meta`` only the
beginning is read, and of the folder a limited number of names.
"""

import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path, PurePosixPath

from fire_atlas.core.errors import OutputError
from fire_atlas.core.files import open_file
from fire_atlas.core.output_file import is_reserved, name_below
from fire_atlas.engines.unity.names import META_ENDING, guid_of, guids_in

MAX_NAMES = 200_000
"""Limit on the names that are read in an output folder and those in it, as in a source."""

_HEAD_BYTES = 1 << 12
"""So much of a ``.meta`` is read: the GUID stands in its second line."""


def moved_files(out: Path, files: Sequence[str], namespace: str) -> Mapping[str, str]:
    """Return where files lie now that were renamed or moved below ``out``, by their old names.

    A file that has a ``.meta`` at its old name is still there, whatever its GUID, unless that is
    the GUID of another of the files.

    Args:
        out: The output folder.
        files: Names of outputs as a build gives them.
        namespace: Of the GUIDs.

    Raises:
        OutputError: Two files have the GUID of one, the folder cannot be searched, or the place of
            a file is none that it can be written to.
    """
    found = _assets_by_guid(out)
    guid_at = {file: guid for guid, assets in found.items() for file in assets}
    derived = {guid_of(namespace, file): file for file in files}
    moved = dict[str, str]()
    for own, file in derived.items():
        there = guid_at.get(file, own)
        guid = own if there in derived else there
        assets = found.get(guid, [file])
        if len(assets) > 1:
            raise OutputError(
                f"{', '.join(str(out / (asset + META_ENDING)) for asset in assets)}: have one "
                f"GUID, {guid}, so that it is unknown which of them is {file}; nothing was "
                f"written: remove those that are copies, with their files"
            )
        if assets != [file]:
            moved[file] = _place(out, assets[0], file)
    return moved


def _place(out: Path, asset: str, file: str) -> str:
    """Return the place of a file, which must be of its kind.

    Raises:
        OutputError: It is not, or has a name that a build never writes.
    """
    try:
        place = name_below(asset)
    except ValueError:
        place = ""
    is_of_kind = PurePosixPath(asset).suffix == PurePosixPath(file).suffix
    if not place or is_reserved(place) or not is_of_kind:
        raise OutputError(
            f"{out / asset}: has the GUID of {file}, which cannot be written under that name; "
            f"give it another name, or remove its {META_ENDING}"
        )
    return place


def _assets_by_guid(out: Path) -> Mapping[str, list[str]]:
    """Return the files that have a ``.meta``, below ``out``, by the GUIDs in it."""
    found: dict[str, list[str]] = {}
    for meta in sorted(_metas(out)):
        for guid in dict.fromkeys(guids_in(_head(out / meta))):
            found.setdefault(guid, []).append(meta.removesuffix(META_ENDING))
    return found


def _metas(out: Path) -> Iterator[str]:
    """Yield the ``.meta`` files below ``out``, but those in folders that Unity does not show."""
    count, folders = 0, [""]
    while folders:
        folder = folders.pop()
        try:
            with os.scandir(out / folder) as listed:
                for item in listed:
                    count += 1
                    if count > MAX_NAMES:
                        raise OutputError(
                            f"{out}: has more than {MAX_NAMES} names in it, too many to search for "
                            f"pages that were renamed in Unity; choose a folder in it (-o)"
                        )
                    if item.name.startswith("."):
                        continue
                    if item.is_dir(follow_symlinks=False) and not item.name.endswith("~"):
                        folders.append(f"{folder}{item.name}/")
                    elif item.name.endswith(META_ENDING) and item.is_file(follow_symlinks=False):
                        yield folder + item.name
        except OSError as error:
            raise _unreadable(out / folder, error) from error


def _head(meta: Path) -> str:
    """Return the beginning of a ``.meta``; what is not text in it is left out."""
    try:
        with open_file(meta) as file:
            return file.read(_HEAD_BYTES).decode("utf-8-sig", errors="ignore").replace("\r\n", "\n")
    except OSError as error:
        raise _unreadable(meta, error) from error


def _unreadable(path: Path, error: OSError) -> OutputError:
    return OutputError(
        f"{path}: cannot be read ({error.strerror}), so it is unknown whether it holds a page that "
        f"was renamed in Unity; change its permissions, or choose another folder (-o)"
    )

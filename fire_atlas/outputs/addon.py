"""Install the add-on of an engine into a project: files that belong to no recipe.

A manifest beside them lists their digests, as that of a build does. So a later version of the tool
may replace and remove what an earlier one wrote, and nothing else.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path

from fire_atlas.core.errors import OutputError
from fire_atlas.core.interruption import signals_wait
from fire_atlas.core.output_file import OutputFile, Role
from fire_atlas.core.version import __version__
from fire_atlas.outputs.folder import refuse_leading_out
from fire_atlas.outputs.manifest import (
    Manifest,
    OutputEntry,
    encode_manifest,
    manifest_name,
    read_manifest,
)
from fire_atlas.outputs.ownership import commit, refuse_commit
from fire_atlas.outputs.recovery import tidy
from fire_atlas.outputs.staging import Staging

_ADVICE = (
    "nothing was written, so that nothing is lost: move it away, or replace it with --overwrite"
)


def install(
    project: Path,
    folders: Mapping[Path, Sequence[OutputFile]],
    name: str,
    overwrite: bool,
    note: Callable[[str], None],
) -> bool:
    """Write the files of the add-on ``name``, all or none.

    Args:
        project: The project that the folders belong to.
        folders: All files that the add-on has in each folder, which is made if it does not exist.
            What the first ones need lies in the later ones: they are written in reverse.
        name: File stem of the manifests.
        overwrite: Whether files may be replaced that no add-on wrote or that were changed since, or
            a newer add-on by this one.
        note: Called with a sentence if another process is waited for.

    Returns:
        Whether anything was written; not if all is there already.

    Raises:
        OutputError: A file of the user would be replaced, one cannot be written, a folder leads out
            of the project, or the add-on there is newer.
    """
    for folder in folders:
        refuse_leading_out(folder, project, "the project; remove the link")
        tidy(folder, name, note)
        if not overwrite:
            _refuse_newer(folder, name)
    with ExitStack() as stack:
        staged = list[tuple[Staging, tuple[OutputEntry, ...]]]()
        for folder, files in folders.items():
            staging = stack.enter_context(Staging(folder, name, note, overwrite))
            entries = tuple(_staged(file.name, file.role, file.data, staging) for file in files)
            manifest = encode_manifest(_manifest(name, entries))
            marker = _staged(manifest_name(name), "manifest", manifest, staging)
            if not all(entry.is_intact(folder) for entry in (*entries, marker)):
                staged.append((staging, (*entries, marker)))
        for staging, entries in staged:
            refuse_commit(name, entries, staging, _ADVICE)
        with signals_wait():
            for staging, entries in reversed(staged):
                commit(name, entries, staging, _ADVICE)
    return bool(staged)


def _refuse_newer(folder: Path, name: str) -> None:
    """Raise if a later version of the tool has written the add-on that is there."""
    there = read_manifest(folder, name)
    if there is not None and _version(there.tool) > _version(__version__):
        raise OutputError(
            f"{folder}: holds the add-on of {there.tool}, which is newer than this fire-atlas "
            f"{__version__}; update fire-atlas, or put the older one there with --overwrite"
        )


def _version(text: str) -> tuple[int, ...]:
    """Return the numbers in a version, such as ``fire-atlas 0.10.1``."""
    return tuple(map(int, re.findall(r"[0-9]{1,9}", text)))


def _manifest(name: str, outputs: tuple[OutputEntry, ...]) -> Manifest:
    """Return a manifest without what only a recipe has."""
    return Manifest(
        name,
        request_digest="",
        recipe_digest="",
        tool_digest="",
        inputs=(),
        outputs=outputs,
        statistics={},
    )


def _staged(name: str, role: Role, data: bytes, staging: Staging) -> OutputEntry:
    with staging.open(name) as file:
        file.write(data)
    return staging.entry(name, role)

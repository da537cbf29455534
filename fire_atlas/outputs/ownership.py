"""Decide which files of an output folder a build may replace or remove.

A file belongs to a build if a manifest in the folder lists its digest; all others are the user's.
Import settings are the one exception: engines and people edit them, so they are recognised by their
content instead.
"""

import errno
import hashlib
import re
from collections.abc import Collection, Iterable, Mapping, Sequence, Set
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Self

from fire_atlas.core.errors import OutputError
from fire_atlas.core.files import read_file
from fire_atlas.core.output_file import as_file_name, is_reserved
from fire_atlas.outputs.disk import is_regular_in
from fire_atlas.outputs.manifest import (
    MAX_MANIFEST_BYTES,
    Manifest,
    OutputEntry,
    decode_manifest,
    manifest_name,
    read_manifest,
)
from fire_atlas.outputs.staging import Staging

_GUID = re.compile(rb"^guid: [0-9a-f]{32}\s*$", re.MULTILINE)
_REMAP = re.compile(rb"^\[remap\]", re.MULTILINE)
_SOURCE_FILE = re.compile(rb'^source_file="(?:[^"\r\n]*/)?([^"/\r\n]*)"', re.MULTILINE)
_UID = re.compile(rb"uid://[a-y0-8]{1,13}\s*")

_ADVICE = (
    "nothing was built, so that nothing is lost: move it away, choose another `name` or folder "
    "(-o), or replace it with --overwrite"
)

_NOT_A_FILE = {errno.ENOENT, errno.EINVAL, errno.EISDIR, errno.EFBIG, errno.ELOOP}
"""Errors of ``read_file`` where there is no file, none that is regular, or one too large."""

_MAX_SETTINGS_BYTES = 1 << 24
"""Maximum size of import settings; those of a page of thousands of sprites take some MiB."""

_MAX_TEXT_BYTES = 1 << 26
"""Maximum size of an output whose line endings are compared; larger ones are no text of ours."""


@dataclass(frozen=True)
class FolderManifests:
    """The manifests in an output folder, as seen by one build.

    Attributes:
        out: The folder.
        name: Name of the build.
        own: Its manifest, if there is a valid one.
    """

    out: Path
    name: str
    own: Manifest | None

    @classmethod
    def read(cls, out: Path, name: str) -> Self:
        """Read the build's own manifest."""
        return cls(out, name, read_manifest(out, name))

    @cached_property
    def others(self) -> Mapping[str, Manifest]:
        """The valid manifests of other builds, by their names.

        They are read when one is first asked for, which few builds do: n builds of one folder
        would read n² manifests.

        Raises:
            OutputError: One cannot be read, so that its build's files are unknown.
        """
        suffix = manifest_name("")
        files = [file for file in _files_in(self.out) if file.endswith(suffix)]
        names = {file.removesuffix(suffix) for file in files} - {self.name}
        found = {other: _manifest_of_another(self.out, other) for other in sorted(names)}
        return {other: manifest for other, manifest in found.items() if manifest is not None}

    def other_owner(self, file: str) -> str | None:
        """Return the name of another build whose manifest lists ``file``; None if there is none."""
        return next((o for o, manifest in self.others.items() if _lists(manifest, file)), None)

    def owns(self, file: str) -> bool:
        """Return whether ``file`` is the build's own manifest, or listed in it."""
        if self.own is None:
            return False
        return file == manifest_name(self.name) or _lists(self.own, file)

    def may_replace(self, file: str, role: str) -> bool:
        """Return whether writing an output of this name and role would destroy no user's file."""
        path = self.out / file
        if not path.exists():
            return True
        if role == "manifest":
            return self.own is not None
        if role == "import" and _is_import_settings(self.out, file):
            return True  # the output has the user's edits merged in
        own = self.own.outputs if self.own else ()
        # What the build has written for the same purpose may have been given this name since.
        entries = [entry for entry in own if file == entry.name or entry.role == role]
        return any(_describes(entry, self.out, file) for entry in entries) or any(
            _describes(entry, self.out, file)
            for manifest in self.others.values()
            for entry in manifest.outputs
            if entry.name == file
        )


def _files_in(out: Path) -> list[str]:
    try:
        return [path.name for path in out.iterdir()]
    except FileNotFoundError:
        return []
    except OSError as error:
        raise OutputError(
            f"{out}: cannot be listed ({error.strerror}), so it is unknown which files belong to "
            f"other builds; change its permissions, or choose another folder with -o"
        ) from error


def _manifest_of_another(out: Path, name: str) -> Manifest | None:
    """Return the manifest of another build; None if what bears its name is no manifest."""
    path = out / manifest_name(name)
    try:
        return decode_manifest(read_file(path, MAX_MANIFEST_BYTES))
    except ValueError:
        return None
    except OSError as error:
        if error.errno in _NOT_A_FILE:
            return None
        raise OutputError(
            f"{path}: cannot be read ({error.strerror}), so it is unknown which files belong to "
            f"that build; make it readable, or move it away"
        ) from error


def refuse_replacing(
    manifests: FolderManifests,
    outputs: Iterable[tuple[str, str]],
    overwrite: bool = False,
    advice: str = _ADVICE,
) -> None:
    """Refuse to write ``outputs`` (name, role) over files that do not belong to the build.

    Args:
        manifests: The manifests in the output folder.
        outputs: Without those that would not change: builds may share files with equal bytes.
        overwrite: Replace files that no manifest lists. Files of another build are still refused.
        advice: What the user can do if any is refused.

    Raises:
        OutputError: Some would replace a file that belongs to another build, is not an output, or
            was changed since it was built; with a line for each.
    """
    there = [output for output in sorted(outputs) if (manifests.out / output[0]).exists()]
    for file, _ in there:
        if not manifests.owns(file) and (other := manifests.other_owner(file)):
            raise OutputError(
                f"{manifests.out / file}: belongs to the build of {other}; choose another `name` "
                f"or folder (-o), or clean that build first"
            )
    taken = [output for output in there if not overwrite and not manifests.may_replace(*output)]
    if taken:
        raise OutputError(*(_objection(manifests, *output) for output in taken), advice)


def _objection(manifests: FolderManifests, file: str, role: str) -> str:
    """Return the reason why a build may not replace a file."""
    if role == "manifest":
        why = "is not a valid manifest, so it is unknown which files belong to the build"
    elif manifests.owns(file):
        why = "was changed since it was built"
    else:
        why = "was there before, and is not an output of a build"
    return f"{manifests.out / file}: {why}"


def stale_outputs(manifests: FolderManifests, written: Collection[str]) -> list[str]:
    """Return the names of the files of an earlier build that can be removed now.

    These are not among those ``written`` now, were not changed since, and are not listed by other
    builds. Import settings are removed or kept with the file they belong to, edited or not.
    """
    if manifests.own is None:
        return []
    listed = {entry.name: entry for entry in manifests.own.outputs}
    old = {
        name: entry
        for name, entry in listed.items()
        if not (name in written or is_reserved(name) or manifests.other_owner(name))
    }
    stale: Set[str] = {n for n, entry in old.items() if _describes(entry, manifests.out, n)}
    for name, entry in old.items():
        if entry.role == "import" and _subject(name) in listed:
            stale = _with_settings(manifests.out, name, stale)
    return [name for name in old if name in stale]


def commit(
    name: str, outputs: Sequence[OutputEntry], staging: Staging, advice: str = _ADVICE
) -> tuple[Path, ...]:
    """Move all outputs of the build ``name`` into place, and remove those it no longer writes.

    ``advice`` ends the error about files that must not be replaced.

    Returns:
        The outputs in their places.

    Raises:
        OutputError: An output would replace a file of another build or of the user, or another
            output on a file system that ignores case.
    """
    _refuse_names_of_one_file([output.name for output in outputs])
    with staging.folder_locked():
        manifests = refuse_commit(name, outputs, staging, advice)
        staging.commit(stale_outputs(manifests, [output.name for output in outputs]))
    return tuple(staging.out / output.name for output in outputs)


def refuse_commit(
    name: str, outputs: Sequence[OutputEntry], staging: Staging, advice: str
) -> FolderManifests:
    """Refuse what ``commit`` would refuse to replace; return the manifests of the folder."""
    manifests = FolderManifests.read(staging.out, name)
    changed = [(entry.name, entry.role) for entry in outputs if not entry.is_intact(staging.out)]
    refuse_replacing(manifests, changed, staging.overwrite, advice)
    return manifests


def _refuse_names_of_one_file(names: Sequence[str]) -> None:
    known: dict[str, str] = {}
    for name in names:
        if other := known.get(as_file_name(name)):
            what = (
                "two outputs would be this file"
                if other == name
                else f"would be the same file as {other} on Windows or macOS"
            )
            raise OutputError(f"{name}: {what}; give one of them another name")
        known[as_file_name(name)] = name


def _with_settings(out: Path, name: str, stale: Set[str]) -> Set[str]:
    """Return ``stale`` with the import settings ``name`` if the file they belong to is stale."""
    subject = _subject(name)
    if subject in stale:
        return stale | {name} if _is_import_settings(out, name) else stale
    return stale - {name} if (out / subject).exists() else stale


def _lists(manifest: Manifest, file: str) -> bool:
    return any(entry.name == file for entry in manifest.outputs)


def _subject(name: str) -> str:
    """Return the name of the file that the import settings ``name`` belong to."""
    return name.rpartition(".")[0]


def _describes(entry: OutputEntry, out: Path, name: str) -> bool:
    """Return whether ``name`` is the file that an entry of a manifest describes, not a link.

    Line endings of text are ignored: version control changes them.
    """
    path = out / name
    if not is_regular_in(out, name):
        return False
    if replace(entry, name=name).is_intact(out):
        return True
    if not entry.size < path.stat().st_size <= min(2 * entry.size, _MAX_TEXT_BYTES):
        return False
    data = path.read_bytes()
    text = data.replace(b"\r\n", b"\n")
    return b"\0" not in data and hashlib.sha256(text).hexdigest() == entry.sha256


def _is_import_settings(out: Path, name: str) -> bool:
    """Return whether a file holds an engine's import settings of the file it is named after."""
    path = out / name
    if not is_regular_in(out, name) or path.stat().st_size > _MAX_SETTINGS_BYTES:
        return False
    data = path.read_bytes()
    match path.suffix:
        case ".meta":
            return len(_GUID.findall(data)) == 1
        case ".uid":
            return _UID.fullmatch(data) is not None
        case ".import":
            sources = _SOURCE_FILE.findall(data)
            return bool(_REMAP.search(data)) and all(s == path.stem.encode() for s in sources)
        case ".mat":
            return data.startswith(b"%YAML") and b"\nMaterial:" in data
    return False

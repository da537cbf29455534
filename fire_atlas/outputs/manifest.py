"""The manifest: what a build was made from and what it wrote, and whether that still holds.

Nothing heavy is imported here: an up-to-date build reads a recipe, this file and some hashes.
"""

import filecmp
import hashlib
import json
import os
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from functools import cache
from importlib import metadata
from pathlib import Path, PureWindowsPath
from typing import Any, Self

from fire_atlas import __version__
from fire_atlas.core.errors import OutputError
from fire_atlas.core.shipped import shipped
from fire_atlas.recipe.tree import RecipeTree, member_trees, source_files, templates
from fire_atlas.sources.listing import Chosen, list_inputs

FORMAT = "fire-atlas/manifest"

IMPORT = "import"
"""Role of files that say how an engine imports others: engines and people write on in them."""

_LIBRARIES = (
    "numpy",
    "opencv-contrib-python-headless",
    "Pillow",
    "pydantic",
    "Jinja2",
    "av",
    "pyoxipng",
)


@dataclass(frozen=True, slots=True)
class Input:
    """A file the clip was read from, and its SHA-256 before that."""

    path: Path
    sha256: str

    @classmethod
    def of(cls, path: Path) -> Self:
        """Look at the file as it is now."""
        return cls(path, _digest(path))


@dataclass(frozen=True, slots=True)
class Output:
    """A written file: its name in the output folder, what it is for, and where it lies now."""

    name: str
    role: str
    path: Path


@dataclass(frozen=True, slots=True)
class Written:
    """An output as the manifest remembers it."""

    name: str
    role: str
    bytes: int
    sha256: str

    @classmethod
    def of(cls, entry: dict[str, Any]) -> Self:
        """Read an entry of a manifest, which is input like any other.

        Raises:
            ValueError: It names a file outside the manifest's folder.
        """
        name = entry["path"]
        # By this rule a/b, a\\b, C:b and .. are no file names, whatever system wrote them.
        if PureWindowsPath(name).name != name or not name.strip("."):
            raise ValueError(f"{name!r} is not a plain file name")
        return cls(name, entry["role"], entry["bytes"], entry["sha256"])

    def is_fresh(self, out: Path) -> bool:
        """Whether the file in ``out`` need not be written again: engines may write on in theirs."""
        return (out / self.name).is_file() if self.role == IMPORT else self.is_intact(out)

    def is_intact(self, out: Path) -> bool:
        """Whether the file in ``out`` still is what the build wrote."""
        path = out / self.name
        return path.is_file() and path.stat().st_size == self.bytes and _digest(path) == self.sha256


@dataclass(frozen=True, slots=True)
class Manifest:
    """What is read back of a manifest.

    Attributes:
        asked: Hash of what was asked for.
        made_by: Hash of the code and the libraries.
        inputs: (path relative to the recipe's folder, SHA-256), in order of play.
        outputs: What was written, without the manifest itself.
    """

    asked: str
    made_by: str
    inputs: list[tuple[str, str]]
    outputs: list[Written]


def default_folder(recipe: Path) -> Path:
    """Return where the outputs of ``recipe`` go when nobody says: ``build`` beside it.

    Raises:
        OutputError: It is a link that leads elsewhere. A recipe that came from a stranger must not
            choose which of the user's folders is written to.
    """
    folder = recipe.parent / "build"
    if not folder.resolve().is_relative_to(recipe.parent.resolve()):
        raise OutputError(
            f"{folder}: is a link to {folder.resolve()}, outside the recipe's folder; if you want "
            f"the outputs there, say so with -o"
        )
    return folder


def manifest_name(name: str) -> str:
    """File name of the manifest of the build ``name``."""
    return f"{name}.manifest.json"


def describe(
    tree: RecipeTree,
    resolved: str,
    inputs: Iterable[Input],
    outputs: Iterable[Output],
    statistics: dict[str, Any],
    made_by: str,
) -> bytes:
    """Return the manifest as bytes; no time, no machine, no absolute path.

    Args:
        tree: The recipe as it was asked for.
        resolved: The recipe with all its defaults, as JSON.
        inputs: Files the clip was read from.
        outputs: Files that were written.
        statistics: Figures about the result.
        made_by: What ``maker`` returned before anything was made.
    """
    folder = tree.path.parent
    manifest = {
        "format": FORMAT,
        "version": 1,
        "name": tree.name,
        "tool": f"fire-atlas {__version__}",
        "made_by": made_by,
        "asked": _asked(tree),
        "recipe": hashlib.sha256(resolved.encode()).hexdigest(),
        "inputs": [{"path": _relative(i.path, folder), "sha256": i.sha256} for i in inputs],
        "outputs": [
            {
                "path": output.name,
                "role": output.role,
                "bytes": output.path.stat().st_size,
                "sha256": _digest(output.path),
            }
            for output in outputs
        ],
        "statistics": statistics,
    }
    return (json.dumps(manifest, indent=1) + "\n").encode()


def why_stale(tree: RecipeTree, out: Path) -> str | None:
    """Say why building ``tree`` now would write other outputs than those in ``out``; None if it
    would not."""
    manifest = read_manifest(out, tree.name)
    if manifest is None:
        return f"{out} holds no sound {manifest_name(tree.name)}"
    if manifest.asked != _asked(tree):
        return "the recipe says something else now"
    if manifest.made_by != maker():
        return "fire-atlas or one of its libraries is another version"
    folder = tree.path.parent
    inputs = inputs_of(tree)
    names = [_relative(path, folder) for path in inputs]
    if names != [path for path, _ in manifest.inputs]:
        return f"there are other inputs: {_first_difference(manifest.inputs, names)}"
    for path, (name, sha256) in zip(inputs, manifest.inputs, strict=True):
        if not _holds(path, sha256):
            return f"{name} has changed"
    for output in manifest.outputs:
        if not output.is_fresh(out):
            return f"{out / output.name} is missing, or not as it was written"
    return None


def _first_difference(before: list[tuple[str, str]], names: list[str]) -> str:
    """Name an input that is new or gone, and say which; or that their order is another."""
    known = {name for name, _ in before}
    for name in names:
        if name not in known:
            return f"{name} is new"
    for name, _ in before:
        if name not in names:
            return f"{name} is gone"
    return "in another order"


def inputs_of(tree: RecipeTree) -> list[Path]:
    """Return the files that the source and the templates of a sound recipe stand for now, in the
    order of the manifest.

    Raises:
        SourceError: The source is missing, or has not the frames that the recipe asks for.
    """
    parts = [tree] if "source" in tree.values else []
    parts += member_trees(tree)
    return [*(path for part in parts for path in _clip_of(part)), *templates(tree).values()]


def _clip_of(tree: RecipeTree) -> list[Path]:
    start, count = (tree.value(("source", key)) for key in ("start", "count"))
    cut = Chosen(start if isinstance(start, int) else 0, count if isinstance(count, int) else None)
    return [path for files in source_files(tree).values() for path in list_inputs(cut, files)]


def stale_outputs(out: Path, name: str, written: Collection[str]) -> list[Path]:
    """Files that the previous build ``name`` wrote into ``out`` that are not among those
    ``written`` now, and untouched since. What says how to import a file goes and stays with it,
    whoever wrote on in it."""
    manifest = read_manifest(out, name)
    if manifest is None:
        return []
    files = {output.name for output in manifest.outputs}
    old = [output for output in manifest.outputs if output.name not in written]
    imports = [o for o in old if o.role == IMPORT and Path(o.name).stem in files]
    going = {o.name for o in old if o not in imports and o.is_intact(out)}
    for output in imports:
        subject = Path(output.name).stem
        is_alone = subject in going or not (out / subject).exists()
        if is_alone and (out / output.name).is_file():
            going.add(output.name)
    return [out / output.name for output in old if output.name in going]


def refuse_others(out: Path, name: str, outputs: Iterable[Output]) -> None:
    """Refuse to change what another build than ``name`` wrote into ``out``.

    Builds may share a file that is the same for all.

    Raises:
        OutputError: One of ``outputs`` is another one of another build: pages of ``fire`` may be
            called as those of a recipe ``fire-1``.
    """
    own = read_manifest(out, name)
    known = {output.name for output in own.outputs} if own else set()
    there = {
        output.name
        for output in outputs
        if output.name not in known and _differs(out / output.name, output.path)
    }
    if not there:
        return
    suffix = manifest_name("")
    for path in sorted(out.glob(f"*{suffix}")):
        other = path.name.removesuffix(suffix)
        found = read_manifest(out, other) if other != name else None
        taken = sorted(there & {output.name for output in found.outputs}) if found else []
        if taken:
            raise OutputError(
                f"{out / taken[0]}: belongs to the build of {other}; choose another `name` or "
                f"folder (-o), or clean that build first"
            )


def _differs(old: Path, new: Path) -> bool:
    return old.is_file() and not filecmp.cmp(old, new, shallow=False)


def read_manifest(out: Path, name: str) -> Manifest | None:
    """Return the manifest of the build ``name`` in ``out``, or None where there is no sound one."""
    try:
        told = json.loads((out / manifest_name(name)).read_bytes())
        if told["format"] != FORMAT or told["version"] != 1:
            return None
        return Manifest(
            asked=told["asked"],
            made_by=told["made_by"],
            inputs=[(entry["path"], entry["sha256"]) for entry in told["inputs"]],
            outputs=[Written.of(entry) for entry in told["outputs"]],
        )
    except (OSError, ValueError, LookupError, TypeError, RecursionError):
        return None


def _asked(tree: RecipeTree) -> str:
    """Hash of all that the recipe, its members, those they extend and ``--set`` say."""
    asked = [[part.name, part.values] for part in (tree, *member_trees(tree))]
    return hashlib.sha256(json.dumps(asked).encode()).hexdigest()


@cache
def maker() -> str:
    """Hash of what makes the bytes: this tool's code and the versions of its libraries.

    Looked at once: what is changed while the tool runs is not what it runs.
    """
    digest = hashlib.sha256()
    package = Path(__file__).resolve().parents[1]
    for path in sorted(package.rglob("*.py")):
        digest.update(path.relative_to(package).as_posix().encode())
        digest.update(path.read_bytes())
    templates = shipped("templates")
    for path in sorted(path for path in templates.rglob("*") if path.is_file()):
        digest.update(path.relative_to(templates).as_posix().encode())
        digest.update(path.read_bytes())
    for library in _LIBRARIES:
        digest.update(f"{library} {_version(library)}\n".encode())
    return digest.hexdigest()


def _version(library: str) -> str:
    try:
        return metadata.version(library)
    except metadata.PackageNotFoundError:
        return "absent"  # some only come with an extra


def _digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _holds(path: Path, sha256: str) -> bool:
    """Whether ``path`` is as it was; if it cannot be read, the build will say why."""
    try:
        return _digest(path) == sha256
    except OSError:
        return False


def _relative(path: Path, folder: Path) -> str:
    return Path(os.path.relpath(path, folder.resolve())).as_posix()

"""The manifest: what a build was made from and what it wrote, and whether that still holds.

Nothing heavy is imported here: an up-to-date build reads a recipe, this file and some hashes.
"""

import hashlib
import json
import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from fire_atlas import __version__
from fire_atlas.recipe.tree import RecipeTree
from fire_atlas.sources.listing import list_inputs

FORMAT = "fire-atlas/manifest"
_LIBRARIES = ("numpy", "opencv-contrib-python-headless", "Pillow", "pydantic")


@dataclass(frozen=True, slots=True)
class Output:
    """A written file: its name in the output folder, what it is for, and where it lies now."""

    name: str
    role: str
    path: Path


def manifest_name(name: str) -> str:
    """File name of the manifest of the build ``name``."""
    return f"{name}.manifest.json"


def describe(
    tree: RecipeTree,
    resolved: str,
    inputs: Iterable[Path],
    outputs: Iterable[Output],
    statistics: dict[str, Any],
) -> bytes:
    """Return the manifest as bytes; no time, no machine, no absolute path.

    Args:
        tree: The recipe as it was asked for.
        resolved: The recipe with all its defaults, as JSON.
        inputs: Files the clip was read from.
        outputs: Files that were written.
        statistics: Figures about the result.
    """
    folder = tree.path.parent
    manifest = {
        "format": FORMAT,
        "version": 1,
        "name": tree.name,
        "tool": f"fire-atlas {__version__}",
        "made_by": _maker(),
        "asked": _asked(tree),
        "recipe": hashlib.sha256(resolved.encode()).hexdigest(),
        "inputs": [{"path": _relative(p, folder), "sha256": _digest(p)} for p in inputs],
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


def is_fresh(tree: RecipeTree, out: Path) -> bool:
    """Whether the outputs in ``out`` are what building ``tree`` now would write."""
    manifest = read_manifest(out, tree.name)
    if manifest is None or manifest["asked"] != _asked(tree) or manifest["made_by"] != _maker():
        return False
    folder = tree.path.parent
    inputs = _inputs_of(tree)
    known = manifest["inputs"]
    return (
        [_relative(p, folder) for p in inputs] == [entry["path"] for entry in known]
        and all(_digest(p) == e["sha256"] for p, e in zip(inputs, known, strict=True))
        and all(_is_intact(out / entry["path"], entry) for entry in manifest["outputs"])
    )


def stale_outputs(out: Path, name: str, written: Sequence[str]) -> list[Path]:
    """Files that the previous build ``name`` wrote into ``out``, untouched since, that are not
    among those ``written`` now."""
    manifest = read_manifest(out, name) or {"outputs": []}
    return [
        out / entry["path"]
        for entry in manifest["outputs"]
        if entry["path"] not in written and _is_intact(out / entry["path"], entry)
    ]


def read_manifest(out: Path, name: str) -> dict[str, Any] | None:
    """Return the manifest of the build ``name`` in ``out``, or None where there is no sound one."""
    try:
        manifest = json.loads((out / manifest_name(name)).read_bytes())
        is_ours = manifest["format"] == FORMAT and manifest["version"] == 1
        names = [entry["path"] for entry in manifest["outputs"]]
    except (OSError, ValueError, KeyError, TypeError):
        return None
    # A manifest is input like any other: it must not name files outside its folder.
    return manifest if is_ours and all(Path(n).name == n for n in names) else None


def _inputs_of(tree: RecipeTree) -> list[Path]:
    """Files the recipe's source stands for now. The tree equals one that was built, so it is
    sound."""
    source: Any = tree.values["source"]
    path = tree.file_at(("source", "path"), source["path"])
    choice: Any = SimpleNamespace(start=source.get("start", 0), count=source.get("count"))
    return list_inputs(choice, path)


def _asked(tree: RecipeTree) -> str:
    """Hash of all that the recipe, those it extends and ``--set`` say."""
    return hashlib.sha256(json.dumps([tree.name, tree.values]).encode()).hexdigest()


def _maker() -> str:
    """Hash of what makes the bytes: this tool's code and the versions of its libraries."""
    digest = hashlib.sha256()
    package = Path(__file__).parent
    for path in sorted(package.rglob("*.py")):
        digest.update(path.relative_to(package).as_posix().encode())
        digest.update(path.read_bytes())
    for library in _LIBRARIES:
        digest.update(f"{library} {metadata.version(library)}\n".encode())
    return digest.hexdigest()


def _digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _is_intact(path: Path, entry: dict[str, Any]) -> bool:
    return (
        path.is_file()
        and path.stat().st_size == entry["bytes"]
        and _digest(path) == entry["sha256"]
    )


def _relative(path: Path, folder: Path) -> str:
    return Path(os.path.relpath(path, folder.resolve())).as_posix()

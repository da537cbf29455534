"""Which files of an output folder a build may replace or remove.

Its own manifest vouches for what it may remove; what another build's manifest lists stays as it is.
"""

from collections.abc import Collection, Iterable, Iterator
from pathlib import Path

from fire_atlas.core.errors import OutputError
from fire_atlas.outputs.manifest import Manifest, OutputEntry, manifest_name, read_manifest


def stale_outputs(out: Path, name: str, written: Collection[str]) -> list[Path]:
    """Return the files that an earlier build ``name`` wrote into ``out`` and that may go now.

    They are not among those ``written`` now, and nobody changed them since. What says how to
    import a file goes and stays with it, whoever wrote on in it.
    """
    manifest = read_manifest(out, name)
    if manifest is None:
        return []
    files = {entry.name for entry in manifest.outputs}
    old = [entry for entry in manifest.outputs if entry.name not in written]
    imports = [e for e in old if e.role == "import" and Path(e.name).stem in files]
    going = {e.name for e in old if e not in imports and e.is_intact(out)}
    for entry in imports:
        subject = Path(entry.name).stem
        is_alone = subject in going or not (out / subject).exists()
        if is_alone and (out / entry.name).is_file():
            going.add(entry.name)
    return [out / entry.name for entry in old if entry.name in going]


def refuse_overwriting_others(out: Path, name: str, outputs: Iterable[OutputEntry]) -> None:
    """Refuse to change what another build than ``name`` wrote into ``out``.

    Builds may share a file that is the same for all.

    Raises:
        OutputError: One of ``outputs`` would replace one of another build by something else: pages
            of ``fire`` may be called as those of a recipe ``fire-1``.
    """
    own = read_manifest(out, name)
    known = {entry.name for entry in own.outputs} if own else set()
    replaced = {
        entry.name
        for entry in outputs
        if entry.name not in known and (out / entry.name).is_file() and not entry.is_intact(out)
    }
    if not replaced:
        return
    for other, manifest in _other_builds(out, name):
        taken = sorted(replaced & {entry.name for entry in manifest.outputs})
        if taken:
            raise OutputError(
                f"{out / taken[0]}: belongs to the build of {other}; choose another `name` or "
                f"folder (-o), or clean that build first"
            )


def _other_builds(out: Path, name: str) -> Iterator[tuple[str, Manifest]]:
    """Yield the name and the manifest of each other build whose manifest in ``out`` is sound."""
    suffix = manifest_name("")
    for path in sorted(out.glob(f"*{suffix}")):
        other = path.name.removesuffix(suffix)
        manifest = read_manifest(out, other) if other != name else None
        if manifest is not None:
            yield other, manifest

"""Install the add-on of an engine into a project: files that belong to no recipe.

A manifest beside them lists their digests, as that of a build does. So a later version of the tool
may replace and remove what an earlier one wrote, and nothing else.
"""

from collections.abc import Callable, Sequence
from pathlib import Path

from fire_atlas.core.output_file import OutputFile, Role
from fire_atlas.outputs.folder import refuse_leading_out
from fire_atlas.outputs.manifest import Manifest, OutputEntry, encode_manifest, manifest_name
from fire_atlas.outputs.ownership import commit
from fire_atlas.outputs.recovery import tidy
from fire_atlas.outputs.staging import Staging

_ADVICE = (
    "nothing was written, so that nothing is lost: move it away, or replace it with --overwrite"
)


def install(
    project: Path,
    folder: Path,
    name: str,
    files: Sequence[OutputFile],
    overwrite: bool,
    note: Callable[[str], None],
) -> bool:
    """Write the files of the add-on ``name`` into ``folder``, all or none.

    Args:
        project: The project that the folder belongs to.
        folder: Made if it does not exist.
        name: File stem of the manifest.
        files: All files that the add-on has in this folder.
        overwrite: Whether files may be replaced that no add-on wrote or that were changed since.
        note: Called with a sentence if another process is waited for.

    Returns:
        Whether anything was written; not if all is there already.

    Raises:
        OutputError: A file of the user would be replaced, one cannot be written, or the folder
            leads out of the project.
    """
    refuse_leading_out(folder, project, "the project; remove the link")
    tidy(folder, name, note)
    with Staging(folder, name, note, overwrite) as staging:
        entries = tuple(_staged(each.name, each.role, each.data, staging) for each in files)
        manifest = encode_manifest(_manifest(name, entries))
        marker = _staged(manifest_name(name), "manifest", manifest, staging)
        if all(entry.is_intact(folder) for entry in (*entries, marker)):
            return False
        commit(name, (*entries, marker), staging, _ADVICE)
    return True


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

"""The command ``init``: list the presets, or copy one."""

from argparse import Namespace
from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path

from fire_atlas.cli.progress import view_for
from fire_atlas.cli.text import printable
from fire_atlas.core.errors import OutputError, RecipeError
from fire_atlas.core.interruption import signals_wait
from fire_atlas.outputs.recovery import tidy
from fire_atlas.outputs.staging import Staging
from fire_atlas.recipe.inherit import presets
from fire_atlas.recipe.problem import did_you_mean
from fire_atlas.recipe.tree import RecipeTree, named_files, read_tree


def run(args: Namespace) -> int:
    """List the presets, or copy one with its sample input."""
    if args.preset is None:
        _list_presets()
        return 0
    recipe = _preset(args.preset)
    target = args.folder / recipe.name
    text, samples = _relocated(read_tree(recipe))
    files = {args.folder / name: sample.read_bytes() for name, sample in samples.items()}
    files[target] = text.encode()
    _refuse_overwriting(files)
    _write(files, args.quiet)
    if not args.quiet:
        files_of_input = f"{len(samples)} file{'s' if len(samples) > 1 else ''} of input"
        samples_too = f" and {files_of_input}" if samples else ""
        print(printable(f"wrote {target}{samples_too}"))
        print(printable(f"next: fire-atlas build {target}"))
    return 0


def _list_presets() -> None:
    width = max(map(len, presets()), default=0)
    for name, path in presets().items():
        print(printable(f"{name:{width}}  {_first_comment(path)}".rstrip()))


def _first_comment(path: Path) -> str:
    """Return the first comment of a recipe, which describes it."""
    lines = path.read_text(encoding="utf-8").splitlines()
    comments = (line.lstrip("# ") for line in lines if line.startswith("#"))
    return next((text for text in comments if not text.startswith("yaml-language-server")), "")


def _preset(name: str) -> Path:
    known = presets()
    if name not in known:
        near = did_you_mean(name, known) or f"; presets are {', '.join(known)}"
        raise RecipeError(f"there is no preset {name}{near}")
    return known[name]


def _relocated(tree: RecipeTree) -> tuple[str, dict[str, Path]]:
    """Return a preset's text with new paths to its inputs, and the input files by new path.

    Only the paths in the text are changed, so that its comments stay.
    """
    text = tree.path.read_text(encoding="utf-8")
    lines = text.splitlines(keepends=True)
    samples: dict[str, Path] = {}
    for key, source in named_files(tree).items():
        origin = tree.origin(key)
        if origin.file != tree.path:  # inherited: relative to the preset that states it
            continue
        stated = str(tree.value(key))
        lines[origin.line - 1] = _replaced(lines[origin.line - 1], stated, f"samples/{source.name}")
        samples |= {f"samples/{name}": path for name, path in _files_of(source).items()}
    return "".join(lines), samples


def _replaced(line: str, old: str, new: str) -> str:
    """Return ``line`` with ``new`` instead of ``old``; a comment after it keeps its column."""
    if f"{old} " in line:
        return line.replace(f"{old} ", f"{new} ".ljust(len(old) + 1), 1)
    return line.replace(old, new, 1)


def _files_of(source: Path) -> dict[str, Path]:
    """Return the files of a source by new name: one file, or those of a folder or a glob."""
    if source.is_dir():
        return {f"{source.name}/{path.name}": path for path in sorted(source.iterdir())}
    if source.is_file():
        return {source.name: source}
    return {path.name: path for path in sorted(source.parent.glob(source.name))}


def _refuse_overwriting(files: Mapping[Path, bytes]) -> None:
    """Raise if a file exists already and differs from the one to be written.

    ``files`` are contents by path, the recipe's last.
    """
    taken = [path for path, data in files.items() if path.exists() and not _holds(path, data)]
    if taken:
        raise OutputError(
            f"{taken[-1]}: exists already and differs; move it away, or name another folder: "
            f"fire-atlas init {[*files][-1].stem} DIR"
        )


def _write(files: Mapping[Path, bytes], quiet: bool) -> None:
    """Write those files that do not exist yet, all or none: all wait beside their places before the
    first is put there. The folder of the recipe, which is the last, comes last."""
    view, stagings = view_for(False, quiet, False), dict[Path, Staging]()
    name = [*files][-1].stem
    for folder in {path.parent for path in files}:
        tidy(folder, name, view.note)  # undoes the commit of one that was killed
    written = {path: data for path, data in files.items() if not path.exists()}
    with ExitStack() as stack:
        for path, data in written.items():
            view.begin(path)
            folder = path.parent
            if folder not in stagings:
                stagings[folder] = stack.enter_context(Staging(folder, name, view.note))
            with stagings[folder].open(path.name) as file:
                file.write(data)
        placed = list[Path]()
        _refuse_overwriting(files)  # one may have come meanwhile
        with signals_wait():
            try:
                for folder, staging in stagings.items():
                    staging.commit([])
                    placed += [path for path in written if path.parent == folder]
            except BaseException:
                for path in placed:
                    path.unlink(missing_ok=True)
                raise


def _holds(path: Path, data: bytes) -> bool:
    return path.is_file() and path.stat().st_size == len(data) and path.read_bytes() == data

"""The command ``init``: list the presets, copy one, or write a recipe for the user's own clip."""

import json
import os
import re
import textwrap
from argparse import Namespace
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

from fire_atlas.cli.progress import view_for
from fire_atlas.cli.text import printable
from fire_atlas.core.errors import OutputError, RecipeError
from fire_atlas.core.files import real
from fire_atlas.core.interruption import signals_wait
from fire_atlas.outputs.recovery import tidy
from fire_atlas.outputs.staging import Staging
from fire_atlas.recipe.inherit import instead_of, presets
from fire_atlas.recipe.tree import RecipeTree, is_recipe, named_files, nearest_name, read_tree
from fire_atlas.sources.listing import locate

if TYPE_CHECKING:
    from fire_atlas.pipeline.propose import Proposal


def run(args: Namespace) -> int:
    """List the presets; copy one with its sample input; or write a recipe for a user's frames."""
    if args.subject is None:
        _list_presets()
        return 0
    if _is_path(args.subject):
        files = _recipe_for(Path(args.subject), args)
    else:
        files = _copied(args.subject, args.folder)
    target = [*files][-1]
    _refuse_overwriting(files, args.subject)
    _write(files, args.subject, args.quiet)
    if not args.quiet:
        samples = len(files) - 1
        samples_too = f" and {samples} file{'s' if samples > 1 else ''} of input" if samples else ""
        print(printable(f"wrote {target}{samples_too}"))
        print(printable(f"next: fire-atlas build {target}"))
    return 0


def _is_path(subject: str) -> bool:
    """Return whether the subject is a path: it has a separator or an ending, or is there and no
    preset."""
    path = Path(subject)
    if path.suffix or {"/", os.sep} & {*subject}:
        return True
    return path.exists() and subject not in presets()


def _copied(preset: str, folder: Path) -> dict[Path, bytes]:
    """Return the files of a preset, the recipe last, by their new paths."""
    recipe = _preset(preset)
    text, samples = _relocated(read_tree(recipe))
    files = {folder / name: sample.read_bytes() for name, sample in samples.items()}
    return {**files, folder / recipe.name: text.encode()}


def _recipe_for(path: Path, args: Namespace) -> dict[Path, bytes]:
    """Return a recipe, by its path, for a clip, a picture or a folder of frames."""
    if is_recipe(path):
        raise RecipeError(f"{path}: is a recipe already; fire-atlas build {path} builds it")
    folder = real(path if path.is_dir() else path.parent)
    stem = "" if path.is_dir() else path.stem.rstrip("0123456789#*_-. ")
    target = args.folder / f"{nearest_name(stem or folder.name)}.yaml"
    source = Path(os.path.relpath(_sequence_of(path), args.folder)).as_posix()
    from fire_atlas.core.context import BuildOptions
    from fire_atlas.pipeline.propose import holds_sprites, propose, propose_sprites

    if holds_sprites(path, args.max_pixels):
        found, keys = propose_sprites(target, source), _keys_of_sprites(source)
    else:
        proposal = propose(target, source, BuildOptions.of(args.jobs, args.max_pixels))
        found, keys = proposal.found, _keys(source, proposal)
    if not args.quiet:
        for sentence in found:
            print(printable(f"{path}: {sentence}"))
    return {target: (_head(target.name, found) + keys).encode()}


def _sequence_of(path: Path) -> Path:
    """Return the pattern of the frames of which ``path`` is one, or ``path`` if it is none."""
    name = re.fullmatch(r"(?P<head>.*?)(?P<number>[0-9]+)(?P<ending>\.[^.]*)", path.name)
    if name is None or not path.is_file():
        return path
    pattern = path.with_name(f"{name['head']}{'#' * len(name['number'])}{name['ending']}")
    return pattern if len(locate(pattern).files) > 1 else path


def _head(name: str, found: Sequence[str]) -> str:
    """Return the comments of a recipe, with what was ``found``."""
    sentences = [
        textwrap.fill(printable(sentence), 98, initial_indent="# - ", subsequent_indent="#   ")
        for sentence in found
    ]
    return (
        f"# yaml-language-server: $schema=recipe.schema.json\n"
        f"# Build it: fire-atlas build {name}\n"
        f"# For help in editors: fire-atlas schema > recipe.schema.json\n"
        f"#\n"
        f"# What a build finds:\n{chr(10).join(sentences)}\n"
    )


def _quoted(path: str) -> str:
    """Return a path as YAML reads it."""
    return path if re.fullmatch(r"[\w./-]+", path) else json.dumps(path, ensure_ascii=False)


def _keys_of_sprites(source: str) -> str:
    """Return the keys of a recipe for sprites that users change first, at their defaults."""
    return (
        f"source:\n"
        f"  kind: sprites\n"
        f"  path: {_quoted(source)}\n"
        f"  names: path         # hud/close; stem: close; file: hud/close.png\n"
        f"  animations: auto    # coin_01, coin_02 are coin; none: all stand alone\n"
        f"atlas:\n"
        f"  max_size: 4096      # of a page, px\n"
        f"exports: [json]       # also godot, unity, phaser, css and others\n"
    )


def _keys(source: str, proposal: "Proposal") -> str:
    """Return the keys that users change first, set to what a build would choose anyway."""
    rate = f"  fps: {proposal.fps:g}\n" if proposal.assumes_rate else ""
    return (
        f"source:\n"
        f"  path: {_quoted(source)}\n"
        f"{rate}"
        f"  height: {proposal.height:<12}# of a frame, px\n"
        f"timeline:\n"
        f"  loop: auto          # or crossfade, pingpong; none plays once\n"
        f"flakes:\n"
        f"  rate: {proposal.flakes:<14g}# sparks born each second\n"
        f"exports: [json]       # also godot, unity, phaser, css and others\n"
    )


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
        raise RecipeError(f"there is no preset {name}{instead_of(name)}")
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


def _refuse_overwriting(files: Mapping[Path, bytes], subject: str) -> None:
    """Raise if a file exists already and differs from the one to be written.

    ``files`` are contents by path, the recipe's last; ``subject`` is what was asked for.
    """
    taken = [path for path, data in files.items() if path.exists() and not _holds(path, data)]
    if taken:
        raise OutputError(
            f"{taken[-1]}: exists already and differs; move it away, or name another folder: "
            f"fire-atlas init {subject} DIR"
        )


def _write(files: Mapping[Path, bytes], subject: str, quiet: bool) -> None:
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
        _refuse_overwriting(files, subject)  # one may have come meanwhile
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

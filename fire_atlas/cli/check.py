"""The command ``check``: validate recipes and look for their inputs."""

from argparse import Namespace
from collections.abc import Callable

from fire_atlas.cli.failure import Failures
from fire_atlas.cli.progress import view_for
from fire_atlas.cli.text import printable
from fire_atlas.core.errors import SourceError
from fire_atlas.outputs.dependencies import textures_of
from fire_atlas.outputs.folder import recover_default
from fire_atlas.pipeline.input.check import load_checked
from fire_atlas.recipe.find import find_recipes
from fire_atlas.recipe.load import LoadedRecipe, resolved_yaml
from fire_atlas.recipe.source import ClipInput, ProfileSource, SpritesSource
from fire_atlas.recipe.tree import read_tree
from fire_atlas.sources.listing import ALL_FRAMES, VIDEOS, list_inputs, locate
from fire_atlas.sources.sprite_names import sprites_of


def run(args: Namespace) -> int:
    """Check every recipe and that its inputs exist; return the highest exit code."""
    failures = Failures(args.verbose > 1)
    view = view_for(False, args.quiet, args.verbose > 0)
    with failures.caught():
        for path in find_recipes(args.recipes):
            with failures.caught():
                tree = read_tree(path, args.overrides)
                view.begin(path)
                recover_default(path, tree.name, view.note)
                loaded = load_checked(tree)
                _find_inputs(loaded, view.note)
                if args.resolved:
                    for line in resolved_yaml(loaded).removesuffix("\n").split("\n"):
                        print(printable(line))
                elif not args.quiet:
                    print(printable(f"{path}: ok"))
    return failures.worst_code


def _find_inputs(loaded: LoadedRecipe, note: Callable[[str], None]) -> None:
    for part in loaded.parts:
        _find_source(part, note)
    for path in loaded.templates.values():
        if not path.is_file():
            where = loaded.tree.origin(("exports",)).locate(("exports",))
            raise SourceError(f"{where}: there is no template {path}")


def _find_source(part: LoadedRecipe, note: Callable[[str], None]) -> None:
    """Look for the files of a source, and note what their names, or the headers of videos, tell."""
    source = part.recipe.source
    if isinstance(source, SpritesSource):
        _find_sprites(part, note)
        return
    used = source if isinstance(source, ClipInput) else ALL_FRAMES
    is_learnt = isinstance(source, ProfileSource)
    for key, path in part.source_files.items():
        try:
            file, *_ = list_inputs(
                used, path, is_clip=not (is_learnt and key == ("source", "path"))
            )
            notes = list(locate(path).notes(used))
            if file.suffix.lower() in VIDEOS:
                from fire_atlas.sources.video_stream import describe_video

                notes += describe_video(file)
            for text in notes:
                note(text)
        except SourceError as error:
            raise SourceError(f"{part.tree.origin(key).locate(key)}: {error}") from None
    textures_of(part.tree)


def _find_sprites(part: LoadedRecipe, note: Callable[[str], None]) -> None:
    """Look for sprites, their names and the room for their borders, and note what is nearly an
    animation."""
    key = ("source", "path")
    try:
        names = sprites_of(part)
        if any(file.sprite.border for file in names.files):
            from fire_atlas.sources.sprites import check_borders

            check_borders(part, names)
        for text in names.notes:
            note(text)
    except SourceError as error:
        raise SourceError(f"{part.tree.origin(key).locate(key)}: {error}") from None

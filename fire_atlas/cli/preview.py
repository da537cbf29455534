"""``fire-atlas preview``."""

from argparse import Namespace
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from PIL import ImageColor

from fire_atlas.cli.progress import shows_interruption, view_for
from fire_atlas.cli.text import printable
from fire_atlas.core.clip import Clip
from fire_atlas.core.errors import RecipeError
from fire_atlas.formats.atlas.texture_packer import read_atlas
from fire_atlas.formats.names import flakes_file
from fire_atlas.formats.tracks.tracks_json import read_all_tracks, read_tracks
from fire_atlas.outputs.disk import explained, temporary_folder, write_whole
from fire_atlas.outputs.folder import default_folder, recover_default
from fire_atlas.preview.page import preview_page
from fire_atlas.preview.pictures import Color, animated_image, contact_sheet

_SUFFIX = {"gif": ".gif", "webp": ".webp", "apng": ".png", "sheet": ".sheet.png"}


def run(args: Namespace) -> int:
    """Make the page or picture of a recipe, or of an atlas that is built already."""
    background = _color(args.background)
    with _atlas(args) as (path, clip):
        atlas = read_atlas(path)
        match args.kind:
            case "page":
                data = preview_page(atlas, read_all_tracks(atlas), background)
            case "sheet":
                tracks = read_tracks(path.with_name(flakes_file(path.stem, "json")))
                data = contact_sheet(atlas, tracks, clip, background)
            case _:
                data = animated_image(atlas, args.kind, background)
        target = args.out or _default_target(args, path.stem)
    write_whole(target, data)
    if not args.quiet:
        print(printable(f"{target}: {len(atlas.frames)} frames"))
    return 0


def _default_target(args: Namespace, name: str) -> Path:
    """Return the default path: pictures beside the recipe or atlas, a page beside the atlas."""
    if args.kind != "page":
        return Path(args.subject.with_name(f"{name}.preview{_SUFFIX[args.kind]}"))
    if not _is_recipe(args.subject):
        return Path(args.subject.with_name(f"{name}.preview.html"))
    folder = default_folder(args.subject)
    with explained(folder):
        folder.mkdir(exist_ok=True)
    return folder / f"{name}.preview.html"


def _color(text: str) -> Color:
    try:
        return ImageColor.getrgb(text)[:3]
    except ValueError:
        raise RecipeError(
            f'--background {text}: must be a colour like "#101014" or midnightblue'
        ) from None


def _is_recipe(path: Path) -> bool:
    return path.suffix in {".yaml", ".yml"}


@contextmanager
def _atlas(args: Namespace) -> Iterator[tuple[Path, Clip | None]]:
    """Yield the path of the atlas's JSON, and the clip of its source if that is known.

    The atlas of a recipe is built in a temporary folder.
    """
    if not _is_recipe(args.subject):
        if args.overrides:
            raise RecipeError("--set changes recipes; an atlas that is built stays as it is")
        yield args.subject, None
        return

    from fire_atlas.pipeline.build import build
    from fire_atlas.pipeline.check import load_checked
    from fire_atlas.pipeline.context import BuildOptions
    from fire_atlas.pipeline.open import open_alone
    from fire_atlas.recipe.tree import read_tree

    overrides = [*args.overrides, "exports=[json]", "tracks=[json]"]
    tree = read_tree(args.subject, overrides)
    view = view_for(json_lines=False, quiet=args.quiet, verbose=False)
    view.begin(args.subject)
    recover_default(args.subject, tree.name, view.note)
    loaded = load_checked(tree)
    with temporary_folder() as folder:
        try:
            with shows_interruption(view):
                options = BuildOptions.of(args.jobs, args.most_pixels)
                build(loaded, folder, options, view)
        finally:
            view.close()
        shown = open_alone(loaded, args.most_pixels) if not loaded.members else None
        clips = list(shown.values()) if isinstance(shown, Mapping) else []
        clip = clips[0] if len(clips) == 1 else None
        yield folder / f"{loaded.recipe.name}.json", clip

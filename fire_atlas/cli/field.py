"""Write pictures of how a recipe's fire is analysed: ``inspect --field``."""

from argparse import Namespace
from collections.abc import Callable, Iterator
from functools import partial

from fire_atlas.cli.progress import shows_interruption, view_for
from fire_atlas.cli.text import printable
from fire_atlas.core.errors import RecipeError
from fire_atlas.core.progress import StageTimer
from fire_atlas.core.workers import Workers
from fire_atlas.outputs.folder import default_folder
from fire_atlas.outputs.staging import Staging, refuse_existing
from fire_atlas.pipeline.check import load_checked
from fire_atlas.pipeline.context import BuildContext, BuildOptions
from fire_atlas.pipeline.inspect_field import InspectedAnimation, inspect_field
from fire_atlas.preview.field_marks import FieldLayer
from fire_atlas.preview.field_pictures import field_picture, frame_picture
from fire_atlas.recipe.tree import is_recipe, read_tree
from fire_atlas.vision.sampling import evenly_spread

_MAX_FRAMES = 12
"""Maximum number of frames of an animation that are drawn."""


def write_field_pictures(args: Namespace) -> int:
    """Write a PNG of each layer over some frames of a recipe's fire, and of the frames alone."""
    if not is_recipe(args.subject):
        raise RecipeError(f"{args.subject}: --field needs a recipe, like campfire.yaml")
    tree = read_tree(args.subject, args.overrides)
    out = args.out or default_folder(args.subject) / f"{tree.name}.field"
    loaded, options = load_checked(tree), BuildOptions.of(args.jobs, args.max_pixels)
    view = view_for(json_lines=False, quiet=args.quiet, verbose=False)
    view.begin(args.subject)
    count = 0
    with (
        shows_interruption(view),
        Workers(options.jobs) as workers,
        Staging(out, "field", view.note) as staging,
    ):
        try:
            context = BuildContext(workers, view, StageTimer(), options.max_pixels)
            for animation in inspect_field(loaded, context):
                staging.protect(animation.clip.inputs)
                pictures = dict(_pictures(animation, tree.name))
                if not args.overwrite:
                    refuse_existing(out / name for name in pictures)
                drawn = workers.map(lambda draw: draw(), pictures.values())
                for name, data in zip(pictures, drawn, strict=True):
                    with staging.open(name) as file:
                        file.write(data)
                count += len(pictures)
            with staging.folder_locked():
                staging.commit([])
        finally:
            view.close()
    if not args.quiet:
        print(printable(f"{out}: {count} pictures"))
    return 0


def _pictures(
    animation: InspectedAnimation, recipe: str
) -> Iterator[tuple[str, Callable[[], bytes]]]:
    """Yield the file name of each picture of an animation, and what draws it.

    Names begin with that of the animation where a recipe has several.
    """
    stem = "" if animation.name == recipe else f"{animation.name.replace('/', '.')}."
    for i in evenly_spread(0, animation.clip.count - 1, _MAX_FRAMES):
        for layer in (None, *animation.marks.longest):
            yield f"{stem}{i:04}.{layer or 'frame'}.png", partial(_drawn, animation, layer, i)


def _drawn(animation: InspectedAnimation, layer: FieldLayer | None, i: int) -> bytes:
    """Return the PNG of a layer, or of the frame alone."""
    frame, text = animation.under(layer, i), f"{animation.name}, frame {i}"
    if layer is None:
        return frame_picture(frame, text)
    return field_picture(layer, frame, animation.marks, i, text)

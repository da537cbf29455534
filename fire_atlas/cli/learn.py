"""The command ``learn``: learn a fire profile from a clip."""

from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from fire_atlas.cli.progress import view_for
from fire_atlas.cli.text import printable
from fire_atlas.core.errors import RecipeError
from fire_atlas.outputs.staging import Staging, refuse_existing
from fire_atlas.recipe.document import parse_override, stated_source
from fire_atlas.recipe.inherit import merge
from fire_atlas.recipe.load import LoadedRecipe, load_tree
from fire_atlas.recipe.source import ProfileSource
from fire_atlas.recipe.tree import RecipeTree

if TYPE_CHECKING:
    from fire_atlas.core.clip import Clip


def run(args: Namespace) -> int:
    """Learn a profile from a clip, and write it with its picture."""
    out = args.out or Path(f"{args.clip.stem}.profile.json")
    if out.suffix != ".json":
        raise RecipeError(f"-o {out}: a profile's name ends in .json, like {out.stem}.profile.json")
    picture = out.with_suffix(".png")
    if not args.overwrite:
        refuse_existing([out, picture])
    loaded = _as_recipe(args.clip, args.side, args.overrides)
    assert isinstance(loaded.recipe.source, ProfileSource), "_as_recipe makes one"
    for key in loaded.recipe.source.keys_of_generating():
        raise RecipeError(
            f"--set {key}: says how fire is generated, not how it is learnt; "
            f"set source.{key} in the recipe that names the profile"
        )

    from fire_atlas.core.workers import Workers
    from fire_atlas.generators.profile.file import write_profile
    from fire_atlas.generators.profile.learn.fitness import length_advice, size_advice
    from fire_atlas.preview.profile_picture import profile_picture
    from fire_atlas.sources.profile import learn_from_files
    from fire_atlas.sources.reader import OpeningContext

    view = view_for(False, args.quiet, args.verbose > 0)
    view.begin(out)
    with (
        Workers(args.jobs) as workers,
        Staging(out.parent, out.name, view.note) as staging,
    ):
        profile, clips = learn_from_files(
            loaded.recipe.source,
            tuple(loaded.source_files.values()),
            OpeningContext("srgb", workers, max_pixels=args.max_pixels),
        )
        for count in dict.fromkeys(clip.count for clip in clips):
            if advice := length_advice(count):
                view.note(advice)
        for path, side in zip(loaded.source_files.values(), profile.sides, strict=True):
            if advice := size_advice(side):
                view.note(f"{path}: {advice}")
        staging.protect([path for clip in clips for path in clip.inputs])
        written = {out: write_profile(profile), picture: profile_picture(profile, clips)}
        for path, data in written.items():
            with staging.open(path.name) as file:
                file.write(data)
        with staging.folder_locked():
            if not args.overwrite:  # one may have come meanwhile
                refuse_existing([out, picture])
            staging.commit([])
    if not args.quiet:
        count = sum(clip.count for clip in clips)
        rate = _assumed_rate(loaded.recipe.source, clips)
        print(printable(f"{out}: learnt from {count} frames{rate}"))
        print(printable(f"{picture}: picture of the profile"))
    return 0


def _assumed_rate(source: ProfileSource, clips: Sequence["Clip"]) -> str:
    """Return what to say of the frames' rate, of files that state none; nothing if it is known."""
    assumed = [clip for clip in clips if source.grid is not None or len(clip.inputs) > 1]
    if source.fps is not None or not assumed:
        return ""
    return f", {assumed[0].fps:g} frames a second assumed; say --set fps=N if it is another rate"


def _as_recipe(clip: Path, side: Path | None, overrides: Sequence[str]) -> LoadedRecipe:
    """Return a recipe that learns from ``clip``, with the keys of ``source`` in ``--set``."""
    source: dict[str, str] = {"kind": "profile", "path": str(clip.absolute())}
    if side is not None:
        source["side_path"] = str(side.absolute())
    document = stated_source(source)
    for text in overrides:
        document = merge(document, parse_override(f"source.{text}"))
    return load_tree(RecipeTree(Path("learn"), document.values, document.origins, ()))

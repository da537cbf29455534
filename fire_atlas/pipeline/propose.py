"""Look at frames of the user's own, and say what a build makes of them: for a first recipe."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from fire_atlas.core.context import BuildContext, BuildOptions
from fire_atlas.core.progress import SilentProgress, StageTimer
from fire_atlas.core.workers import Workers
from fire_atlas.pipeline.animation.classify import classify
from fire_atlas.pipeline.animation.prepare import prepare
from fire_atlas.pipeline.input.check import CheckedRecipe, load_checked
from fire_atlas.pipeline.input.open import open_input
from fire_atlas.recipe.document import stated_source
from fire_atlas.recipe.tree import RecipeTree
from fire_atlas.sources.images import read_header
from fire_atlas.sources.listing import list_sprites
from fire_atlas.sources.sprite_names import sprites_of

_MAX_NAMES = 12
"""Limit on the animations that a sentence names."""


@dataclass(frozen=True, slots=True)
class Proposal:
    """What a build finds and chooses if a recipe says nothing but where its frames are.

    Attributes:
        found: A sentence each about the frames: their number and size, the matte, the loop, the
            class of the fire.
        height: Height of the frames, px.
        fps: Frames per second.
        assumes_rate: Whether the files do not tell their rate.
        flakes: Flakes born each second.
    """

    found: tuple[str, ...]
    height: int
    fps: float
    assumes_rate: bool
    flakes: float


def propose(recipe: Path, source: str, options: BuildOptions) -> Proposal:
    """Return what a build of ``recipe``, which need not exist, would make of its frames.

    Args:
        recipe: The recipe file.
        source: Its ``source.path``.
        options: Of the build.

    Raises:
        FireAtlasError: The build would fail.
    """
    loaded = _loaded(recipe, {"path": source})
    notes = _Notes()
    with Workers(options.jobs) as workers:
        context = BuildContext(workers, notes, StageTimer(), options.max_pixels)
        opened = open_input(loaded, context)
        assert isinstance(opened, Mapping), "with flakes frames are one clip"
        (clip,) = opened.values()
        played, study = prepare(loaded.recipe, clip, True, context)
        flakes = classify(loaded.recipe, played, study, context).flakes
    is_numbered = len(clip.inputs) > 1
    frames = f"{clip.count} frames" if clip.count > 1 else "1 frame"
    assumed = ", as images are that do not say otherwise" if is_numbered else ""
    rate = f", {clip.fps:g} a second{assumed}" if clip.count > 1 else ""
    return Proposal(
        found=(f"{frames} of {clip.width} x {clip.height} px{rate}", *notes.sentences),
        height=clip.height,
        fps=clip.fps,
        assumes_rate=is_numbered,
        flakes=0.0 if flakes == "none" or flakes.rate == "auto" else float(f"{flakes.rate:.3g}"),
    )


def holds_sprites(path: Path, max_pixels: int) -> bool:
    """Return whether a folder holds pictures for packing alone, not the frames of one clip: of
    several sizes, or in folders of its own.

    Raises:
        SourceError: It cannot be searched, or a picture is broken or has more than ``max_pixels``.
    """
    if not path.is_dir():
        return False
    files = list_sprites([path])
    headers = (read_header(file, max_pixels) for file in files)
    sizes = {(header.width, header.height) for header in headers}
    return any(file.parent != path for file in files) or len(sizes) > 1


def propose_sprites(recipe: Path, source: str) -> tuple[str, ...]:
    """Return what a build of ``recipe``, which need not exist, finds among its sprites: a sentence
    each.

    Raises:
        FireAtlasError: The build would fail.
    """
    names = sprites_of(_loaded(recipe, {"kind": "sprites", "path": source}))
    played = [f"{name}, {len(frames)} frames" for name, frames in names.animations.items()]
    more = f" and {len(played) - _MAX_NAMES} more" if len(played) > _MAX_NAMES else ""
    animations = f"; animations: {'; '.join(played[:_MAX_NAMES])}{more}" if played else ""
    return (f"{len(names.files)} sprites{animations}", *names.notes)


def _loaded(recipe: Path, source: dict[str, str]) -> CheckedRecipe:
    """Return a recipe, which need not exist, that says nothing but its source."""
    document = stated_source(source)
    return load_checked(RecipeTree(recipe, document.values, document.origins, ()))


class _Notes(SilentProgress):
    """Keeps the notes of a build."""

    def __init__(self) -> None:
        self.sentences: list[str] = []

    def note(self, message: str) -> None:
        self.sentences.append(message)

"""Name sprites after their files, and find the animations among them.

``check`` does this too, so it must not import cv2, numpy or Pillow.
"""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from fire_atlas.core.errors import SourceError
from fire_atlas.core.files import natural_key
from fire_atlas.core.named_sprite import Border, NamedSprite
from fire_atlas.core.output_file import as_file_name, is_portable
from fire_atlas.recipe.load import LoadedRecipe
from fire_atlas.recipe.problem import Problem, did_you_mean
from fire_atlas.recipe.source import SpritesSource
from fire_atlas.recipe.validate import refusal
from fire_atlas.sources.listing import locate_sprites

NINE_PATCH = ".9"
"""What the stem of a picture ends with that has its border in its outermost px."""

_NUMBERED = re.compile(r"(?P<head>.*?)(?P<digits>[0-9]+)\)?", re.DOTALL)
"""The name of a sprite, without the ending of its file, that ends with a number."""

_BETWEEN = " _.-(/"
"""What may stand between the name of an animation and the numbers of its frames."""

_MOST_MISSING = 1 / 3
"""Share of the numbers that may lack for a note that they are no animation."""


@dataclass(frozen=True, slots=True)
class SpriteFile:
    """The file of a sprite.

    Attributes:
        path: The file.
        sprite: What the sprite has of its own, but for a border that is drawn in the picture.
    """

    path: Path
    sprite: NamedSprite

    @property
    def draws_border(self) -> bool:
        """Whether the border is drawn in the picture."""
        return self.path.stem.endswith(NINE_PATCH)


@dataclass(frozen=True, slots=True)
class SpriteList:
    """The sprites of a recipe.

    Attributes:
        files: Every sprite, in natural order of the names.
        paths: Their files, each once, in the order of ``list_sprites``.
        animations: By name of the animation, the numbers of its frames in playing order.
        notes: Which names are nearly an animation, for the user.
    """

    files: tuple[SpriteFile, ...]
    paths: tuple[Path, ...]
    animations: Mapping[str, tuple[int, ...]]
    notes: tuple[str, ...]

    @property
    def played(self) -> tuple[int, ...]:
        """The numbers of the sprites that belong to an animation, as these are played."""
        return tuple(i for frames in self.animations.values() for i in frames)

    @property
    def single(self) -> tuple[int, ...]:
        """The numbers of the sprites that belong to no animation."""
        played = set(self.played)
        return tuple(i for i in range(len(self.files)) if i not in played)

    def names(self, numbers: Iterable[int]) -> list[str]:
        """Return the names of the sprites with these ``numbers``."""
        return [self.files[i].sprite.name for i in numbers]


def sprites_source(loaded: LoadedRecipe) -> SpritesSource:
    """Return the source of a recipe that packs sprites."""
    assert isinstance(loaded.recipe.source, SpritesSource), "another source has no sprites"
    return loaded.recipe.source


def sprites_of(loaded: LoadedRecipe) -> SpriteList:
    """Return the sprites of a recipe, whose keys name them as they are.

    Raises:
        SourceError: There are none at a path, or two have one name.
        RecipeError: A key names none, or states what it cannot have.
    """
    source = sprites_source(loaded)
    sprites = _listed(source, loaded.source_files.values(), loaded.recipe.name)
    if problems := list(_problems(source, sprites, may_rotate=loaded.recipe.atlas.rotate)):
        raise refusal(loaded.tree, problems)
    return sprites


def _listed(source: SpritesSource, paths: Iterable[Path], recipe: str) -> SpriteList:
    """Return the sprites at ``paths``; an animation of mere numbers is called as the recipe."""
    named, spelt = dict[str, Path](), dict[str, str]()
    for located in map(locate_sprites, paths):
        for file in located.files:
            name = _name(file.relative_to(located.base), source.names)
            _refuse_unportable(file, name)
            other = spelt.setdefault(as_file_name(name), name)
            if named.setdefault(other, file) != file:
                raise SourceError(_two(named[other], file, other, name, source.names))
    names = sorted(named, key=lambda name: natural_key(Path(name)))
    stems = [name.removesuffix(named[name].suffix) if source.names == "file" else name
             for name in names]  # fmt: skip
    animations, notes = dict[str, tuple[int, ...]](), list[str]()
    if source.animations == "auto":
        animations, notes = _animations(stems, recipe)
    animation_of = {i: name for name, frames in animations.items() for i in frames}
    files = tuple(
        SpriteFile(named[name], _sprite(source, name, animation_of.get(i)))
        for i, name in enumerate(names)
    )
    return SpriteList(files, tuple(dict.fromkeys(named.values())), animations, tuple(notes))


def _sprite(source: SpritesSource, name: str, animation: str | None) -> NamedSprite:
    """Return a sprite with what the recipe states for its name, or for its animation's."""
    keys = (name,) if animation is None else (name, animation)
    pivot = next((source.pivots[key] for key in keys if key in source.pivots), None)
    border = next((source.borders[key] for key in keys if key in source.borders), None)
    return NamedSprite(name, pivot, None if border is None else Border(*border))


def _name(file: Path, names: str) -> str:
    """Return what a sprite is called whose ``file`` is relative to the folder of its path."""
    if names == "file":
        return file.as_posix()
    stem = file.stem.removesuffix(NINE_PATCH)
    return stem if names == "stem" else file.with_name(stem).as_posix()


def _two(one: Path, other: Path, name: str, other_name: str, names: str) -> str:
    """Return why two files cannot be packed together, and what would let them."""
    remedy = {
        "path": "names: file, the folder above both as path, or another name for one of them",
        "stem": "names: path, or another name for one of them",
        "file": "the folder above both as path, or another name for one of them",
    }[names]
    where = "" if name == other_name else ", which is one with the other's on Windows and macOS"
    return f"{one} and {other} would both be called {other_name}{where}: use {remedy}"


def _refuse_unportable(file: Path, name: str) -> None:
    parts = PurePosixPath(name).parts
    if ";" in name or not all(map(is_portable, parts)):
        raise SourceError(
            f"{file}: its name has characters that engines or other systems do not allow in one; "
            f"rename it, with letters, digits, spaces, `_`, `-` and `.`"
        )


def _animations(names: Sequence[str], recipe: str) -> tuple[dict[str, tuple[int, ...]], list[str]]:
    """Return the animations among sprites by name, and notes on those that lack numbers."""
    groups = dict[str, list[tuple[int, int]]]()
    for i, name in enumerate(names):
        if found := _NUMBERED.fullmatch(name.removesuffix(NINE_PATCH)):
            groups.setdefault(found["head"], []).append((int(found["digits"]), i))
    animations, notes, heads = dict[str, tuple[int, ...]](), list[str](), dict[str, str]()
    for head, frames in groups.items():
        numbers = [number for number, _ in sorted(frames)]
        if len(numbers) < 2 or numbers[0] > 1:
            continue
        if numbers != list(range(numbers[0], numbers[0] + len(numbers))):
            notes += _gap(names, sorted(frames))
            continue
        title = head.rstrip(_BETWEEN) or recipe
        other = heads.setdefault(as_file_name(title), head)
        if other != head:
            raise SourceError(
                f"{other}... and {head}... would both be the animation {title}; rename the files "
                f"of one, or set source.animations: none"
            )
        animations[title] = tuple(i for _, i in sorted(frames))
    return animations, notes


def _gap(names: Sequence[str], frames: Sequence[tuple[int, int]]) -> Iterator[str]:
    """Yield a note on numbered sprites that are nearly an animation."""
    numbers = [number for number, _ in frames]
    missing = sorted(set(range(numbers[0], numbers[-1] + 1)) - set(numbers))
    if missing and len(missing) <= _MOST_MISSING * len(numbers):
        first, last = names[frames[0][1]], names[frames[-1][1]]
        shown = ", ".join(map(str, missing[:5])) + (", ..." if len(missing) > 5 else "")
        yield f"{first} to {last} are no animation, as number {shown} is missing"


def _problems(source: SpritesSource, sprites: SpriteList, *, may_rotate: bool) -> Iterator[Problem]:
    """Yield a problem for each key of a source that names no sprite of it, or one that cannot have
    what it states; ``may_rotate``: whether frames may lie rotated on pages."""
    known = {file.sprite.name for file in sprites.files}
    for name in source.rates:
        if name not in sprites.animations:
            near = did_you_mean(name, sprites.animations)
            near = near or f"; there are {', '.join(list(sprites.animations)[:10]) or 'none'}"
            yield Problem(("source", "rates", name), f"there is no such animation{near}")
    for key, stated in (("pivots", source.pivots), ("borders", source.borders)):
        for name in stated:
            if name not in known and name not in sprites.animations:
                near = did_you_mean(name, [*sorted(known), *sprites.animations])
                yield Problem(("source", key, name), f"there is no such sprite or animation{near}")
    for file in sprites.files:
        sprite = file.sprite
        if sprite.border is not None and file.draws_border:
            yield Problem(
                ("source", "borders"),
                f"{sprite.name} has its border in its picture, {file.path.name}; remove it here",
            )
        if may_rotate and (sprite.border is not None or file.draws_border):
            yield Problem(
                ("atlas", "rotate"),
                f"{sprite.name} has a border, and clients stretch no nine-patch that lies rotated; "
                f"leave it out",
            )
            return

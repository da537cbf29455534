"""Read the JSON that describes an atlas: its pages, where frames lie, and its animations.

Understood are the files of TexturePacker (hash and array, one pack or several), Aseprite, PixiJS,
Phaser (several textures) and of this tool, which are variants of one format. They may come from
anywhere, so every value is checked as it is read.

Up-to-date builds import this module too, so it must not import cv2, numpy or Pillow.
"""

import json
import os
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from itertools import chain
from pathlib import Path, PureWindowsPath
from typing import Any, Literal, TypeAlias, cast

from fire_atlas.core.errors import SourceError
from fire_atlas.core.file_kinds import misnamed
from fire_atlas.core.files import MAX_JSON_BYTES, natural_key, read_file
from fire_atlas.core.workload import MAX_FRAMES
from fire_atlas.recipe.problem import did_you_mean

_MAX_PACKS = 1000
"""Limit on the pages of an atlas."""

_MAX_SIDE = 1 << 15
"""Limit on a length or a coordinate, px: twice the longest side of an image."""

_MAX_TEXT = 1000
"""Limit on the length of a name, characters."""

_MIN_DURATION, _MAX_DURATION = 1, 600_000
"""Limits on how long a frame is shown, ms."""

_MAX_LISTED = 20
"""At most so many names of animations are listed in a message."""

Coverage: TypeAlias = Literal["straight", "premultiplied"]


@dataclass(frozen=True, slots=True)
class AtlasPage:
    """An image of an atlas.

    Attributes:
        image: The file.
        size: Its width and height, px, as the JSON states them; None if it does not.
        alpha: How its coverage is stored.
        blend_space: If it is premultiplied, the encoding in which colours were multiplied:
            ``srgb``, or ``linear``.
    """

    image: Path
    size: tuple[int, int] | None
    alpha: Coverage = "straight"
    blend_space: str = "srgb"


@dataclass(frozen=True, slots=True)
class AtlasFrame:
    """Where a frame lies on its page. All sizes are those of the upright frame, px.

    Attributes:
        name: As the JSON calls it.
        page: Its page.
        x, y: Top-left corner on the page.
        width, height: Size of the part of the frame that is stored.
        rotated: Whether it is stored turned by 90° clockwise: ``height`` wide, ``width`` high.
        trim_x, trim_y: Place of the stored part in the whole frame.
        full_width, full_height: Size of the whole frame.
        duration: How long it is shown, s; None if the JSON does not say.
        anchor: Its pivot, as parts of the whole frame's size; None if it has none.
    """

    name: str
    page: AtlasPage
    x: int
    y: int
    width: int
    height: int
    rotated: bool
    trim_x: int
    trim_y: int
    full_width: int
    full_height: int
    duration: Fraction | None
    anchor: tuple[float, float] | None


@dataclass(frozen=True, slots=True)
class AtlasAnimation:
    """One animation of an atlas.

    Attributes:
        frames: What it plays, in order; a frame that it plays twice is in it twice.
        fps: Frames per second that the JSON states; None if it states none.
        files: All files of the atlas: the JSON, those of further packs, then the images.
        notes: What was decided about it, for the user.
    """

    frames: tuple[AtlasFrame, ...]
    fps: float | None
    files: tuple[Path, ...]
    notes: tuple[str, ...]


def is_atlas(path: Path) -> bool:
    """Return whether a file is the JSON of an atlas, by its name."""
    return path.suffix.lower() == ".json"


def atlas_files(path: Path) -> tuple[Path, ...]:
    """Return all files of the atlas that the JSON at ``path`` describes: ``AtlasAnimation.files``.

    Raises:
        SourceError: The JSON is unreadable or malformed, or names a file that is missing, or
            outside of its folder.
    """
    return _files_of(_read_packs(path))


def describes(path: Path, image: Path) -> bool:
    """Return whether there is a JSON of an atlas at ``path`` that has ``image`` as a page."""
    with suppress(SourceError):
        return path.is_file() and image in atlas_files(path)
    return False


def read_animation(path: Path, wanted: str | None) -> AtlasAnimation:
    """Read an animation of the atlas that the JSON at ``path`` describes.

    Args:
        path: The JSON.
        wanted: Name of the animation or tag. None for the only one, or for all frames, in the
            natural order of their names, where the JSON names none.

    Raises:
        SourceError: The JSON is unreadable, malformed or too large; a frame or a file is stated
            that cannot be; its pages hold no colours; or it is not clear which animation is meant.
    """
    packs = _read_packs(path)
    frames = [tuple(_frames_of(pack)) for pack in packs]
    count = sum(map(len, frames))
    if not 0 < count <= MAX_FRAMES:
        limit = "there must be one" if not count else f"at most {MAX_FRAMES} are allowed"
        raise SourceError(f"{path}: describes {count} frames; {limit}")
    name = _choose(path, dict.fromkeys(chain(*(pack.animations for pack in packs))), wanted)
    if name is None:
        # Lists too are mostly in the order in which a packer placed the frames, large ones first.
        played = sorted(chain(*frames), key=lambda frame: natural_key(Path(frame.name)))
    else:
        played = _play(path, name, packs, frames)
    notes = list[str]()
    left = count - len(set(played))
    if wanted is None and left:
        notes.append(f"{left} of its {count} frames are left out: '{name}' does not play them")
    if len({frame.anchor for frame in played}) > 1:
        notes.append("its frames have different anchors, which move nothing here")
    return AtlasAnimation(tuple(played), _stated_rate(packs, name), _files_of(packs), tuple(notes))


def _files_of(packs: Sequence["_Pack"]) -> tuple[Path, ...]:
    files = [*(pack.file for pack in packs), *(pack.image for pack in packs)]
    return tuple(dict.fromkeys(files))


def _choose(path: Path, names: Collection[str], wanted: str | None) -> str | None:
    """Return the name of the animation that is meant; None if there is none, and all frames are."""
    if wanted is None and len(names) < 2:
        return next(iter(names), None)
    listed = ", ".join(list(names)[:_MAX_LISTED])
    if len(names) > _MAX_LISTED:
        listed += f" and {len(names) - _MAX_LISTED} more"
    if wanted is None:
        raise SourceError(
            f"is missing: {path} holds {len(names)} animations; name one of them: {listed}",
            key=("source", "animation"),
        )
    if not names:
        raise SourceError(
            f"cannot be chosen: {path} names no animations; leave it out to use all of its frames",
            key=("source", "animation"),
        )
    if wanted not in names:
        raise SourceError(
            f"{path} has no animation '{wanted}'{did_you_mean(wanted, names)} (it can be {listed})",
            key=("source", "animation"),
        )
    return wanted


@dataclass(frozen=True, slots=True)
class _Value:
    """A value of a JSON file that is checked as it is read.

    Attributes:
        file: The file.
        where: Its keys, for messages: ``frame 'fire 0': frame.x``.
        value: What the file has there; None if nothing.
    """

    file: Path
    where: str
    value: Any

    def __getitem__(self, key: str) -> "_Value":
        """Return the value of ``key`` of this block."""
        between = "" if not self.where else ": " if self.where.endswith("'") else "."
        return _Value(self.file, f"{self.where}{between}{key}", self.block().get(key))

    def refuse(self, what: str) -> SourceError:
        """Return the error that says which value is wrong, and that it must be ``what``."""
        where = self.where or "the whole file"
        match self.value:
            case None:
                return SourceError(f"{self.file}: {where} is missing; it must be {what}")
            case dict():
                shown = "a block"
            case list():
                shown = f"a list of {len(self.value)}"
            case str():
                shown = f"'{self.value[:37]}...'" if len(self.value) > 40 else f"'{self.value}'"
            case _:
                shown = json.dumps(self.value)[:40]
        return SourceError(f"{self.file}: {where} must be {what}; it is {shown}")

    def block(self) -> Mapping[str, Any]:
        if not isinstance(self.value, dict):
            raise self.refuse("a block {...}")
        return self.value

    def entries(self) -> "list[_Value]":
        if not isinstance(self.value, list):
            raise self.refuse("a list [...]")
        return [_Value(self.file, f"{self.where}[{i}]", item) for i, item in enumerate(self.value)]

    def text(self) -> str:
        if not isinstance(self.value, str) or not self.value or len(self.value) > _MAX_TEXT:
            raise self.refuse(f"text of 1 to {_MAX_TEXT} characters")
        return self.value

    def number(self, low: float, high: float) -> float:
        is_number = isinstance(self.value, int | float) and not isinstance(self.value, bool)
        if not (is_number and low <= self.value <= high):
            raise self.refuse(f"a number from {low} to {high}")
        return cast(float, self.value)

    def whole(self, low: int = 0, high: int = _MAX_SIDE) -> int:
        number = self.number(low, high)
        if number != int(number):
            raise self.refuse("a whole number of px")
        return int(number)

    def one_of(self, *choices: str) -> str:
        if self.value not in choices:
            raise self.refuse(f"one of {', '.join(choices)}")
        return cast(str, self.value)

    def neighbour(self) -> Path:
        """Return the file of this name in the file's folder, or in a folder there."""
        name = self.text()
        windows = PureWindowsPath(name)
        is_elsewhere = windows.anchor or ".." in windows.parts or "\\" in name
        if is_elsewhere or not name.isprintable():  # as lone surrogates are not
            raise self.refuse(f"the name of a file beside {self.file.name}, without a path")
        path = self.file.parent / name
        if not os.path.exists(path):  # noqa: PTH110 - of a name that is too long, Path raises
            raise SourceError(
                f"{self.file}: {self.where} is '{name}', but there is no such file beside it; put "
                f"it there, or correct its name"
            )
        return path


@dataclass(frozen=True, slots=True)
class _Pack:
    """What a JSON says of one image.

    Attributes:
        file: The JSON.
        about: The block that names the image: ``meta``, or an entry of ``textures``.
        meta: The block ``meta``; empty if the JSON has none.
        frames: A block of frames by their names, or a list of them.
        animations: By name, the value that says what each plays: a list of names (``animations``),
            or a block of Aseprite's ``frameTags`` or Phaser's ``anims``.
    """

    file: Path
    about: _Value
    meta: _Value
    frames: _Value
    animations: Mapping[str, _Value]

    @property
    def image(self) -> Path:
        return self.about["image"].neighbour()


def _read_packs(path: Path) -> list[_Pack]:
    """Read a JSON, and those of the further packs that it names."""
    document = _read(path)
    packs = list(_packs_of(document))
    further = document["meta"]["related_multi_packs"] if "meta" in document.block() else None
    if further is not None and further.value is not None:
        files = dict.fromkeys(name.neighbour() for name in further.entries()[:_MAX_PACKS])
        for file in files:
            if file != path:
                packs += _packs_of(_read(file))
    if len(packs) > _MAX_PACKS:
        raise SourceError(f"{path}: has {len(packs)} pages; at most {_MAX_PACKS} are allowed")
    return packs


def _read(path: Path) -> _Value:
    try:
        data = read_file(path, MAX_JSON_BYTES)
    except OSError as error:
        raise SourceError(f"{path}: cannot be read ({error.strerror})") from error
    if data and (what := misnamed(data[:64], may_be_json=True)):
        raise SourceError(f"{path}: is {what}")
    try:
        return _Value(path, "", json.loads(data))
    except json.JSONDecodeError as error:
        raise SourceError(
            f"{path}: line {error.lineno}, column {error.colno}: is not JSON ({error.msg}); export "
            f"it again"
        ) from error
    except (ValueError, RecursionError) as error:
        raise SourceError(f"{path}: is not JSON ({error}); export it again") from error


def _packs_of(document: _Value) -> Iterator[_Pack]:
    """Yield the packs in one JSON: one, or one for each of Phaser's ``textures``."""
    file = document.file
    keys = document.value if isinstance(document.value, dict) else {}
    meta = document["meta"] if "meta" in keys else _Value(file, "meta", {})
    if "textures" in keys:
        animations = dict(_animations_of(document))
        for texture in document["textures"].entries()[: _MAX_PACKS + 1]:
            yield _Pack(file, texture, meta, texture["frames"], animations)
    elif "frames" in keys:
        yield _Pack(file, meta, meta, document["frames"], dict(_animations_of(document)))
    else:
        kind = keys.get("format")
        other = f" (it is a file of {kind})" if isinstance(kind, str) else ""
        raise SourceError(
            f"{file}: describes no atlas{other}: it has neither frames nor textures; give the JSON "
            f"that TexturePacker, Aseprite or fire-atlas wrote beside a sheet, or the image itself"
        )


def _animations_of(document: _Value) -> Iterator[tuple[str, _Value]]:
    """Yield the animations that a JSON names, and what says which frames each plays."""
    known = set[str]()
    keys = document.block()
    if "animations" in keys:
        for name in document["animations"].block():
            known.add(name)
            yield name, document["animations"][name]
    if "anims" in keys:
        for entry in document["anims"].entries():
            known.add(entry["key"].text())
            yield entry["key"].text(), entry
    tags = document["meta"]["frameTags"] if "meta" in keys else None
    if tags is not None and tags.value is not None:
        tagged = set[str]()
        for tag in tags.entries():
            name = tag["name"].text()
            if name in tagged:
                raise SourceError(f"{tag.file}: two tags are called '{name}'; rename one of them")
            tagged.add(name)
            if name not in known:
                yield name, tag


def _frames_of(pack: _Pack) -> Iterator[AtlasFrame]:
    """Yield the frames of a pack, in the order of its JSON."""
    page, entries = _page_of(pack), pack.frames
    if isinstance(entries.value, list):
        named = ((entry["filename"].text(), entry) for entry in entries.entries())
    else:
        named = ((name, entries[name]) for name in entries.block())
    if len(entries.value) > MAX_FRAMES:
        raise SourceError(
            f"{pack.file}: describes {len(entries.value)} frames; at most {MAX_FRAMES} are allowed"
        )
    for name, entry in named:
        frame = _Value(pack.file, f"frame '{name}'", entry.value)
        if "vertices" in frame.block() and pack.meta["fireAtlas"].value is None:
            raise SourceError(
                f"{pack.file}: frame '{name}' is packed as a polygon, whose box may show parts of "
                f"other frames; export it again with rectangles (trim mode Trim)"
            )
        yield _frame_of(frame, name, page)


def _page_of(pack: _Pack) -> AtlasPage:
    size = pack.about["size"]
    listed_size = None if size.value is None else (size["w"].whole(1), size["h"].whole(1))
    own = pack.meta["fireAtlas"]
    if own.value is None:
        return AtlasPage(pack.image, listed_size)
    advice = "build it with {} to use its frames"
    if own.block().get("heat") is not None:
        raise SourceError(
            f"{pack.file}: its pages hold heat, not colours; {advice.format('atlas.pixels: color')}"
        )
    alpha = own["alpha"].one_of("straight", "premultiplied", "additive")
    if alpha == "additive":
        raise SourceError(
            f"{pack.file}: its pages are light without coverage (atlas.alpha: additive); "
            f"{advice.format('atlas.alpha: straight')}"
        )
    space = own["blendSpace"].one_of("srgb", "linear")
    return AtlasPage(pack.image, listed_size, cast(Coverage, alpha), space)


def _frame_of(entry: _Value, name: str, page: AtlasPage) -> AtlasFrame:
    if len(name) > _MAX_TEXT:
        raise SourceError(f"{entry.file}: the name of a frame has {len(name)} characters")
    place, keys = entry["frame"], entry.block()
    width, height = place["w"].whole(1), place["h"].whole(1)
    is_trimmed = keys.get("trimmed") is not False
    full, trim = entry["sourceSize"], entry["spriteSourceSize"]
    full_width, full_height, trim_x, trim_y = width, height, 0, 0
    if is_trimmed and full.value is not None:
        full_width, full_height = full["w"].whole(1), full["h"].whole(1)
    if is_trimmed and trim.value is not None:
        trim_x, trim_y = trim["x"].whole(), trim["y"].whole()
    if trim_x + width > full_width or trim_y + height > full_height:
        raise SourceError(
            f"{entry.file}: frame '{name}': its {width}x{height} px at ({trim_x}, {trim_y}) "
            f"(spriteSourceSize) do not lie within {full_width}x{full_height} (sourceSize)"
        )
    duration, anchor = entry["duration"], entry["anchor"]
    return AtlasFrame(
        name=name,
        page=page,
        x=place["x"].whole(),
        y=place["y"].whole(),
        width=width,
        height=height,
        rotated=bool(keys.get("rotated")),
        trim_x=trim_x,
        trim_y=trim_y,
        full_width=full_width,
        full_height=full_height,
        duration=None if duration.value is None else _seconds(duration),
        anchor=None
        if anchor.value is None
        else (anchor["x"].number(-1000, 1000), anchor["y"].number(-1000, 1000)),
    )


def _seconds(duration: _Value) -> Fraction:
    """Return a duration in ms, with up to three decimals, as s."""
    milliseconds = duration.number(_MIN_DURATION, _MAX_DURATION)
    return Fraction(milliseconds).limit_denominator(1000) / 1000


def _play(
    path: Path, name: str, packs: Sequence[_Pack], frames: Sequence[Sequence[AtlasFrame]]
) -> list[AtlasFrame]:
    """Return what the animation ``name`` plays, in order.

    Of an animation on several pages each pack lists a part, or all. The frames of parts are joined
    in the natural order of their names.
    """
    named = dict[str, list[AtlasFrame]]()
    for frame in chain(*frames):
        named.setdefault(frame.name, []).append(frame)
    parts = dict[tuple[AtlasFrame, ...], None]()
    for pack, own in zip(packs, frames, strict=True):
        if (entry := pack.animations.get(name)) is not None:
            is_tag = isinstance(entry.value, dict) and "from" in entry.value
            part = _play_tag(entry, own) if is_tag else list(_look_up(entry, named))
            parts[tuple(part)] = None
    if len(parts) == 1:
        (played,) = parts
        return list(played)
    joined = list(dict.fromkeys(chain(*parts)))
    return sorted(joined, key=lambda frame: natural_key(Path(frame.name)))


def _look_up(animation: _Value, named: Mapping[str, Sequence[AtlasFrame]]) -> Iterator[AtlasFrame]:
    """Yield the frames whose names an entry of ``animations`` or of ``anims`` lists."""
    if isinstance(animation.value, dict):
        names = [entry["frame"] for entry in animation["frames"].entries()]
    else:
        names = animation.entries()
    if not 0 < len(names) <= MAX_FRAMES:
        raise animation.refuse(f"a list of 1 to {MAX_FRAMES} frames")
    for name in names:
        found = named.get(name.text(), ())
        if len(found) != 1:
            which = "no frame" if not found else f"{len(found)} frames"
            raise SourceError(
                f"{name.file}: {name.where} is '{name.text()}', but {which} of the atlas "
                f"{'are' if found else 'is'} called so; export it again"
            )
        yield found[0]


def _play_tag(tag: _Value, frames: Sequence[AtlasFrame]) -> list[AtlasFrame]:
    """Return what one of Aseprite's tags plays: one round, or as many passes as it repeats.

    A pass of ``pingpong`` runs the other way than the one before it, and begins with the frame
    after the one in which that ended.
    """
    first, last = tag["from"].whole(), tag["to"].whole()
    if not first <= last < len(frames):
        raise SourceError(
            f"{tag.file}: tag '{tag['name'].text()}' plays frames {first} to {last}, but there are "
            f"{len(frames)}, counted from 0; export it again, layers not split"
        )
    way = (
        "forward"
        if tag["direction"].value is None
        else tag["direction"].one_of("forward", "reverse", "pingpong", "pingpong_reverse")
    )
    ahead = list(frames[first : last + 1])
    if way.endswith("reverse"):
        ahead.reverse()
    back = ahead[-2::-1]
    if tag["repeat"].value is None:
        return ahead + back[:-1] if way.startswith("pingpong") else ahead
    passes = _passes(tag["repeat"])
    if passes * len(ahead) > MAX_FRAMES:
        raise SourceError(
            f"{tag.file}: tag '{tag['name'].text()}' plays {len(ahead)} frames {passes} times; at "
            f"most {MAX_FRAMES} frames are allowed"
        )
    if not way.startswith("pingpong"):
        return ahead * passes
    played, forth = ahead, ahead[1:]
    return played + [frame for i in range(1, passes) for frame in (back if i % 2 else forth)]


def _passes(repeat: _Value) -> int:
    """Return how often a tag plays; Aseprite writes it as text."""
    value = repeat.value
    if isinstance(value, str) and value.isascii() and value.isdigit() and len(value) < 10:
        value = int(value)
    return _Value(repeat.file, repeat.where, value).whole(1, 2**31)


def _stated_rate(packs: Sequence[_Pack], name: str | None) -> float | None:
    """Return the frames per second that the JSON states, of its own or of one of Phaser's
    animations."""
    own = packs[0].meta["fireAtlas"]
    rate = _Value(own.file, own.where, own.value or {})["fps"]
    if rate.value is None and name is not None:
        for entry in (pack.animations[name] for pack in packs if name in pack.animations):
            if isinstance(entry.value, dict):
                rate = entry["frameRate"]
    return None if rate.value is None else rate.number(0.01, 1000)

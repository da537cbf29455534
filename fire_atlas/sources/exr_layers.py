"""Choose which picture of an EXR file is read: one of its layers, in one of its parts.

A channel ``ViewLayer.Combined.R`` is R of the layer ``ViewLayer.Combined``; one without a dot is of
the layer without a name. A part has a name as well, and holds layers of its own.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

from fire_atlas.core.errors import SourceError
from fire_atlas.recipe.problem import did_you_mean
from fire_atlas.sources.exr_header import Part

_BEAUTY = ("combined", "rgba", "rgb", "c", "beauty", "color", "colour")
"""Last words of the names by which renderers call the finished picture among its layers."""

_LISTED = 12


class Kind(Enum):
    """What the channels of a layer are."""

    COLOUR = ("r", "g", "b")
    COLOUR_IN_WORDS = ("red", "green", "blue")
    LUMA_CHROMA = ("y", "ry", "by")
    GREY = ("y",)


@dataclass(frozen=True, slots=True)
class Layer:
    """A layer that is a picture.

    Attributes:
        part: Number of its part.
        name: What ``source.layer`` calls it; "" for that without a name in a file of one part.
        is_plain: Whether its channels have no layer in their names.
        kind: What ``channels`` are.
        channels: Names in the file: red, green, blue; luminance and two of chroma; or luminance.
        alpha: Name of its coverage; None if it has none.
    """

    part: int
    name: str
    is_plain: bool
    kind: Kind
    channels: tuple[str, ...]
    alpha: str | None


def choose_layer(
    path: Path, parts: Sequence[Part], wanted: str | None
) -> tuple[Layer, tuple[str, ...]]:
    """Return the layer to read, and notes on the choice, if there was one.

    Args:
        path: The file, for messages.
        parts: All of the file.
        wanted: Name of a layer, or of a part that holds one picture; None for the finished picture.

    Raises:
        SourceError: There is no such layer, or several may be meant; it lists those there are.
    """
    pictures = [layer for number, part in enumerate(parts) for layer in _pictures(number, part)]
    flat = [layer for layer in pictures if not parts[layer.part].is_deep]
    if wanted is not None:
        return _named(path, parts, pictures, wanted), ()
    if not flat:
        raise SourceError(f"{path}: {_without_pictures(parts)}")
    layer = _finished_picture(parts, flat)
    names = [picture.name for picture in flat if picture.name]
    if layer is None:
        raise SourceError(
            f"{path}: holds several pictures, and none is plainly the finished one; say which: "
            f"source.layer: {_proposed(flat)}, of {_some(names)}"
        )
    others = [picture.name for picture in flat if picture.name and picture is not layer]
    if not others:
        return layer, ()
    taken = layer.name or f"without a name ({', '.join(layer.channels)})"
    return layer, (f"its layer {taken} is used; source.layer can choose {_some(others)}",)


def _pictures(number: int, part: Part) -> list[Layer]:
    """Return the layers of a part that have colours, or grey."""
    layers: dict[str, dict[str, str]] = {}
    for channel in part.channels:
        layer, _, name = channel.name.rpartition(".")
        layers.setdefault(layer, {}).setdefault(name.lower(), channel.name)
    found = []
    for name, channels in layers.items():
        kind = next((kind for kind in Kind if channels.keys() >= set(kind.value)), None)
        # A layer of normals has a channel Y as well.
        if kind is None or (kind is Kind.GREY and channels.keys() & {"x", "z"}):
            continue
        named = tuple(channels[channel] for channel in kind.value)
        alpha = channels.get("a") or channels.get("alpha")
        found.append(Layer(number, _full_name(part, name), not name, kind, named, alpha))
    return found


def _full_name(part: Part, layer: str) -> str:
    """Return the name of a layer with that of its part, unless it begins with this already."""
    if not part.name or layer == part.name or layer.startswith(f"{part.name}."):
        return layer
    return f"{part.name}.{layer}" if layer else part.name


def _finished_picture(parts: Sequence[Part], pictures: Sequence[Layer]) -> Layer | None:
    """Return the finished picture among layers; None if that may be several."""
    coloured = [layer for layer in pictures if layer.kind is not Kind.GREY] or list(pictures)
    # Of several cameras, the first is the one that is shown where there is room for one.
    first = parts[0].view
    seen = [layer for layer in coloured if parts[layer.part].view in ("", first)] or coloured
    plain = [layer for layer in seen if layer.is_plain]
    called_so = [layer for layer in seen if layer.name.rpartition(".")[2].lower() in _BEAUTY]
    return next((few[0] for few in (plain, seen, called_so) if len(few) == 1), None)


def _named(path: Path, parts: Sequence[Part], pictures: Sequence[Layer], wanted: str) -> Layer:
    same = [layer for layer in pictures if layer.name == wanted]
    of_part = [layer for layer in pictures if parts[layer.part].name == wanted]
    alike = [layer for layer in pictures if layer.name.lower() == wanted.lower()]
    chosen = next((few[0] for few in (same, of_part, alike) if len(few) == 1), None)
    if chosen is None:
        names = [layer.name for layer in pictures if layer.name]
        listed = f"it has {_some(names)}" if names else "it has no layers with names"
        others = _channels_of(parts, wanted)
        what = f"has no colours, only {_some(others)}" if others else "is none of its layers"
        raise SourceError(
            f"{path}: '{wanted}' {what}; {listed}{did_you_mean(wanted, names)}",
            key=("source", "layer"),
        )
    if parts[chosen.part].is_deep:
        raise SourceError(f"{path}: its layer {wanted} {_DEEP}")
    return chosen


_DEEP = (
    "is deep: its pixels have samples at many depths, of which no one picture follows; flatten it "
    "in the program that made it"
)


def _without_pictures(parts: Sequence[Part]) -> str:
    deep = next((part for part in parts if part.is_deep), None)
    if deep is not None:
        return f"its part {deep.name} {_DEEP}" if deep.name else f"the image {_DEEP}"
    names = [channel.name for part in parts for channel in part.channels]
    return f"holds no channels R, G and B, nor Y, but {_some(names)}; export it with its colours"


def _channels_of(parts: Sequence[Part], layer: str) -> list[str]:
    """Return the channels of a layer or part, without its name."""
    names = [(part, channel.name) for part in parts for channel in part.channels]
    return [
        name.rpartition(".")[2]
        for part, name in names
        if layer in (_full_name(part, name.rpartition(".")[0]), part.name)
    ]


def _proposed(pictures: Sequence[Layer]) -> str:
    names = [layer.name for layer in pictures if layer.name]
    return next((n for n in names if n.rpartition(".")[2].lower() in _BEAUTY), names[0])


def _some(names: Sequence[str]) -> str:
    more = f" and {len(names) - _LISTED} more" if len(names) > _LISTED else ""
    return ", ".join(names[:_LISTED]) + more

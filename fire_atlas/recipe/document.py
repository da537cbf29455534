"""Read a recipe file, or a ``--set`` argument, as plain values, each with its line number."""

from dataclasses import dataclass
from pathlib import Path

import yaml
from yaml.constructor import ConstructorError, SafeConstructor

from fire_atlas.core.errors import RecipeError
from fire_atlas.core.file_kinds import misnamed
from fire_atlas.core.files import MIB, read_file
from fire_atlas.recipe.problem import COMMAND_LINE, KeyPath, Origin, Value, dotted
from fire_atlas.recipe.yaml_graph import MalformedYamlError, compose, line_of

RECIPE_ENDINGS = (".yaml", ".yml", ".fire")
"""Endings of recipe files, YAML all: ``.fire`` is for editors, which import by the ending."""

MAX_BYTES = MIB
"""Limit on the size of a recipe file, bytes."""

_LARGEST = 10**100
"""Limit on the size of whole numbers. Python refuses to print far larger ones in an error."""

_MAX_DIGITS = 400
"""Limit on the length of a number as it is written. YAML's numbers to the base 60 (``1:30``) take
a time that grows by the square of it: 250,000 parts took 45 s."""

_TAG = "tag:yaml.org,2002:"
_TEXT = {_TAG + "str", _TAG + "timestamp", _TAG + "value"}
_MERGE = _TAG + "merge"


@dataclass(frozen=True, slots=True)
class Document:
    """A tree of plain values, with the origin of every key and list item.

    Attributes:
        values: The top-level mapping.
        origins: Key path → where it was written; ``()`` is the document itself.
    """

    values: dict[str, Value]
    origins: dict[KeyPath, Origin]


def read_document(path: Path) -> Document:
    """Return the content of the recipe file ``path``; raise ``RecipeError`` if it is not valid."""
    text = _decode(_read(path), path)
    try:
        root = compose(text)
        if not isinstance(root, yaml.MappingNode):
            raise MalformedYamlError(line_of(root), "a recipe is made of `key: value` lines")
        builder = _ValueBuilder(path)
        return Document(builder.mapping(root, ()), {(): Origin(path, 1), **builder.origins})
    except MalformedYamlError as problem:
        raise RecipeError(f"{path}:{problem.line}: {problem.message}") from None


def parse_override(text: str) -> Document:
    """Parse a ``--set`` argument such as ``flakes.rate=80`` to a document with that one key."""
    key, equals, raw = text.partition("=")
    path = tuple(part.strip() for part in key.split("."))
    if not equals or not all(path):
        raise RecipeError(f"--set {text}: must be key=value, like --set flakes.rate=80")
    if not raw.strip():
        raise RecipeError(f"--set {key}: has no value; write --set {key}=VALUE")
    try:
        value, origins = parse_value(raw, path)
    except MalformedYamlError as problem:
        raise RecipeError(f"--set {key}: {problem.message.removeprefix(f'{key}: ')}") from None
    except UnicodeEncodeError:
        raise RecipeError(f"--set {key}: the value is not UTF-8") from None
    return Document(_nest(value, path), {**_parents(path), **origins})


def stated_source(source: dict[str, str]) -> Document:
    """Return a document with these keys of ``source`` alone, as if the command line stated them."""
    places: list[KeyPath] = [(), ("source",), *(("source", key) for key in source)]
    return Document({"source": dict(source)}, dict.fromkeys(places, COMMAND_LINE))


def parse_value(text: str, at: KeyPath) -> tuple[Value, dict[KeyPath, Origin]]:
    """Parse a value given on the command line for the key ``at``; return it with its origins."""
    builder = _ValueBuilder(None)
    return builder.value(compose(text), at), builder.origins


def _nest(value: Value, path: tuple[str, ...]) -> dict[str, Value]:
    for name in reversed(path[1:]):
        value = {name: value}
    return {path[0]: value}


def _parents(path: tuple[str, ...]) -> dict[KeyPath, Origin]:
    return {path[:depth]: COMMAND_LINE for depth in range(1, len(path))}


def _read(path: Path) -> bytes:
    if path.is_dir():
        raise RecipeError(f"{path}: is a folder; name a recipe file")
    if not path.exists():
        raise RecipeError(f"{path}: there is no such recipe file")
    try:
        data = read_file(path, MAX_BYTES)
    except OSError as error:
        raise RecipeError(f"{path}: cannot be read ({error.strerror})") from None
    if data and (what := misnamed(data[:64], may_be_json=True)):
        raise RecipeError(f"{path}: is {what}")
    return data


def _decode(data: bytes, path: Path) -> str:
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        if path.suffix not in RECIPE_ENDINGS:
            raise RecipeError(
                f"{path}: is no recipe; if it is a clip or a picture, fire-atlas init {path} "
                f"writes a recipe for it"
            ) from None
        line = data.count(b"\n", 0, error.start) + 1
        raise RecipeError(
            f"{path}:{line}: byte {error.start} of the file is not UTF-8; save it as UTF-8"
        ) from None


class _ValueBuilder:
    """Builds plain values from a graph of YAML nodes, and records where each key was written."""

    def __init__(self, file: Path | None) -> None:
        self.file = file
        self.origins: dict[KeyPath, Origin] = {}

    def value(self, node: yaml.Node, at: KeyPath, line: int = 0) -> Value:
        """Return the value of ``node``; ``line`` is the line of its key, 0 if it has none."""
        origin = Origin(self.file, line or line_of(node)) if self.file else COMMAND_LINE
        self.origins[at] = origin
        if isinstance(node, yaml.MappingNode):
            return self.mapping(node, at)
        if isinstance(node, yaml.SequenceNode):
            _expect_tag(node, "seq", at)
            return [self.value(item, (*at, i)) for i, item in enumerate(node.value)]
        assert isinstance(node, yaml.ScalarNode)
        return _scalar(node, at)

    def mapping(self, node: yaml.MappingNode, at: KeyPath) -> dict[str, Value]:
        _expect_tag(node, "map", at)
        return {
            name: self.value(value, (*at, name), line_of(key))
            for name, (key, value) in _pairs(node, at).items()
        }


def _pairs(node: yaml.MappingNode, at: KeyPath) -> dict[str, tuple[yaml.Node, yaml.Node]]:
    """Return key → (key node, value node); a mapping's own keys override those merged by ``<<``."""
    own: dict[str, tuple[yaml.Node, yaml.Node]] = {}
    merged: dict[str, tuple[yaml.Node, yaml.Node]] = {}
    for key, value in node.value:
        if not isinstance(key, yaml.ScalarNode):
            raise MalformedYamlError(line_of(key), "a key must be a plain word")
        if key.tag == _MERGE:
            for base in _merged(value):
                merged = {**_pairs(base, at), **merged}
        elif key.value in own:
            first = line_of(own[key.value][0])
            name = dotted((*at, key.value))
            raise MalformedYamlError(
                line_of(key), f"{name}: stands here a second time, after line {first}; keep one"
            )
        else:
            own[key.value] = key, value
    return {**merged, **own}


def _merged(value: yaml.Node) -> list[yaml.MappingNode]:
    """Return the mappings that ``<<`` merges: one alias or a list, of which the first wins."""
    bases = value.value if isinstance(value, yaml.SequenceNode) else [value]
    if not all(isinstance(base, yaml.MappingNode) for base in bases):
        raise MalformedYamlError(line_of(value), "<<: merges blocks; give it an alias like *name")
    return list(bases)


def _expect_tag(node: yaml.Node, kind: str, at: KeyPath) -> None:
    if node.tag != _TAG + kind:
        raise _unknown_tag(node, at)


def _unknown_tag(node: yaml.Node, at: KeyPath) -> MalformedYamlError:
    tag = node.tag.replace(_TAG, "!!")
    return MalformedYamlError(
        line_of(node), f"{_label(at)}the tag {tag} has no meaning in a recipe; remove it"
    )


def _scalar(node: yaml.ScalarNode, at: KeyPath) -> Value:
    """Return the text, number, true, false or null in a node."""
    if node.tag in _TEXT:
        return str(node.value)
    if node.tag == _TAG + "null" and node.value == "":
        # The user forgot a value or did not quote a #colour: this is not a deliberate null.
        raise MalformedYamlError(
            line_of(node),
            f"{_label(at)}has no value; give it one or remove the key"
            " (an unquoted # begins a comment)",
        )
    construct = SafeConstructor.yaml_constructors.get(node.tag)
    if construct is None or node.tag.removeprefix(_TAG) not in {"null", "bool", "int", "float"}:
        raise _unknown_tag(node, at)
    wrong = None
    try:
        too_long = len(node.value) > _MAX_DIGITS
        value: Value = 0 if too_long else construct(SafeConstructor(), node)
        if too_long or (isinstance(value, int) and abs(value) > _LARGEST):
            wrong = "is too large for any key"
    except (ValueError, OverflowError, KeyError, IndexError, ConstructorError):
        wrong = "cannot be read"
    if wrong:
        shown = node.value if len(node.value) <= 40 else node.value[:37] + "..."
        raise MalformedYamlError(line_of(node), f"{_label(at)}{shown} {wrong}")
    return value


def _label(at: KeyPath) -> str:
    return f"{dotted(at)}: " if at else ""

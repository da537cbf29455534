"""Parse YAML text to a node graph, and refuse ones too large before anything is built of them.

A few lines of aliases can stand for billions of nodes, and nesting deep enough overruns the C
stack of the parser, so both are measured first: depth while parsing, size on the composed graph.
"""

import re
from collections.abc import Iterator

import yaml

MAX_NODES = 20_000
"""Most nodes of a document, aliases written out."""

MAX_DEPTH = 64
"""Deepest nesting of a document, aliases written out."""

_Size = tuple[int, int]
"""Nodes and levels below and including a node, aliases written out."""


class MalformedYamlError(ValueError):
    """YAML that is no recipe: what is wrong, and in which line (from 1)."""

    def __init__(self, line: int, message: str) -> None:
        """Take the line and what is wrong there."""
        super().__init__(message)
        self.line, self.message = line, message


class _Loader(yaml.CSafeLoader):
    """PyYAML's C loader, to which ``1e-3`` is a number, as in YAML 1.2 (it asks for ``1.0e-3``)."""


_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float",
    re.compile(r"[-+]?(\d+\.?\d*|\.\d+)[eE][-+]?\d+$"),
    list("-+.0123456789"),
)


def compose(text: str) -> yaml.Node:
    """Return the root of the one document in ``text``; refuse anything else."""
    try:
        _refuse_deep_nesting(text)
        root = _Loader(text).get_single_node()
    except yaml.YAMLError as error:
        raise _as_malformed(error, text) from None
    if root is None:
        raise MalformedYamlError(1, "is empty; a recipe needs at least `source` or `extends`")
    _measure(root, {})
    return root


def line_of(item: yaml.Node | yaml.Event) -> int:
    """Return the line a node or event begins in, from 1."""
    return int(item.start_mark.line) + 1 if item.start_mark else 1


def _refuse_deep_nesting(text: str) -> None:
    """Count nodes and depth over the events of the parser, which needs no recursion."""
    depth = nodes = 0
    for event in yaml.parse(text, Loader=_Loader):
        nodes += isinstance(event, yaml.NodeEvent)
        depth += isinstance(event, yaml.CollectionStartEvent)
        depth -= isinstance(event, yaml.CollectionEndEvent)
        if depth > MAX_DEPTH or nodes > MAX_NODES:
            raise _too_big(line_of(event))


def _measure(node: yaml.Node, sizes: dict[int, _Size | None]) -> _Size:
    """Return the size of ``node``, computing that of each shared node once; None marks one begun.

    An alias points backwards, at something measured or begun: the recursion is no
    deeper than the text is nested.
    """
    if id(node) in sizes:
        known = sizes[id(node)]
        if known is None:
            raise MalformedYamlError(line_of(node), "an alias (*) stands inside its own anchor (&)")
        return known
    sizes[id(node)] = None
    below = [_measure(child, sizes) for child in _children(node)]
    size = 1 + sum(nodes for nodes, _ in below)
    levels = 1 + max((levels for _, levels in below), default=0)
    if size > MAX_NODES or levels > MAX_DEPTH:
        raise _too_big(line_of(node))
    sizes[id(node)] = size, levels
    return size, levels


def _children(node: yaml.Node) -> Iterator[yaml.Node]:
    if isinstance(node, yaml.MappingNode):
        for key, value in node.value:
            yield key
            yield value
    elif isinstance(node, yaml.SequenceNode):
        yield from node.value


def _too_big(line: int) -> MalformedYamlError:
    return MalformedYamlError(
        line,
        f"is too big for a recipe: at most {MAX_NODES} values, nested {MAX_DEPTH} deep,"
        " counting what aliases (*) stand for",
    )


def _as_malformed(error: yaml.YAMLError, text: str) -> MalformedYamlError:
    """Return one of PyYAML's errors as one sentence with a line."""
    if isinstance(error, yaml.reader.ReaderError):
        line = text.count("\n", 0, error.position) + 1
        return MalformedYamlError(line, f"{error.reason}; remove the character")
    assert isinstance(error, yaml.MarkedYAMLError)
    mark = error.problem_mark or error.context_mark
    line = int(mark.line) + 1 if mark else 1
    if error.problem == "but found another document":
        return MalformedYamlError(
            line, "a second document (---) begins here; a recipe is one document"
        )
    context = f" {error.context}" if error.context else ""
    return MalformedYamlError(line, f"is no valid YAML: {error.problem}{context}{_hint(error)}")


def _hint(error: yaml.MarkedYAMLError) -> str:
    """Guess the usual cause of a syntax error."""
    problem, context = str(error.problem), str(error.context)
    if "tab" in problem or "cannot start any token" in problem:
        return "; indent with spaces, and quote text that begins with a special character"
    if "flow sequence" in context:
        return "; close the list with ], and quote colours: an unquoted # begins a comment"
    return ""

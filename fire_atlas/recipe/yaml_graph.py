"""Parse YAML text to a graph of nodes, and refuse it if it is too large.

A few lines of nested aliases can expand to billions of nodes, and deep nesting overflows the C
stack of the parser. So depth is checked while parsing, and the expanded size before expanding.
"""

import re
from collections.abc import Iterator

import yaml

MAX_NODES = 20_000
"""Limit on the number of nodes of a document, aliases expanded."""

MAX_DEPTH = 64
"""Limit on the nesting of a document, aliases expanded."""

BACKSLASHES = (
    "in double quotes a backslash begins an escape: write paths with /, or in single quotes"
)
"""Advice on paths of Windows."""

_Size = tuple[int, int]
"""Number of nodes, and of levels, of a node with all below it, aliases expanded."""


class MalformedYamlError(ValueError):
    """YAML that is not valid in a recipe: what is wrong, and in which line (from 1)."""

    def __init__(self, line: int, message: str) -> None:
        """Keep the line and the message."""
        super().__init__(message)
        self.line, self.message = line, message


class _Loader(yaml.CSafeLoader):
    """PyYAML's C loader, which here reads ``1e-3`` as a number, as YAML 1.2 does."""


_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float",
    re.compile(r"[-+]?(\d+\.?\d*|\.\d+)[eE][-+]?\d+$"),
    list("-+.0123456789"),
)


def compose(text: str) -> yaml.Node:
    """Return the root of the YAML document in ``text``; refuse several documents, or none."""
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
    """Return the line, from 1, in which a node or event begins."""
    return int(item.start_mark.line) + 1 if item.start_mark else 1


def _refuse_deep_nesting(text: str) -> None:
    """Check nodes and depth in the events of the parser, which come without recursion."""
    depth = nodes = 0
    for event in yaml.parse(text, Loader=_Loader):
        nodes += isinstance(event, yaml.NodeEvent)
        depth += isinstance(event, yaml.CollectionStartEvent)
        depth -= isinstance(event, yaml.CollectionEndEvent)
        if depth > MAX_DEPTH or nodes > MAX_NODES:
            raise _too_big(line_of(event))


def _measure(node: yaml.Node, sizes: dict[int, _Size | None]) -> _Size:
    """Return the size of ``node``, and put it into ``sizes``, where None means "being measured".

    Each shared node is measured once. An alias can only refer to an earlier node, so the recursion
    is not deeper than the nesting of the text.
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
    """Convert one of PyYAML's errors to one sentence with a line."""
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
    """Return the usual cause of a syntax error, if it is known."""
    problem, context = str(error.problem), str(error.context)
    if "tab" in problem or "cannot start any token" in problem:
        return "; indent with spaces, and quote text that begins with a special character"
    if "flow sequence" in context or "flow node" in context:
        return "; close the list with ], and quote colours: an unquoted # begins a comment"
    if "flow mapping" in context:
        return "; close the block with }, and quote colours: an unquoted # begins a comment"
    if "quoted scalar" in context and ("escape" in problem or "hexdecimal" in problem):
        return f"; {BACKSLASHES}"
    return ""

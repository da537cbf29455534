"""Validate a recipe with the models, and turn each of pydantic's errors into a line of advice."""

import json
import re
from collections.abc import Callable, Iterable
from typing import Any

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from fire_atlas.core.errors import RecipeError
from fire_atlas.recipe.base import BRANCHES, COLOR_PATTERN, KINDS, UNDECIDED, UNKNOWN_KIND
from fire_atlas.recipe.keys import all_keys, blocks_at, key_docs, keys_at
from fire_atlas.recipe.models import Recipe
from fire_atlas.recipe.output import NAMESPACE_PATTERN
from fire_atlas.recipe.problem import ContradictionError, KeyPath, Problem, did_you_mean, dotted
from fire_atlas.recipe.tree import MEMBERS, NAME_ADVICE, NAME_PATTERN, RecipeTree

_MAX_REPORTED = 50
"""Limit on the mistakes that one error lists: each suggestion compares its word with every key."""

_PATTERNS = {
    NAME_PATTERN: NAME_ADVICE,
    NAMESPACE_PATTERN: "must be a namespace of C#, like Game.Fire",
    COLOR_PATTERN: 'must be a colour like "#ff7300", with the quotes',
}


def validate(tree: RecipeTree) -> Recipe:
    """Return the recipe in ``tree``; raise ``RecipeError`` with a line for each mistake."""
    try:
        return Recipe.model_validate(_with_source(tree))
    except ValidationError as error:
        mistakes = [
            details
            for details in error.errors(include_url=False)
            if details["type"] != "default_factory_not_called"  # follows from another mistake
        ]
        found = [problem for details in mistakes[:_MAX_REPORTED] for problem in _problems(details)]
    causes = [
        problem
        for problem in found
        if not any(_is_below(other.path, problem.path) for other in found)
    ]
    more = len(mistakes) - _MAX_REPORTED
    raise RecipeError(
        *refusal(tree, causes).lines,
        *([f"{tree.path}: {more} more mistakes; correct these first"] if more > 0 else []),
    )


def refusal(tree: RecipeTree, problems: Iterable[Problem]) -> RecipeError:
    """Return the error that reports ``problems`` of a recipe, a line each, in order of the file.

    A line begins with the place of its key: ``campfire.yaml:12: flakes.alpha: ``.
    """
    placed = [(tree.origin(problem.path), problem) for problem in problems]
    placed.sort(key=lambda pair: pair[0].line)
    return RecipeError(
        *(f"{origin.locate(problem.path)}: {problem.message}" for origin, problem in placed)
    )


def _with_source(tree: RecipeTree) -> dict[str, Any]:
    """Return the values to validate; refuse a recipe with neither a source nor members."""
    if tree.has_source or tree.value(MEMBERS):
        return tree.values
    raise RecipeError(f"{tree.origin(('source',)).locate(('source',))}: {_missing(('source',))}")


def _problems(details: ErrorDetails) -> list[Problem]:
    """Convert one of pydantic's errors to problems with keys of the recipe."""
    path = _key_path(details)
    match details.get("ctx"):
        case {"error": ContradictionError(problems=problems)}:
            return [Problem((*path, *problem.path), problem.message) for problem in problems]
    return [Problem(path, _advice(details))]


def _key_path(details: ErrorDetails) -> KeyPath:
    kind = ("kind",) if details["type"] == UNKNOWN_KIND else ()
    return (*_without_tags(details["loc"]), *kind)


def _without_tags(path: KeyPath) -> KeyPath:
    """Return one of pydantic's key paths without the tags of union branches."""
    return tuple(part for part in path if part not in BRANCHES)


def _is_below(inner: KeyPath, outer: KeyPath) -> bool:
    """Return whether ``inner`` is inside ``outer``: its error then caused the outer one."""
    return len(inner) > len(outer) and inner[: len(outer)] == outer


def _advice(details: ErrorDetails) -> str:
    """Return what is wrong with a value and how to correct it, to be printed after its key."""
    path, kind, context = details["loc"], details["type"], details.get("ctx", {})
    match kind:
        case "extra_forbidden":
            return f"unknown key{_suggested_key(path)}"
        case "missing":
            return _missing(path)
        case known if known == UNKNOWN_KIND:
            return _choice(details["msg"], details["input"]["kind"])
        case "literal_error":
            return _choice(context["expected"], details["input"])
        case "string_pattern_mismatch" if context["pattern"] in _PATTERNS:
            return f"{_PATTERNS[context['pattern']]}; got {_quoted(details['input'])}"
        case "value_error":
            return str(context["error"])
        case "model_type" | "model_attributes_type":
            return f"must be a block{_example_block(path)}; got {_quoted(details['input'])}"
    if kind == UNDECIDED:
        wanted = details["msg"]
    elif kind in _WANTED:
        wanted = f"must be {_WANTED[kind](context)}"
    else:
        wanted = details["msg"]
    return f"{wanted}; got {_quoted(details['input'])}"


_WANTED: dict[str, Callable[[dict[str, Any]], str]] = {
    "bool_type": lambda _: "true or false",
    "finite_number": lambda _: "a finite number",
    "float_type": lambda _: "a number",
    "int_type": lambda _: "a whole number",
    "string_type": lambda _: "text (put it in quotes if it is meant to be)",
    "string_too_short": lambda _: "text of at least one character",
    "string_too_long": lambda ctx: f"at most {ctx['max_length']} characters",
    "string_pattern_mismatch": lambda _: "text without control characters",
    "tuple_type": lambda _: "a list, like [a, b]",
    "too_short": lambda ctx: f"a list of at least {ctx['min_length']}",
    "too_long": lambda ctx: f"a list of at most {ctx['max_length']}",
    "greater_than": lambda ctx: f"more than {ctx['gt']:g}",
    "greater_than_equal": lambda ctx: f"at least {ctx['ge']:g}",
    "less_than": lambda ctx: f"less than {ctx['lt']:g}",
    "less_than_equal": lambda ctx: f"at most {ctx['le']:.10g}",
}
"""Error type of pydantic → the wanted value, from the error's context."""


def _suggested_key(path: KeyPath) -> str:
    """Suggest the key that was meant, in the same block or else in another one."""
    parent, key = path[:-1], str(path[-1])
    prefix = f"{dotted(_without_tags(parent))}." if parent else ""
    for known in all_keys():
        if "." in key and dotted(known) == key:
            return f"; write `{known[-1]}` inside the block `{dotted(known[:-1])}`"
    if key in keys_at(parent):
        return "; it cannot be combined with the other keys of its block"
    if kinds := _kinds_with(path):
        return f" here; it is one of {kinds}"
    if near := did_you_mean(key, keys_at(parent), prefix):
        return near
    for known in all_keys():
        if known[-1] == key:
            return f"; did you mean {dotted(known)}?"
    return f"; the keys here are {', '.join(keys_at(parent))}"


def _kinds_with(path: KeyPath) -> str:
    """Return the other kinds of the block that have the key of this path; empty if none has."""
    kinds = KINDS - {path[-2]} if len(path) > 1 and path[-2] in KINDS else ()
    having = [kind for kind in sorted(kinds) if path[-1] in keys_at((*path[:-2], kind))]
    return " or ".join(f"`kind: {str(kind).strip('<>')}`" for kind in having)


def _missing(path: KeyPath) -> str:
    if isinstance(path[-1], int):
        return f"is missing: the list needs {path[-1] + 1} items"
    about = ""
    for block in blocks_at(path[:-1]):
        if doc := key_docs(block).get(str(path[-1])):
            about = f": {_first_sentence(doc)}"
    return f"is missing{about}"


def _first_sentence(text: str) -> str:
    """Return the first sentence of a docstring, for use within another sentence."""
    sentence = " ".join(text.split()).partition(". ")[0].rstrip(".")
    return sentence[:1].lower() + sentence[1:]


def _choice(expected: str, given: Any) -> str:
    """List the choices of a literal as advice; ``expected`` is pydantic's text about them."""
    choices = re.findall(r"'([^']*)'", expected) or [expected]
    one_of = "one of " if len(choices) > 1 else ""
    near = did_you_mean(given, choices) if isinstance(given, str) else ""
    return f"must be {one_of}{', '.join(choices)}; got {_quoted(given)}{near}"


def _example_block(path: KeyPath) -> str:
    needed = [
        key
        for block in blocks_at(path)
        for key, field in block.model_fields.items()
        if field.is_required()
    ]
    return f", like {{{', '.join(f'{key}: ...' for key in needed)}}}" if needed else " of settings"


def _quoted(value: Any) -> str:
    """Return a value as in a recipe, shortened."""
    if isinstance(value, float):
        return f"{value:g}"
    text = json.dumps(value, ensure_ascii=False, default=str)
    return text if len(text) <= 60 else f"{text[:57]}..."

"""``--set key=value``: one key of a recipe, given on the command line."""

from fire_atlas.core.errors import RecipeError
from fire_atlas.recipe.document import parse_value
from fire_atlas.recipe.origin import COMMAND_LINE, Document, KeyPath, Origin, Value
from fire_atlas.recipe.yaml_graph import MalformedYamlError


def parse_override(text: str) -> Document:
    """Return ``flakes.rate=80`` as a document of that one key, to be laid over a recipe."""
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


def _nest(value: Value, path: tuple[str, ...]) -> dict[str, Value]:
    for name in reversed(path[1:]):
        value = {name: value}
    return {path[0]: value}


def _parents(path: tuple[str, ...]) -> dict[KeyPath, Origin]:
    return {path[:depth]: COMMAND_LINE for depth in range(1, len(path))}

"""What the docstrings under the keys of a block say."""

import ast
import inspect
from itertools import pairwise

from fire_atlas.recipe.base import Settings


def key_docs(block: type[Settings]) -> dict[str, str]:
    """Return the docstring of each key of ``block`` that has one.

    For the schema and for advice alone: pydantic's own way, ``use_attribute_docstrings``, reads
    the source of every model at every start, which takes a quarter of what their import does.
    """
    docs: dict[str, str] = {}
    for owner in reversed(block.__mro__):
        if issubclass(owner, Settings):
            docs |= _own_docs(owner)
    return docs


def _own_docs(block: type[Settings]) -> dict[str, str]:
    try:
        source = inspect.getsource(block)
    except OSError:  # installed without its source
        return {}
    [definition] = ast.parse(source).body
    assert isinstance(definition, ast.ClassDef)
    docs = {}
    for key, below in pairwise(definition.body):
        match key, below:
            case ast.AnnAssign(target=ast.Name(id=name)), ast.Expr(
                value=ast.Constant(value=str(text))
            ):
                docs[name] = inspect.cleandoc(text)
    return docs

"""Words and numbers as Godot's text files hold them."""

import re
from collections.abc import Iterable

from fire_atlas.core.errors import OutputError


def number(value: float) -> str:
    """Return a number in plain decimals: ``24``, ``-38.4``."""
    text = f"{value:.6f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def real(value: float) -> str:
    """Return a number that is no integer to the engine: ``24.0``."""
    text = number(value)
    return text if "." in text else f"{text}.0"


def quoted(text: str) -> str:
    """Return a string in quotes."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'


def node_name(name: str) -> str:
    """Return a node's name for outputs called ``name``: ``fire-ball.v2`` becomes ``FireBallV2``."""
    return "".join(word[:1].upper() + word[1:] for word in re.split(r"[^A-Za-z0-9]+", name)) or "_"


def titles(animations: Iterable[str]) -> dict[str, str]:
    """Return what each animation is called in the engine, whose editor knows no ``/`` and ``,``.

    Raises:
        OutputError: Two would be called the same.
    """
    made: dict[str, str] = {}
    for animation in animations:
        title = animation.replace("/", "_").replace(",", " ")
        if title in made.values():
            other = next(name for name in made if made[name] == title)
            raise OutputError(
                f"exports: godot cannot tell the animations {other} and {animation} apart: its "
                f"editor knows no `/` and `,`, so both would be called {title}; rename the files "
                f"of one"
            )
        made[animation] = title
    return made

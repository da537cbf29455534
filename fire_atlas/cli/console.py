"""Tables and bars by rich, of text that is printed as it is."""

from typing import Any

from rich.console import Console
from rich.text import Text

from fire_atlas.cli.text import printable


class PlainConsole(Console):
    """A console that takes no text for markup, for an emoji or for a command to the terminal."""

    def __init__(self, *, stderr: bool = False) -> None:
        """Print on stdout, or on ``stderr``."""
        super().__init__(stderr=stderr, highlight=False)

    def render_str(self, text: str, **options: Any) -> Text:
        """Return ``text`` as it is."""
        return super().render_str(
            printable(text), **{**options, "markup": False, "emoji": False, "highlight": False}
        )

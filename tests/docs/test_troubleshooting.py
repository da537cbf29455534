"""Messages that docs/troubleshooting.md explains are ones that the program has."""

import ast
from collections.abc import Iterator

import pytest

from tests.docs.markdown import ROOT, section

ROWS = section("docs/troubleshooting.md", "Errors").splitlines()
MESSAGES = [
    message.strip()
    for row in ROWS
    if row.startswith("| ") and not row.startswith("| message")
    for message in row.split("|")[1].split(" · ")
]
"""The messages of the table, with … for what differs."""


def texts() -> Iterator[str]:
    """Yield every piece of text in the package's code."""
    for path in sorted((ROOT / "fire_atlas").rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                yield node.value


SAID = tuple(texts())


@pytest.mark.parametrize("message", MESSAGES)
def test_the_program_says_so(message: str) -> None:
    pieces = [piece.strip() for piece in message.split("…") if piece.strip()]
    assert pieces, "a message of nothing but …"
    for piece in pieces:
        assert any(piece in text for text in SAID), f"no message says {piece!r} any more"

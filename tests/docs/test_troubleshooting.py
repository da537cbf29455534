"""Messages that docs/troubleshooting.md explains are ones that the program has."""

import ast
from functools import cache

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


@cache
def texts() -> list[str]:
    """Return every piece of text in the package's code."""
    found = []
    for path in sorted((ROOT / "fire_atlas").rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                found.append(node.value)
    return found


@pytest.mark.parametrize("message", MESSAGES)
def test_the_program_says_so(message: str) -> None:
    pieces = [piece.strip() for piece in message.split("…") if piece.strip()]
    assert pieces, "a message of nothing but …"
    for piece in pieces:
        assert any(piece in text for text in texts()), f"no message says {piece!r} any more"

"""The project's Markdown pages: their code blocks, headings and links."""

import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
"""The checkout."""

FOLDERS = "docs", "samples", "templates", "tests"

PAGES = tuple(
    sorted(
        path.relative_to(ROOT).as_posix()
        for pattern in ("*.md", *(f"{folder}/**/*.md" for folder in FOLDERS))
        for path in ROOT.glob(pattern)
        if "node_modules" not in path.parts
    )
)
"""Every page of the checkout, relative to it."""

_FENCE = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_HEADING = re.compile(r"^#+ (.+)$", re.MULTILINE)
_LINK = re.compile(r"!?\[(?:[^\[\]]|\[[^\]]*\])*\]\(([^)\s]+)\)")


def page_text(page: str) -> str:
    return (ROOT / page).read_text(encoding="utf-8")


def code_blocks(page: str, language: str) -> Iterator[str]:
    """Yield the text of each fenced block that is marked as ``language``."""
    for block in _FENCE.finditer(page_text(page)):
        if block[1] == language:
            yield block[2]


def prose(page: str) -> str:
    """Return a page without its fenced blocks."""
    return _FENCE.sub("", page_text(page))


def anchors(page: str) -> set[str]:
    """Return what a link to a heading may say after ``#``, as GitHub makes it of the heading."""
    found, seen = set[str](), Counter[str]()
    for heading in _HEADING.findall(prose(page)):
        slug = re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")
        found.add(f"{slug}-{seen[slug]}" if seen[slug] else slug)
        seen[slug] += 1
    return found


def links(page: str) -> Iterator[str]:
    """Yield the target of each link and picture of a page."""
    yield from _LINK.findall(re.sub(r"`[^`\n]*`", lambda code: "`" * len(code[0]), prose(page)))


def section(page: str, heading: str) -> str:
    """Return a page's text from one heading to the next of its level or above."""
    text = page_text(page)
    begin = re.search(rf"^(#+) {re.escape(heading)}$", text, re.MULTILINE)
    assert begin, f"{page} has no heading {heading!r}"
    end = re.compile(rf"^#{{1,{len(begin[1])}}} ", re.MULTILINE).search(text, begin.end())
    return text[begin.end() : end.start() if end else None]


def table_column(text: str, column: int = 0) -> list[str]:
    """Return the words in backticks that stand in one column of a text's tables."""
    rows = [line for line in text.splitlines() if line.startswith("|")]
    cells = [re.split(r"(?<!\\)\|", row)[column + 1] for row in rows]
    return [word for cell in cells for word in re.findall(r"`([^`]+)`", cell)]

"""Links of the project's pages lead to files of the checkout, and to headings in them."""

import re
from pathlib import Path
from urllib.parse import unquote

import pytest

from tests.docs.markdown import PAGES, ROOT, anchors, links, prose

_FILE = re.compile(r"`((?:[\w.]+/)+[\w.]+\.(?:py|md)|(?:tests|docs|fire_atlas)/[\w/.]+)`")
_ROOTS = "", "fire_atlas"
"""Where paths in the docs begin."""


def is_elsewhere(link: str) -> bool:
    return link.startswith(("https://", "http://", "mailto:"))


@pytest.mark.parametrize("page", PAGES)
def test_every_link_leads_to_a_file_and_a_heading(page: str) -> None:
    broken = [link for link in links(page) if not is_elsewhere(link) and not leads(page, link)]
    assert not broken, f"{page}: {', '.join(broken)}"


def leads(page: str, link: str) -> bool:
    file, _, anchor = unquote(link).partition("#")
    target = (ROOT / page).parent / file if file else ROOT / page
    if not target.exists():
        return False
    return not anchor or anchor in anchors(target.resolve().relative_to(ROOT).as_posix())


@pytest.mark.parametrize("page", sorted(set(PAGES) - {"CHANGELOG.md"}))
def test_every_file_of_the_checkout_that_is_named_is_there(page: str) -> None:
    named = set(_FILE.findall(prose(page)))
    missing = [file for file in named if not any((ROOT / at / file).exists() for at in _ROOTS)]
    assert not missing, f"{page}: {', '.join(sorted(missing))}"


def test_every_picture_of_the_docs_is_shown() -> None:
    pictures = {path for path in (ROOT / "docs").iterdir() if path.suffix in {".png", ".webp"}}
    shown = {
        ((ROOT / page).parent / Path(link)).resolve() for page in PAGES for link in links(page)
    }
    assert pictures <= shown


def test_every_page_of_the_docs_can_be_reached_from_the_readme() -> None:
    reached, ways = set[str](), ["README.md"]
    while ways:
        page = ways.pop()
        if page in reached or not page.endswith(".md"):
            continue
        reached.add(page)
        for link in links(page):
            file = link.partition("#")[0]
            if file and not is_elsewhere(link):
                path = ((ROOT / page).parent / file).resolve()
                ways.append(path.relative_to(ROOT).as_posix())
    assert {page for page in PAGES if page.startswith("docs/")} <= reached

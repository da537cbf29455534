"""docs/papers.md names every equation, figure and table of the papers, and only what is there."""

import re
from collections.abc import Iterator

import pytest
import yaml

from fire_atlas.recipe.inherit import instead_of
from fire_atlas.recipe.keys import all_keys
from fire_atlas.recipe.models import Recipe
from tests.docs.markdown import ROOT, code_blocks, page_text, section

PAGE = "docs/papers.md"

PAPERS = {
    "Kim & Lee: fire-flakes": {"eq": 17, "figure": 23, "table": 1},
    "Lee et al.: fire learnt from a clip": {"eq": 0, "figure": 17, "table": 0},
    "Balci & Foroosh: silk flames": {"eq": 24, "figure": 7, "table": 0},
}
"""How many equations, figures and tables each paper has."""

WORDS = {"eq": r"eq\.", "figure": r"Figures?", "table": r"Tables?"}

TEXT = page_text(PAGE)

KEYS = {".".join(path) for path in all_keys()}


def rows(heading: str) -> list[list[str]]:
    """Return the cells of each row of the tables that say what of a paper is where."""
    tables = re.findall(r"^\| of the paper .*\n(?:\|.*\n)+", section(PAGE, heading), re.MULTILINE)
    return [
        [cell.strip() for cell in row.strip("|").split(" |")]
        for table in tables
        for row in table.splitlines()[2:]
    ]


def numbers(text: str, kind: str) -> Iterator[int]:
    """Yield the numbers in ``Figures 2a-b, 4`` or ``eq. 1-3, 17``."""
    found = re.finditer(rf"{WORDS[kind]} (\d+\w?(?:(?:-|, | and )(?:\d+\w?|[a-z]\b))*)", text)
    for listed in found:
        for part in re.split(r", | and ", listed[1]):
            ends = [int(each) for each in re.findall(r"\d+", part)]
            yield from range(ends[0], ends[-1] + 1)


@pytest.mark.parametrize("heading", PAPERS)
@pytest.mark.parametrize("kind", WORDS)
def test_every_numbered_part_of_a_paper_has_its_place(heading: str, kind: str) -> None:
    named = {n for of, *_ in rows(heading) for n in numbers(of, kind)}
    assert named == set(range(1, PAPERS[heading][kind] + 1))


@pytest.mark.parametrize("heading", PAPERS)
def test_each_part_acts_deviates_or_is_left_out(heading: str) -> None:
    for of, here, shown in rows(heading):
        assert re.match(r"acts?\b|deviates?\b|left out: ", here), of
        assert shown or here.startswith("left out: "), of


def test_what_is_in_of_the_first_paper_has_a_figure() -> None:
    for of, here, shown in rows("Kim & Lee: fire-flakes"):
        stated = re.sub(r"(eq\.|section|Figures?|`[^`]*`)[\s\d.,-]*", "", f"{here} {shown}")
        assert here.startswith("left out: ") or re.search(r"\d", stated), of


def test_every_file_that_is_named_is_there() -> None:
    named = re.findall(r"`((?:[\w.]+/)*\w+\.(?:py|md|webp|png)|(?:tests|fire_atlas)/[\w/]+)`", TEXT)
    assert len(named) > 60
    for name in named:
        assert list(ROOT.glob(name)) or any(
            list(ROOT.glob(f"{folder}/**/{name}")) for folder in ("tests", "fire_atlas")
        ), name


def test_every_key_that_is_named_is_one_of_a_recipe() -> None:
    blocks = {key.partition(".")[0] for key in KEYS}
    words = [word for word in re.findall(r"`(\w+\.\w+)`", TEXT) if word.partition(".")[0] in blocks]
    assert len(words) > 10
    assert [word for word in words if word not in KEYS] == []


def test_the_recipe_is_what_is_advised_in_place_of_a_ready_one() -> None:
    """``init paper`` and ``extends: paper`` name keys; with a source they are the whole recipe."""
    (recipe,) = (yaml.safe_load(block) for block in code_blocks(PAGE, "yaml"))
    advised = [
        yaml.safe_load(keys) for keys in re.findall(r"`(\w+: \{.*?\})`", instead_of("paper"))
    ]
    assert advised
    keys = {block: values for each in advised for block, values in each.items()}
    built = Recipe.model_validate({"source": recipe["source"], **keys})
    assert Recipe.model_validate(recipe) == built
    assert built.features.preset == "paper"

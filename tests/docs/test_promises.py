"""What keys of the effect promise to be seen: docs/promises.md, its sentences and directions."""

from collections.abc import Iterator

import pytest

from fire_atlas.recipe.keys import all_keys, blocks_at, key_docs
from tests.docs.markdown import page_text
from tests.support.promises.of_effect import PROMISES, WITHOUT
from tests.support.promises.of_fluid import PROMISES_OF_FLUID, WITHOUT_OF_FLUID
from tests.support.promises.of_silk import PROMISES_OF_SILK, WITHOUT_OF_SILK
from tests.support.promises.promise import COARSE, SEEDS, Promise
from tests.support.promises.table import ALL, measured

PAGE = "docs/promises.md"

BLOCKS = ("features", "buoyancy", "flakes", "motion_blur", "composite", "wind")

IDS = [f"{p.key} of {p.fire}: {p.figure.name}" for p in ALL]


def keys_of_the_effect() -> Iterator[str]:
    """Yield the keys of the effect's blocks, those in a list or block of their own included."""
    for path in all_keys():
        if path[0] in BLOCKS and len(path) > 1:
            yield ".".join(path)


def test_every_key_has_a_promise_or_a_reason_why_not() -> None:
    stated = {*(promise.key for promise in PROMISES), *WITHOUT}
    for key in keys_of_the_effect():
        blocks = [key.rsplit(".", depth)[0] for depth in range(key.count("."))]
        inside = [other for other in stated if other.startswith(f"{key}.")]
        assert stated & {key, *blocks} or inside, key


@pytest.mark.parametrize(
    ("kind", "promises", "without"),
    [
        ("silk", PROMISES_OF_SILK, WITHOUT_OF_SILK),
        ("fluid", PROMISES_OF_FLUID, WITHOUT_OF_FLUID),
    ],
)
def test_every_key_of_generated_fire_has_a_promise_or_a_reason_why_not(
    kind: str, promises: tuple[Promise, ...], without: dict[str, str]
) -> None:
    stated = {promise.key.removeprefix("source.") for promise in promises}

    def check(path: tuple[str, ...], name: str) -> None:
        for block in blocks_at(("source", f"<{kind}>", *path)):
            for key in key_docs(block):
                full = f"{name}{key}"
                if full in without:
                    continue
                assert full in stated or any(known.startswith(f"{full}.") for known in stated), full
                if not full.endswith("keyframes"):
                    check((*path, key), f"{full}.")

    check((), "")


@pytest.mark.parametrize("promise", ALL, ids=IDS)
def test_a_promise_is_what_the_text_of_its_key_says(promise: Promise) -> None:
    *path, name = promise.key.split(".")
    if path[0] == "source":
        path.insert(1, f"<{promise.fire}>")
    texts = [key_docs(block).get(name, "") for block in blocks_at(tuple(path))]
    assert any(promise.sentence in " ".join(text.split()) for text in texts), texts


def test_the_table_has_every_promise_and_all_are_kept() -> None:
    rows = [row.split(" | ") for row in page_text(PAGE).splitlines() if row.startswith("| `")]
    table = {(key.strip("| `"), says, figure) for key, says, figure, *_ in rows}
    for promise in ALL:
        row = promise.key, promise.sentence.replace("``", "`"), promise.label
        assert row in table, "run python -m tools.bench.promises --write"
    assert len(rows) == len(ALL)
    assert {row[-1] for row in rows} == {"yes |"}


@pytest.mark.parametrize("key", ["features.n", "buoyancy.lift", "flakes.stretch", "wind.level"])
def test_figures_of_the_table_are_measured_again(key: str) -> None:
    [promise] = [each for each in PROMISES if each.key == key]
    row, *_ = [row for row in page_text(PAGE).splitlines() if row.startswith(f"| `{key}` |")]
    low, high = (float(row.split(" | ")[k]) for k in (5, 7))
    found = [
        sum(measured(promise, value, seed) for seed in SEEDS) / len(SEEDS)
        for value in (promise.low, promise.high)
    ]
    assert found == pytest.approx([low, high], rel=0.02)


@pytest.mark.parametrize("promise", ALL, ids=IDS)
def test_a_promise_goes_its_way(promise: Promise) -> None:
    low, high = (measured(promise, value, 0, COARSE) for value in (promise.low, promise.high))
    assert high > low if promise.rises else high < low, f"{low:.3g} to {high:.3g}"

"""Recipe files as text: what is read, what is refused, and where it points."""

from collections.abc import Callable
from pathlib import Path
from textwrap import dedent

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fire_atlas.core.errors import RecipeError
from fire_atlas.recipe.document import parse_override, read_document

Write = Callable[..., Path]


def refusal(path: Path) -> str:
    with pytest.raises(RecipeError) as caught:
        read_document(path)
    assert caught.value.exit_code == 2
    return str(caught.value)


def bomb(levels: int) -> str:
    lines = ["a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]"]
    for i in range(1, levels):
        lines.append(f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]")
    return "\n".join(lines)


def test_every_key_and_item_knows_its_line(write: Write) -> None:
    path = write(
        dedent("""\
            # a comment
            source:
              path: x
            flakes: {rate: 3,
              life: [1,
                     2]}
            """)
    )
    document = read_document(path)
    lines = {key: origin.line for key, origin in document.origins.items()}
    assert document.values == {"source": {"path": "x"}, "flakes": {"rate": 3, "life": [1, 2]}}
    assert lines == {
        (): 1,
        ("source",): 2,
        ("source", "path"): 3,
        ("flakes",): 4,
        ("flakes", "rate"): 4,
        ("flakes", "life"): 5,
        ("flakes", "life", 0): 5,
        ("flakes", "life", 1): 6,
    }
    assert {origin.file for origin in document.origins.values()} == {path}


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1e-3", 0.001),
        ("!!str 1e-3", "1e-3"),
        ("1_000", 1000),
        ("2024-01-01", "2024-01-01"),
        ("off", False),
        ("~", None),
        ("'80'", "80"),
        ("''", ""),
        ("=", "="),
    ],
)
def test_scalars_are_read_as_yaml_says(write: Write, text: str, value: object) -> None:
    read = read_document(write(f"a: {text}")).values["a"]
    assert read == value
    assert type(read) is type(value)


def test_anchors_aliases_and_merge_keys_work(write: Write) -> None:
    path = write(
        dedent("""\
            base: &base {rate: 1, bursts: 2}
            more: &more
              rate: 5
              max: 9
            one: *base
            two:
              <<: [*base, *more]
              bursts: 3
            """)
    )
    document = read_document(path)
    assert document.values["one"] == {"rate": 1, "bursts": 2}
    assert document.values["two"] == {"rate": 1, "max": 9, "bursts": 3}
    assert document.origins["two", "max"].line == 4
    assert document.origins["two", "bursts"].line == 8


def test_a_byte_order_mark_is_no_error(write: Write) -> None:
    assert read_document(write("\ufeffseed: 1")).values == {"seed": 1}


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        ("", 1, "is empty"),
        ("# nothing", 1, "is empty"),
        ("- a\n- b", 1, "a recipe is made of `key: value` lines"),
        ("just text", 1, "a recipe is made of `key: value` lines"),
        ("a: 1\n---\nb: 2", 2, "a second document (---) begins here"),
        ("a: 1\nb: 2\na: 3", 3, "a: stands here a second time, after line 1"),
        ("f:\n  a: 1\n  a: 3", 3, "f.a: stands here a second time, after line 2"),
        ("a: !!python/name:os.system x", 1, "a: the tag !!python/name:os.system has no meaning"),
        ("a: !!set {x}", 1, "a: the tag !!set has no meaning"),
        ("a: !mine [x]", 1, "a: the tag !mine has no meaning"),
        ("a: !!str [x]", 1, "a: the tag !!str has no meaning"),
        ("a: !!int x", 1, "a: x cannot be read"),
        ("a: " + "9" * 5000, 1, "is too large for any key"),
        ("a: 1" + ":1" * 250_000, 1, "is too large for any key"),
        ("[1, 2]: x", 1, "a key must be a plain word"),
        ("b: 1\na:\nc: 2", 2, "a: has no value"),
        ("colors: #ff0000", 1, "colors: has no value"),
        ("colors: [#ff0000, 1]\nb: 2", 3, "quote colours: an unquoted # begins a comment"),
        ("a: 'b\nc: d", 2, "is no valid YAML"),
        ("a: b: c", 1, "is no valid YAML"),
        ("a:\n\tb: 1", 2, "indent with spaces"),
        ("a: *missing", 1, "is no valid YAML: found undefined alias"),
        ("a: 1\nb: \x07", 2, "control characters are not allowed"),
        ("a: &a [*a]", 1, "an alias (*) stands inside its own anchor (&)"),
        ("a: &a {b: {<<: *a}}", 1, "an alias (*) stands inside its own anchor (&)"),
        ("<<: 3", 1, "<<: merges blocks"),
    ],
)
def test_a_broken_recipe_is_refused_with_its_line(
    write: Write, text: str, line: int, message: str
) -> None:
    path = write(text)
    refused = refusal(path)
    assert refused.startswith(f"{path}:{line}: ")
    assert message in refused


@pytest.mark.timeout(30)
@pytest.mark.parametrize(
    "text",
    [
        bomb(9),
        bomb(9) + "\n<<: {x: *a8}",
        "[" * 1_000_000,
        "- " * 500_000 + "a",
        "a: [" + "1," * 400_000 + "]",
        "\n".join(f"b{i}: &b{i} {{x: {f'*b{i - 1}' if i else 1}}}" for i in range(100)),
        "\n".join(f"k{i}: 1" for i in range(60_000)),
    ],
    ids=["aliases", "merged aliases", "brackets", "dashes", "items", "alias chain", "keys"],
)
def test_a_recipe_that_would_grow_without_end_is_refused(write: Write, text: str) -> None:
    assert "is too big for a recipe" in refusal(write(text))


def test_a_file_over_a_mebibyte_is_refused(write: Write) -> None:
    assert "is larger than 1 MiB" in refusal(write("#" * (1 << 20) + "\n"))


def test_a_recipe_that_is_not_utf8_is_refused_with_the_byte(tmp_path: Path) -> None:
    path = tmp_path / "latin.yaml"
    path.write_bytes("seed: 1\nname: glühend\n".encode("latin-1"))
    assert refusal(path) == f"{path}:2: byte 16 of the file is not UTF-8; save it as UTF-8"


def test_a_missing_file_and_a_folder_are_refused(tmp_path: Path) -> None:
    assert "there is no such recipe file" in refusal(tmp_path / "none.yaml")
    assert "is a folder" in refusal(tmp_path)


@given(st.text())
def test_any_text_is_read_or_refused_with_advice(text: str) -> None:
    refused = "--set a: "
    try:
        values = parse_override(f"a={text}").values
    except RecipeError as error:
        refused = str(error)
    else:
        assert list(values) == ["a"]
    assert refused.startswith("--set a: ")

"""Names of files that every system can have."""

import pytest

from fire_atlas.core.output_file import is_portable

TOO_LONG = "x" * 256


@pytest.mark.parametrize("name", ["fire.png", "a b.txt", "feu-café.lua", "con_.txt", "x.con", "火"])
def test_a_plain_name_is_good_everywhere(name: str) -> None:
    assert is_portable(name)


@pytest.mark.parametrize(
    "name",
    ["", "CON", "con.txt", "Nul .x", "COM1.tar.gz", "lpt².x", "conin$", "a.", "a ", "a/b", "a\\b",
     "c:x", "a<b", "a>b", 'a"b', "a|b", "a?b", "a*b", "a\nb", "a\x1b[2J", "a\udcff", TOO_LONG],
)  # fmt: skip
def test_a_name_that_some_system_cannot_have_is_reported(name: str) -> None:
    assert not is_portable(name)

"""The package says that it is typed, wherever it is installed."""

from importlib.resources import files


def test_type_checkers_find_the_marker() -> None:
    assert (files("fire_atlas") / "py.typed").is_file()

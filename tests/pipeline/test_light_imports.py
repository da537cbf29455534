"""What a person waits for a hundred times a day imports nothing heavy."""

import subprocess
from importlib.util import find_spec
from pathlib import Path

import pytest

from tests.support.repo import environment, script

HEAVY = {"numpy", "cv2", "scipy", "PIL", "pydantic", "av", "rich", "jinja2", "filelock"}

_TELL = """
import atexit, sys
atexit.register(lambda: print("\\n".join(sys.modules), file=sys.stderr))
"""


def imported_by(*arguments: str | Path) -> set[str]:
    """Return the modules that a run of ``fire-atlas`` ends with."""
    done = subprocess.run(
        script(_TELL, *arguments), env=environment(), capture_output=True, text=True, timeout=60,
        check=True,
    )  # fmt: skip
    return set(done.stderr.split())


def test_an_up_to_date_build_imports_nothing_heavy(recipe: Path) -> None:
    modules = imported_by("build", recipe)
    assert "fire_atlas.outputs.manifest" in modules
    assert not modules & HEAVY
    assert "fire_atlas.pipeline.build" not in modules


def test_a_build_of_many_recipes_that_are_up_to_date_is_as_light(recipe: Path) -> None:
    assert not imported_by("build", recipe.parent, recipe) & HEAVY


@pytest.mark.parametrize("arguments", [["--help"], ["build", "--help"], ["--version"]])
def test_help_imports_nothing_heavy(arguments: list[str]) -> None:
    assert not imported_by(*arguments) & (HEAVY | {"yaml", "json"})


def test_a_build_from_png_imports_no_more_than_it_needs(recipe: Path) -> None:
    modules = imported_by("build", recipe, "--force")
    assert {"fire_atlas.pipeline.build", "numpy", "cv2"} <= modules
    assert not modules & {"PIL", "scipy", "av", "jinja2", "etcpak", "OpenEXR"}


UNASKED = {
    f"fire_atlas.{each}"
    for each in (
        "maps.haze", "heat.encode", "maps.motion", "maps.vectors.estimate", "formats.movies.write",
        "formats.textures.gpu_texture", "pipeline.animation.change_wind", "sources.sprites",
        "timeline.looping", "timeline.retiming",
    )
}  # fmt: skip


def test_a_build_imports_only_what_its_recipe_asks_for(recipe: Path) -> None:
    assert all(map(find_spec, UNASKED))
    plain = imported_by("build", recipe, "--force", "--set", "timeline.loop=none")
    assert plain & UNASKED == set()
    loops = imported_by("build", recipe, "--force", "--set", "maps.motion=godot")
    assert {"fire_atlas.timeline.looping", "fire_atlas.maps.vectors.estimate"} <= loops

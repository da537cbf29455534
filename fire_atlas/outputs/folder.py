"""Where the outputs of a recipe go."""

from collections.abc import Callable
from pathlib import Path

from fire_atlas.core.errors import OutputError
from fire_atlas.outputs.recovery import recover


def default_folder(recipe: Path) -> Path:
    """Return where the outputs of ``recipe`` go when nobody says: ``build`` beside it.

    Raises:
        OutputError: It is a link that leads elsewhere. A recipe that came from a stranger must not
            choose which of the user's folders is written to.
    """
    folder = recipe.parent / "build"
    if not folder.resolve().is_relative_to(recipe.parent.resolve()):
        raise OutputError(
            f"{folder}: is a link to {folder.resolve()}, outside the recipe's folder; if you want "
            f"the outputs there, say so with -o"
        )
    return folder


def recover_default(recipe: Path, name: str, note: Callable[[str], None]) -> None:
    """Undo the commit of a build that was killed in the folder that ``default_folder`` names."""
    try:
        out = default_folder(recipe)
    except OutputError:
        return  # it is a link that only a build with -o follows
    recover(out, name, note)

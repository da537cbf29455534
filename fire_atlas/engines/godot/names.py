"""Names of Godot's files, nodes, animations and resources, and values as its text files hold them.

A uid is Godot's name of a resource: 63 bits, in text of the letters a-y and the digits 0-8.
Scenes of a game refer to it, so it must never change: it is derived from the file's name, and one
that is in a file already is kept.
"""

import hashlib
import re
from collections.abc import Iterable
from typing import TYPE_CHECKING

from fire_atlas.core.errors import OutputError
from fire_atlas.core.output_file import as_file_name, is_portable

if TYPE_CHECKING:  # names are needed where a build is taken from a cache, and pixels are not
    from fire_atlas.atlas.sheet import AtlasSheet
    from fire_atlas.formats.product import Product

FRAMES_ENDING, SCENE_ENDING, IMPORT_ENDING = ".tres", ".tscn", ".import"
"""Of the SpriteFrames and the scene of each scale, and of the import settings of a file."""

SPRITE_ENDING, BOX_ENDING = ".tres", ".stylebox.tres"
"""Of a single sprite, after its name; and of a box that stretches it as a nine-patch."""

UID_ENDING = ".uid"
"""Of the file that has the uid of a script or a shader."""

FLAKE_PLAYER, FLAKE_TRACKS, FLAKE_TABLES = "_flakes.gd", "_flake_tracks.gd", "_flakes.tres"
"""Of the script that flies flakes, of that which holds them, and of their tables."""

SPACE_PLAYER, SPACE_TABLES = "_flakes_3d.gd", "_flakes_3d.tres"
SPACE_SCENE = "_flakes_3d.tscn"
"""Of the same for flakes in three dimensions, and of their scene."""

LAMP = "_light.gd"
"""Of the script of lamps."""

START, WIND, PHASES = "_start.gd", "_wind.gd", "_phases.gd"
"""Of the script that plays loops, each from a moment of its own; of that of a fire that passes from
wind to wind, and of one that is lit and put out, which do so too."""

HEAT_SHADER, HEAT_PLAYER = "_heat.gdshader", "_heat.gd"
HAZE_SHADER, HAZE_PLAYER = "_haze.gdshader", "_haze.gd"
MOTION_SHADER, MOTION_PLAYER = "_motion.gdshader", "_motion.gd"

FILM_SCENE, PARTICLES_SCENE = "_film.tscn", "_particles.tscn"
HAZE_FRAMES, HAZE_SCENE = "_haze.tres", "_haze.tscn"
MOTION_MATERIAL, MOTION_SCENE = "_motion.tres", "_motion.tscn"

_VIEW = re.compile(r"view_\d+")
"""The word for a view in the name of an animation."""

_ALPHABET = "abcdefghijklmnopqrstuvwxy012345678"
_STATED_UID = re.compile(rb'^(?:\[gd_[^\]\n]* uid="|uid=")?(uid://[a-y0-8]{1,13})\b', re.MULTILINE)
"""Where a file states its uid: in its first tag, or in its import settings."""


def number(value: float) -> str:
    """Return a number in plain decimals: ``24``, ``-38.4``."""
    text = f"{value:.6f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def real(value: float) -> str:
    """Return a number that Godot does not take for an integer: ``24.0``."""
    text = number(value)
    return text if "." in text else f"{text}.0"


def quoted(text: str) -> str:
    """Return a string literal in double quotes."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'


def node_name(name: str) -> str:
    """Return a node's name for outputs called ``name``: ``fire-ball.v2`` becomes ``FireBallV2``."""
    return "".join(word[:1].upper() + word[1:] for word in re.split(r"[^A-Za-z0-9]+", name)) or "_"


def title_in_godot(animation: str) -> str:
    """Return the name of an animation in Godot, whose editor allows no ``/`` and ``,``."""
    return animation.replace("/", "_").replace(",", " ")


def titles(animations: Iterable[str]) -> dict[str, str]:
    """Return the names of animations in Godot, by those in the atlas.

    Raises:
        OutputError: Two would have the same name.
    """
    made: dict[str, str] = {}
    for animation in animations:
        title = title_in_godot(animation)
        if title in made.values():
            other = next(name for name in made if made[name] == title)
            raise OutputError(
                f"godot cannot tell the animations {other} and {animation} apart: its "
                f"editor allows no `/` and `,`, so both would be called {title}; rename the files "
                f"of one"
            )
        made[animation] = title
    return made


def stems_of_variants(sheet: "AtlasSheet") -> list[str]:
    """Return what begins the names in Godot of the animations of each variant of a sheet's fires;
    nothing of fires that have one only."""
    stems = dict.fromkeys(animation.stem for animation in sheet.animations)
    return [title_in_godot(stem) for stem in stems if stem]


def single_stems(sheet: str, singles: Iterable[str]) -> dict[str, str]:
    """Return the file stems of the single sprites of a sheet, by their names, whose ``/`` is ``-``.

    Raises:
        OutputError: Two would be one file, or a name is too long for one.
    """
    stems, taken = dict[str, str](), dict[str, str]()
    for name in singles:
        stem = f"{sheet}.{name.replace('/', '-')}"
        other = taken.setdefault(as_file_name(stem), name)
        if other != name:
            raise OutputError(
                f"godot cannot tell the sprites {other} and {name} apart: the file of both would "
                f"be {stem}{SPRITE_ENDING}; rename the file of one of them"
            )
        if not is_portable(stem + BOX_ENDING):
            raise OutputError(
                f"godot needs a file for the sprite {name}, whose name is too long for one; "
                f"rename it"
            )
        stems[name] = stem
    return stems


def without_view(animation: str) -> str:
    """Return the name of an animation without the word for its view; empty if it has no other."""
    return "/".join(word for word in animation.split("/") if not _VIEW.fullmatch(word))


def uid_of(product: "Product", file: str, stated_in: str | None = None) -> str:
    """Return the uid of an output: the one stated already, or one derived from its name.

    Args:
        product: What is exported.
        file: Name of the output.
        stated_in: Name of the file that states the uid, if that is not the output itself.
    """
    stated = _STATED_UID.search(product.existing(stated_in or file) or b"")
    return stated[1].decode() if stated else derived_uid(product.name, file)


def derived_uid(name: str, file: str) -> str:
    """Return the uid derived from the names of a build and of its file, whatever the folder."""
    digest = hashlib.sha256(f"fire-atlas {name}/{file}".encode()).digest()
    return f"uid://{_base_34(int.from_bytes(digest[:8], 'big') >> 1)}"


def _base_34(number: int) -> str:
    """Return a number in base 34, as Godot writes uids."""
    digits = ""
    while number:
        number, digit = divmod(number, len(_ALPHABET))
        digits = _ALPHABET[digit] + digits
    return digits or _ALPHABET[0]

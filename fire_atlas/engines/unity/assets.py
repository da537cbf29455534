"""Texts that the files of a build and those of the package have in common.

These are the ``.meta`` of a file, the players of flakes and heat, shaders, and values in Unity's
YAML.
"""

import re
from dataclasses import asdict, dataclass
from typing import NamedTuple

import numpy as np

from fire_atlas.effect.flakes.drawing import HALO_LIGHT, HALO_WIDTH
from fire_atlas.engines.unity.names import (
    ASSEMBLY_ENDING,
    CLIP_ENDING,
    CONTROLLER_ENDING,
    MATERIAL_ENDING,
    PREFAB_ENDING,
    SCRIPT_ENDING,
    SHADER_ENDING,
    TABLE_ENDING,
)
from fire_atlas.formats.templates.jinja import rendered
from fire_atlas.recipe.effect import MAX_VARIANTS

_PLAIN_SCALAR = re.compile(r"[A-Za-z_][\w./@+-]*( [\w./@+-]+)*", re.ASCII)
"""Text that needs no quotes in YAML."""

_ESCAPED = {'"': '\\"', "\\": "\\\\"}

_UNIVERSAL = '"com.unity.render-pipelines.universal": "12.0"'
"""The package of the Universal Render Pipeline, from the version of Unity 2021.3 on."""


class _AssetType(NamedTuple):
    """Unity's importer of a type of file, and the local id of its main object."""

    importer: str
    main_id: int = 0


_ASSET_TYPES = {
    CLIP_ENDING: _AssetType("NativeFormatImporter", 7400000),
    CONTROLLER_ENDING: _AssetType("NativeFormatImporter", 9100000),
    MATERIAL_ENDING: _AssetType("NativeFormatImporter", 2100000),
    PREFAB_ENDING: _AssetType("PrefabImporter"),
    SHADER_ENDING: _AssetType("ShaderImporter"),
    SCRIPT_ENDING: _AssetType("MonoImporter"),
    TABLE_ENDING: _AssetType("TextScriptImporter"),
    ".json": _AssetType("TextScriptImporter"),
    ".md": _AssetType("TextScriptImporter"),
    ASSEMBLY_ENDING: _AssetType("AssemblyDefinitionImporter"),
}
"""Asset types by the ending of the file name."""

_PACKAGE_MANIFEST = "package.json"
_FOLDER = _AssetType("DefaultImporter")


def meta_text(file: str, guid: str) -> str:
    """Return the ``.meta`` of a new file, or of a folder, whose name has no ending."""
    name, dot, ending = file.rpartition(".")
    asset_type = _ASSET_TYPES[f".{ending}"] if name and dot else _FOLDER
    importer = "PackageManifestImporter" if file == _PACKAGE_MANIFEST else asset_type.importer
    return rendered(
        "unity/asset.meta.j2",
        guid=guid,
        importer=importer,
        main_id=asset_type.main_id,
        folder=asset_type is _FOLDER,
    )


def shader_text(template: str, shader: str, name: str, *, universal: bool) -> str:
    """Return a shader of a template in ``templates/unity``.

    Args:
        template: File name of the template.
        shader: Name of the shader in Unity's menus.
        name: What the shader is for, for its comments.
        universal: Whether it has passes of its own for the Universal Render Pipeline.
    """
    return rendered(
        f"unity/{template}",
        shader=shader,
        name=name,
        universal=_UNIVERSAL if universal else "",
        halo_light=HALO_LIGHT,
        halo_width=HALO_WIDTH,
    )


@dataclass(frozen=True, slots=True)
class ComponentNames:
    """What the script of a component calls things.

    Attributes:
        class_name, namespace: Of the component.
        heading: Its first comment.
        name: The fire that it plays, for its other comments.
        menu: Its place in the menu *Add Component*.
        mesh: The mesh it makes.
    """

    class_name: str
    namespace: str
    heading: str
    name: str
    menu: str
    mesh: str


def player_text(names: ComponentNames, file: str) -> str:
    """Return the script that plays flakes of a file, as its messages name it."""
    halo = {"halo_light": HALO_LIGHT, "halo_width": HALO_WIDTH}
    return rendered(
        "unity/player.cs.j2", (), **asdict(names), file=file, most_sets=MAX_VARIANTS, **halo
    )


def heat_player_text(names: ComponentNames) -> str:
    """Return the script that plays pages of heat."""
    return rendered("unity/heat_player.cs.j2", (), **asdict(names))


def start_text(names: ComponentNames) -> str:
    """Return the script that lets a loop begin at a moment of its own."""
    return rendered("unity/start.cs.j2", (), **asdict(names))


def assembly_text(assembly: str, *, editor: bool = False) -> str:
    """Return an assembly definition; that of an ``editor`` assembly is left out of games."""
    return rendered("unity/assembly.asmdef.j2", assembly=assembly, editor=editor)


def scalar(text: str) -> str:
    """Return text as a YAML scalar in one line: plain, or quoted in ASCII."""
    if _PLAIN_SCALAR.fullmatch(text):
        return text
    return f'"{"".join(map(_escaped, text))}"'


def single(value: float) -> str:
    """Return the shortest text from which float32 reads the same number."""
    return np.format_float_positional(np.float32(value), trim="-")


def _escaped(character: str) -> str:
    code = ord(character)
    if 32 <= code < 127:
        return _ESCAPED.get(character, character)
    return f"\\u{code:04X}" if code < 0x10000 else f"\\U{code:08X}"

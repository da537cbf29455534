"""Unity's text held against the type trees of its own editor, which UnityPy ships."""

import re
from collections.abc import Iterator
from functools import cache
from typing import Any, NamedTuple

import yaml

VERSION = "2021.3.0f1"

IMPORTERS = {
    "TextureImporter": 1006, "ShaderImporter": 1007, "TextScriptImporter": 1031,
    "NativeFormatImporter": 1034, "MonoImporter": 1035, "PrefabImporter": 468431735,
    "DefaultImporter": 1030, "PackageManifestImporter": 1896753126,
    "AssemblyDefinitionImporter": 294290339,
}  # fmt: skip

_GROUPS = ("mipmaps", "bumpmap")
"""Blocks of a TextureImporter's text whose keys are its own fields."""

_ABSENT = {
    "serializedVersion", "objectHideFlags", "correspondingSourceObject", "prefabInstance",
    "prefabAsset", "name", "usedFileIDs", "importLog", "output", "flipGreenChannel",
    # Of the editor's memory only: no .meta has them.
    "addedObjectFileIDs", "isPrefabVariant", "preprocessorOverride",
}  # fmt: skip

_INTEGERS = {
    "int",
    "unsigned int",
    "SInt64",
    "UInt64",
    "UInt8",
    "SInt16",
    "UInt16",
    "bool",
    "Type*",
}


class Node(NamedTuple):
    """A field of the editor's type tree."""

    type: str
    name: str
    version: int
    fields: tuple["Node", ...]


class Loader(yaml.SafeLoader):
    """Reads ``yes`` and dates as the text they are to Unity."""


Loader.yaml_implicit_resolvers = {
    first: [(tag, pattern) for tag, pattern in found if tag.endswith((":int", ":float", ":null"))]
    for first, found in yaml.SafeLoader.yaml_implicit_resolvers.items()
}


@cache
def tree(class_id: int) -> Node:
    """Return the type tree of a class in ``VERSION``."""
    # Its 900 classes take over a second to import: not of every process that collects tests.
    from UnityPy.helpers.Tpk import get_typetree
    from UnityPy.helpers.UnityVersion import UnityVersion

    trees = get_typetree()
    wanted = int(UnityVersion.from_str(VERSION))
    fitting = [c for v, c in trees.ClassInformation[class_id] if int(v) <= wanted]

    def node(index: int) -> Node:
        raw = trees.NodeBuffer[index]
        name, kind = trees.StringBuffer[raw.Name], trees.StringBuffer[raw.TypeName]
        return Node(kind, name, raw.Version, tuple(node(i) for i in raw.SubNodes))

    return node(fitting[-1].EditorRootNode)


def documents(text: str) -> Iterator[tuple[int, int, dict[str, Any]]]:
    """Yield class id, file id and fields of each object of an asset."""
    pattern = r"^--- !u!(\d+) &(-?\d+)\n(.*?)(?=^--- |\Z)"
    for class_id, file_id, body in re.findall(pattern, text, re.DOTALL | re.MULTILINE):
        (fields,) = yaml.load(body, Loader).values()
        yield int(class_id), int(file_id), fields


def importer(text: str) -> tuple[str, dict[str, Any]]:
    """Return the importer of a ``.meta`` and its fields."""
    meta = yaml.load(text, Loader)
    (name,) = [key for key in meta if key.endswith("Importer")]
    return name, meta[name]


def faults(file: str, text: str) -> list[str]:
    """Say all that the editor's type trees know better."""
    if not file.endswith(".meta"):
        return [
            fault
            for class_id, file_id, fields in documents(text)
            for fault in _faults(tree(class_id), fields, f"{file}&{file_id}", class_id == 114)
        ]
    name, fields = importer(text)
    flat = {k: v for k, v in fields.items() if k not in _GROUPS}
    for group in _GROUPS:
        flat |= fields.get(group, {})
    root = tree(IMPORTERS[name])
    return _faults(root._replace(fields=tuple(map(_as_in_meta, root.fields))), flat, file)


def _as_in_meta(node: Node) -> Node:
    name = node.name.removeprefix("m_")
    fields = tuple(map(_as_in_meta, node.fields))
    return node._replace(name=name[:1].lower() + name[1:], fields=fields)


def _faults(node: Node, value: Any, where: str, open_: bool = False) -> list[str]:
    """Compare a value with its field; an ``open_`` one has fields of its script as well."""
    kind = node.type
    if kind in _INTEGERS:
        return [] if isinstance(value, int) else [f"{where}: {value!r} is no integer"]
    if kind in ("float", "double"):
        return [] if isinstance(value, (int, float)) else [f"{where}: {value!r} is no number"]
    if kind.startswith("PPtr<"):
        fits = isinstance(value, dict) and (
            value.keys() <= {"fileID", "guid", "type"} or value == {"instanceID": 0}
        )
        return [] if fits else [f"{where}: {value!r} is no reference"]
    if kind in ("map", "pair", "string") or kind.startswith(("GUID", "Hash128")):
        return []
    if node.fields and node.fields[0].type == "Array":
        return _list_faults(node.fields[0].fields[1], value, where)
    if not isinstance(value, dict):
        return [f"{where}: {value!r} is no {kind}"]
    return _block_faults(node, value, where, open_)


def _list_faults(item: Node, value: Any, where: str) -> list[str]:
    if item.type in _INTEGERS and (value is None or isinstance(value, (str, int))):
        return []  # written as one hexadecimal number
    if not isinstance(value, list):
        return [f"{where}: {value!r} is no list"]
    return [f for i, each in enumerate(value) for f in _faults(item, each, f"{where}[{i}]")]


def _block_faults(node: Node, value: dict[str, Any], where: str, open_: bool) -> list[str]:
    known = {field.name: field for field in node.fields}
    found = []
    version = value.get("serializedVersion", 1)
    if version != node.version:
        found.append(f"{where}: version {version}, where {VERSION} writes {node.version}")
    for name, inner in value.items():
        if name in known:
            found += _faults(known[name], inner, f"{where}.{name}")
        elif name != "serializedVersion" and not open_:
            found.append(f"{where}.{name}: unknown")
    missing = known.keys() - value.keys() - _ABSENT
    return found + [f"{where}.{name}: missing" for name in sorted(missing)]

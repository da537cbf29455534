"""What Unity knows assets and their parts by: made from names, so that no rebuild changes them."""

import hashlib
import re

_GUID = re.compile(r"^guid: ([0-9a-f]{32})\s*$", re.MULTILINE)


def guid_of(namespace: str, file: str) -> str:
    """Return the GUID of a file: 32 hexadecimal digits from its name, wherever it lies."""
    return hashlib.md5(f"fire-atlas/unity/{namespace}/{file}".encode()).hexdigest()


def part_id(kind: str, name: str) -> int:
    """Return the id, 64 bits with a sign, of the part called ``name`` inside a file."""
    digest = hashlib.sha256(f"{kind}/{name}".encode()).digest()
    return int.from_bytes(digest[:8], "little", signed=True) or 1


def sprite_guid(name: str) -> str:
    """Return what the Sprite Editor knows a sprite by."""
    return hashlib.md5(f"sprite/{name}".encode()).hexdigest()


def guids_in(meta: str) -> list[str]:
    """Return the GUIDs that a ``.meta`` states: a sound one has one."""
    return _GUID.findall(meta)

"""Values as Unity writes them into its YAML."""

import re

import numpy as np

_PLAIN = re.compile(r"[A-Za-z_][\w./@+-]*( [\w./@+-]+)*", re.ASCII)
"""Text that YAML takes as it stands."""

_ESCAPED = {'"': '\\"', "\\": "\\\\"}


def scalar(text: str) -> str:
    """Return text as one line of YAML: as it stands, or quoted and in ASCII."""
    if _PLAIN.fullmatch(text):
        return text
    return f'"{"".join(map(_character, text))}"'


def single(value: float) -> str:
    """Return a number with as many digits as tell it from all others of single precision."""
    return np.format_float_positional(np.float32(value), trim="-")


def _character(character: str) -> str:
    code = ord(character)
    if 32 <= code < 127:
        return _ESCAPED.get(character, character)
    return f"\\u{code:04X}" if code < 0x10000 else f"\\U{code:08X}"

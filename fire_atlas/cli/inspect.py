"""The command ``inspect``: describe a built atlas on one screen, in tables, or as JSON."""

import json
from argparse import Namespace
from collections.abc import Iterator, Sequence

from fire_atlas.api import inspect_atlas
from fire_atlas.cli.text import printable
from fire_atlas.formats.atlas.texture_packer import read_atlas
from fire_atlas.formats.templates.context import context_of
from fire_atlas.preview.inspection import Inspection
from fire_atlas.preview.tables import DETAILS, summary


def _details(found: Inspection, names: Sequence[str]) -> Iterator[str]:
    for name in names:
        yield from list(DETAILS[name](found).lines()) or [f"{name}: none"]


def run(args: Namespace) -> int:
    """Print a summary of a built atlas, details by their names, or the data templates get of it."""
    if args.context:
        print(json.dumps(context_of(read_atlas(args.subject).sheet), indent=2))
        return 0
    found = inspect_atlas(args.subject)
    if args.json:
        print(json.dumps(found.as_json(), indent=2, default=list))
        return 0
    for line in summary(found) if not args.details else _details(found, args.details):
        print(printable(line))
    return 0

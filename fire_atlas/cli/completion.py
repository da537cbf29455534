"""The command ``completion``: print a script by which a shell completes commands and options."""

from argparse import Namespace

import shtab

from fire_atlas.cli.arguments import all_parsers, path_of


def run(args: Namespace) -> int:
    """Print the script for a shell."""
    parser, commands = all_parsers()
    for command in commands.values():
        for action in command._actions:
            if action.type is path_of:
                action.complete = shtab.FILE  # type: ignore[attr-defined]
    print(shtab.complete(parser, args.shell))
    return 0

"""The command line. Nothing heavy is imported before a command needs it."""

import atexit
import gc
import os
import sys
from argparse import Namespace
from collections.abc import Sequence
from importlib import import_module
from io import TextIOWrapper

from fire_atlas.cli.arguments import parse
from fire_atlas.cli.failure import exit_code_of, print_error
from fire_atlas.core.cpu import pin_kernels


def main(argv: Sequence[str] | None = None) -> int:
    """Run ``fire-atlas`` with ``argv`` (default: this process's) and return its exit code."""
    arguments = sys.argv[1:] if argv is None else list(argv)
    _open_missing_streams()
    try:
        return _run(parse(arguments))
    except BrokenPipeError:  # whoever read our output has seen enough: `fire-atlas schema | head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except (Exception, KeyboardInterrupt) as error:
        print_error(error, with_traceback="-vv" in arguments)
        return exit_code_of(error)


def _open_missing_streams() -> None:
    """Stand in for those of stdin, stdout and stderr that this process was started without.

    The files it opens would take their numbers otherwise, and what is printed would go there.
    """
    while (number := os.open(os.devnull, os.O_RDWR)) <= 2:
        os.set_inheritable(number, True)
    os.close(number)
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: PTH123, SIM115
        elif isinstance(stream := getattr(sys, name), TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")  # file names need not be text


def _run(args: Namespace) -> int:
    """Run the command that ``args`` name; each is the function ``run`` of a module of its name."""
    pin_kernels()
    # Importing makes many objects and no garbage; looking for it as often as by default would take
    # a tenth of that time. At the end all memory goes at once: a last look takes as long again.
    gc.set_threshold(50_000)
    atexit.register(gc.freeze)
    command = import_module(f"fire_atlas.cli.{args.command}")
    code = int(command.run(args))
    sys.stdout.flush()
    return code

"""The command line: one module per command, imported only when it runs."""

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
    """Run ``fire-atlas`` with ``argv`` (default: ``sys.argv``) and return its exit code."""
    arguments = sys.argv[1:] if argv is None else list(argv)
    _open_missing_streams()
    try:
        return _run(parse(arguments))
    except BrokenPipeError:  # the reader has closed the pipe: `fire-atlas schema | head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except (Exception, KeyboardInterrupt) as error:
        print_error(error, with_traceback="-vv" in arguments)
        return exit_code_of(error)


def _open_missing_streams() -> None:
    """Open stdin, stdout and stderr on the null device if this process has none.

    Otherwise files opened later would get their numbers, and what is printed would go there.
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
    """Run the command in ``args``: the function ``run`` of the module with its name."""
    pin_kernels()
    # Imports create many objects and no garbage: garbage collection at the default rate would take
    # a tenth of their time, and a last collection at exit as long again. So many objects a short
    # build does not create.
    gc.set_threshold(200_000)
    atexit.register(gc.freeze)
    command = import_module(f"fire_atlas.cli.{args.command}")
    code = int(command.run(args))
    sys.stdout.flush()
    return code

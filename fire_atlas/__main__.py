"""Entry point of ``fire-atlas`` and ``python -m fire_atlas``."""

import sys

from fire_atlas.core.interruption import end_on_signals, ignore_signals


def main() -> int:
    """Run the command line of this process and return its exit code; signals end it."""
    end_on_signals()  # before anything else is imported

    from fire_atlas.cli import main as run

    code = run()
    ignore_signals()
    return code


if __name__ == "__main__":
    sys.exit(main())

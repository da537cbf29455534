"""Show errors on the command line, and give them exit codes."""

import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING

from fire_atlas.cli.text import printable
from fire_atlas.core.errors import FireAtlasError
from fire_atlas.core.interruption import EXIT_CODE, MESSAGE

if TYPE_CHECKING:  # --help needs no paths
    from pathlib import Path


class Failures:
    """Reports the failures of single recipes and lets the others continue."""

    def __init__(
        self,
        with_traceback: bool,
        report: Callable[[str], None] = lambda message: None,
        fail_fast: bool = False,
        known: "Mapping[Path, str] | None" = None,
    ) -> None:
        """Call ``report`` with the message of every failure, besides printing it on stderr.

        ``known``: messages about recipes that were printed already, and are not printed again.
        """
        self.worst_code = 0
        self.of_recipes: dict[Path, str] = {}
        self._known = known or {}
        self._fail_fast = fail_fast
        self._with_traceback = with_traceback
        self._report = report

    @property
    def must_stop(self) -> bool:
        """Whether there was a failure and the others may not continue: ``--fail-fast``."""
        return self._fail_fast and self.worst_code > 0

    def add(self, code: int, printed: str) -> None:
        """Add a build that another process has reported: its exit code, and what it printed."""
        for line in printed.splitlines():
            print(printable(line), file=sys.stderr)
        self.worst_code = max(self.worst_code, code)

    @contextmanager
    def caught(self, recipe: "Path | None" = None) -> Iterator[None]:
        """Report exceptions raised inside, about ``recipe``, and continue after it.

        Only interruptions and a closed output pipe are raised.
        """
        try:
            yield
        except BrokenPipeError:  # nobody reads the output any more
            raise
        except Exception as error:
            message = message_of(error)
            self._report(message)
            if recipe is None or self._known.get(recipe) != message:
                print_error(error, self._with_traceback)
            if recipe is not None:
                self.of_recipes[recipe] = message
            self.worst_code = max(self.worst_code, exit_code_of(error))


def exit_code_of(error: BaseException) -> int:
    """Return the exit code of a command that ends with ``error``."""
    if isinstance(error, FireAtlasError):
        return error.exit_code
    return EXIT_CODE if isinstance(error, KeyboardInterrupt) else 1


def message_of(error: BaseException) -> str:
    """Return the message for the user."""
    match error:
        case FireAtlasError():
            return str(error)
        case KeyboardInterrupt():
            return MESSAGE
        case MemoryError():
            return "out of memory; a smaller source.height or atlas.max_size needs less"
        case OSError() if error.strerror:
            about = f"{error.filename}: " if error.filename else ""
            return f"{about}{error.strerror}"
    return f"{type(error).__name__}: {error} (a bug in fire-atlas; -vv shows where)"


def print_error(error: BaseException, with_traceback: bool = False) -> None:
    """Print ``error`` on stderr, each line of its message with a prefix."""
    if with_traceback:
        import traceback

        for text in traceback.format_exception(error):
            is_place = text.startswith((" ", "\n"))  # else a message, which has no lines here
            for line in text.splitlines() if is_place else [text.rstrip("\n")]:
                print(printable(line), file=sys.stderr)
    for line in error.lines if isinstance(error, FireAtlasError) else [message_of(error)]:
        print(printable(f"error: {line}"), file=sys.stderr)

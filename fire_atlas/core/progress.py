"""How a build tells what it is doing."""

from typing import Protocol


class Progress(Protocol):
    """Told about every stage of a build; the command line decides how people see it."""

    def stage(self, name: str, total: int) -> None:
        """Stage ``name`` begins; it has ``total`` steps."""

    def advance(self, done: int = 1) -> None:
        """``done`` more steps of the stage are done."""

    def note(self, message: str) -> None:
        """Something worth knowing, as a sentence."""


class Silent:
    """Progress that nobody watches."""

    def stage(self, name: str, total: int) -> None:
        """Say nothing."""

    def advance(self, done: int = 1) -> None:
        """Say nothing."""

    def note(self, message: str) -> None:
        """Say nothing."""

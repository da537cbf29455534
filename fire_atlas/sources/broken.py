"""Errors about the bytes of a file. The caller, which knows the path, raises ``SourceError``."""


class BrokenFileError(Exception):
    """The bytes are cut short or damaged; the message says where."""


class UnexpectedAnimationError(Exception):
    """The file is an animation, but a still image is needed."""

    def __init__(self) -> None:
        """Set the message, which says what was expected and what to do."""
        super().__init__(
            "is an animation where one still image was expected; to use an animation, give that "
            "file alone as path, without grid"
        )

"""Errors about the bytes of a file; whoever knows its path makes a ``SourceError`` of them."""


class BrokenFileError(Exception):
    """The bytes are not a whole file of their format; the message says where it breaks."""


class UnexpectedAnimationError(Exception):
    """The file is whole, but holds many frames where one picture is needed."""

    def __init__(self) -> None:
        """State what was expected and what to do."""
        super().__init__(
            "is an animation where one still image was expected; an animation is given alone "
            "as path, without grid"
        )

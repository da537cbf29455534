"""What is wrong in a recipe, key by key."""

from dataclasses import dataclass

from fire_atlas.recipe.origin import KeyPath, dotted


@dataclass(frozen=True, slots=True)
class Problem:
    """A key that is wrong, and what would be right.

    Attributes:
        path: The key, from the top of the recipe; in a ``ContradictionError``, from its block.
        message: What is wrong with it and what to do, as it follows the key: ``rotate: MESSAGE``.
    """

    path: KeyPath
    message: str


class ContradictionError(ValueError):
    """Keys of one block exclude each other. Raised by the validator of the block's model.

    Attributes:
        problems: At least one; each names the key that has to give way.
    """

    def __init__(self, *problems: Problem) -> None:
        """Join the problems of one block."""
        super().__init__("; ".join(f"{dotted(each.path)}: {each.message}" for each in problems))
        self.problems = problems

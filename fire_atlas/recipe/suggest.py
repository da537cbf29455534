"""Guesses at what was meant, for error messages."""

from collections.abc import Iterable


def did_you_mean(word: str, choices: Iterable[str], prefix: str = "") -> str:
    """Return ``"; did you mean X?"`` for the choice nearest to ``word``, or ``""`` if none is near.

    ``prefix`` goes before the choice: the block a key is in, for instance.
    """
    from difflib import get_close_matches  # only a mistake has to pay for this import

    spelt = {choice.lower(): choice for choice in choices}
    near = get_close_matches(word.lower(), spelt, n=1)
    return f"; did you mean {prefix}{spelt[near[0]]}?" if near else ""

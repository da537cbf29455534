"""What a build found out about its motion vectors, read back from the manifest."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from fire_atlas.core.errors import SourceError
from fire_atlas.outputs.manifest import manifest_name


class Proven(NamedTuple):
    """What the build said of an animation's vectors; the name is empty where there is only one.

    ``gain`` and ``others`` are parts of plain blending's error, with the right signs and the other
    choices; None where the animation was too short to tell.
    """

    animation: str
    gain: float | None
    others: tuple[float, ...]
    written: bool

    def sentence(self) -> str:
        """Say how much motion vectors help, as the build found out."""
        vectors = f"motion vectors of {self.animation}" if self.animation else "motion vectors"
        if self.gain is None:
            return f"{vectors}: none, the animation is too short to test them"
        if not self.written:
            return f"{vectors}: none, plain blending is as close to frames that were held out"
        sign = "right" if self.gain >= max(self.others) else "WRONG"
        others = ", ".join(f"{100 * gain:+.0f} %" for gain in self.others)
        gained = f"{100 * self.gain:.0f} % closer than plain blending"
        return f"{vectors}: {gained}; sign {sign} (others {others})"


def read_proofs(folder: Path, title: str) -> list[Proven]:
    """Return what the manifest of the build ``title`` says; nothing where there is none."""
    path = folder / manifest_name(title)
    if not path.is_file():
        return []
    try:
        return list(_proven("", json.loads(path.read_bytes())["statistics"]))
    except (KeyError, TypeError, ValueError, AttributeError, RecursionError) as error:
        raise SourceError(
            f"{path}: is no manifest that fire-atlas wrote ({type(error).__name__}: {error}); "
            f"build the recipe again"
        ) from error


def _proven(name: str, statistics: dict[str, Any]) -> Iterator[Proven]:
    """Yield what is said anywhere in ``statistics``, of one animation, several, or of members."""
    if "motion" in statistics:
        yield _one(name, statistics["motion"])
    for several in ("animations", "members", "motions"):
        inner = statistics.get(several)
        if isinstance(inner, dict):
            for key, figures in inner.items():
                yield from _proven(f"{name}/{key}" if name else str(key), figures)


def _one(name: str, figures: dict[str, Any] | None) -> Proven:
    if figures is None:
        return Proven(name, None, (), False)
    others = tuple(float(each) for each in figures["other_signs"])
    return Proven(name, float(figures["gain"]), others, bool(figures["written"]))

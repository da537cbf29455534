"""Fire that is lit and put out: a game that walks its graph of states."""

from dataclasses import dataclass

from tests.support.graph import GraphWalker, Place

OUT: Place = ("out", 0)
"""Where a fire is that was put out at once: nothing is drawn."""


@dataclass(frozen=True)
class PhaseWalker(GraphWalker):
    """A fire that is lit and put out."""

    @property
    def end(self) -> Place:
        """The last frame of a fire that is put out, in which it rests."""
        if not self.graph.of_phase("extinguish"):
            return OUT
        return "extinguish", self.count("extinguish") - 1

    def after(self, place: Place, is_lit: bool) -> Place:
        """Return what a game shows after a frame, when the fire is to burn or to be out: as
        `docs/command-line.md` (The preview page) says."""
        name, frame = place
        if place == self.end:
            first = "ignite" if self.graph.of_phase("ignite") else "burn"
            return (first, 0) if is_lit else place
        if name == "burn" and is_lit:
            return name, (frame + 1) % self.count(name)
        if name == "burn" and self.end == OUT:
            return OUT
        for way in self.graph.transitions:
            if (way.before, way.frame) == place:
                return way.after, way.entry
        return name, (frame + 1) % self.count(name)

    def phase(self, place: Place) -> str:
        """Return the phase that a frame shows, or that it shows a fire that is out."""
        if place == self.end:
            return "out"
        phases = [each.phase for each in self.graph.states if each.animation == place[0]]
        return str(phases[0])

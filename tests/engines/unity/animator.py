"""An Animator that plays a controller of a build, after what Unity's manual says of one.

A state is left by its first transition whose conditions hold: the exit time only in the update that
passes it, in each round of a loop if it is below 1, else once; the parameter at any time.
"""

import math
from bisect import bisect_right
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fire_atlas.engines.unity.names import guids_in
from tests.engines.unity.type_trees import documents

ANIMATOR_CONTROLLER, CLIP, TRANSITION, STATE, MACHINE = 91, 74, 1101, 1102, 1107
"""Unity's numbers of classes."""

_IF, _IF_NOT = 1, 2
"""Modes of a condition on a bool."""


@dataclass(frozen=True, slots=True)
class Clip:
    """A clip: times of its keys, s, what they show, its length, s, and whether it loops."""

    times: tuple[float, ...]
    sprites: tuple[int, ...]
    length: float
    loop: bool

    @classmethod
    def read(cls, path: Path) -> "Clip":
        ((_, _, fields),) = documents(path.read_text())
        (curve,) = fields["m_PPtrCurves"]
        settings = fields["m_AnimationClipSettings"]
        return cls(
            tuple(float(np.float32(key["time"])) for key in curve["curve"]),
            tuple(key["value"]["fileID"] for key in curve["curve"]),
            settings["m_StopTime"],
            bool(settings["m_LoopTime"]),
        )

    def key(self, rounds: float) -> int:
        """Return which key is shown after so many rounds."""
        passed = rounds % 1 if self.loop else min(rounds, 1)
        return bisect_right(self.times, passed * self.length) - 1


class Controller:
    """The objects of a controller by their ids, and its clips by the names of states."""

    def __init__(self, build: Path, name: str = "fire") -> None:
        """Read the files of a build."""
        text = (build / f"{name}.controller").read_text()
        self.ids = [file_id for _, file_id, _ in documents(text)]
        self.objects = {file_id: (kind, fields) for kind, file_id, fields in documents(text)}
        self.states = {f["m_Name"]: f for kind, f in self.objects.values() if kind == STATE}
        files = {
            guids_in(path.read_text())[0]: path.with_suffix("")
            for path in build.glob("*.anim.meta")
        }
        self.clips = {
            name: Clip.read(files[state["m_Motion"]["guid"]]) for name, state in self.states.items()
        }

    def transitions(self, state: str) -> list[dict[str, Any]]:
        """Return the transitions from a state, in their order."""
        found = [self.objects[each["fileID"]] for each in self.states[state]["m_Transitions"]]
        assert all(kind == TRANSITION for kind, _ in found)
        return [fields for _, fields in found]

    def name(self, reference: dict[str, int]) -> str:
        """Return the name of a state that is referred to."""
        kind, fields = self.objects[reference["fileID"]]
        assert kind == STATE
        return str(fields["m_Name"])

    @property
    def default(self) -> str:
        """The state to begin with."""
        (machine,) = (fields for kind, fields in self.objects.values() if kind == MACHINE)
        return self.name(machine["m_DefaultState"])


@dataclass(slots=True)
class Animator:
    """What plays a controller.

    Attributes:
        controller: The controller.
        state, rounds: Name of the state that plays, and how many of its rounds have passed.
        burning: The controller's parameter.
        goes_on: Whether time that has passed since an exit time counts for the next state; Unity's
            manual does not say.
    """

    controller: Controller
    state: str
    rounds: float = 0
    burning: bool = True
    goes_on: bool = False

    @property
    def shown(self) -> tuple[str, int]:
        """The state and the frame of it that is shown."""
        return self.state, self.controller.clips[self.state].key(self.rounds)

    @property
    def sprite(self) -> int:
        """The id of the sprite that is shown; 0 for none."""
        state, key = self.shown
        return self.controller.clips[state].sprites[key]

    def update(self, seconds: float) -> None:
        """Let time pass."""
        before, clip = self.rounds, self.controller.clips[self.state]
        self.rounds += seconds / clip.length
        for transition in self.controller.transitions(self.state):
            exit_time = transition["m_ExitTime"] if transition["m_HasExitTime"] else None
            if self._may_leave(transition) and self._passes(exit_time, before, clip.loop):
                over = 0.0 if exit_time is None else (self.rounds - exit_time) % 1 * clip.length
                self.state = self.controller.name(transition["m_DstState"])
                self.rounds = transition["m_TransitionOffset"]
                if self.goes_on:
                    self.rounds += over / self.controller.clips[self.state].length
                return

    def _may_leave(self, transition: dict[str, Any]) -> bool:
        for condition in transition["m_Conditions"]:
            assert condition["m_ConditionEvent"] == "Burning"
            assert condition["m_ConditionMode"] in (_IF, _IF_NOT)
            if self.burning != (condition["m_ConditionMode"] == _IF):
                return False
        return True

    def _passes(self, exit_time: float | None, before: float, loop: bool) -> bool:
        if exit_time is None:
            return True
        if loop and exit_time < 1:
            return math.floor(before - exit_time) < math.floor(self.rounds - exit_time)
        return before < exit_time <= self.rounds

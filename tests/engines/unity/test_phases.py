"""Fires that are lit and put out: the Animator Controller shows what their graph of states says."""

import itertools
import json
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fire_atlas.atlas.sheet import AtlasSheet, StateGraph
from fire_atlas.cli import main
from fire_atlas.core.shipped import shipped
from fire_atlas.engines.unity.states import BURNING, OUT
from fire_atlas.formats.atlas.texture_packer import read_atlas
from tests.docs.markdown import code_blocks
from tests.engines.unity.animator import ANIMATOR_CONTROLLER, TRANSITION, Animator, Controller
from tests.engines.unity.test_heat import Player
from tests.engines.unity.test_package import files_of_package
from tests.engines.unity.type_trees import documents, faults

CSHARP = Path(__file__).parent / "cs"

PHASES: dict[str, dict[str, Any]] = {
    "both": {"ignite": 1, "extinguish": 1.5},
    "no ignite": {"ignite": "none", "extinguish": 1},
    "no extinguish": {"ignite": 0.5, "extinguish": "none"},
}

LONGEST = 0.3
"""Longest time, s, until a fire leaves its loop."""


def build_of(folder: Path, phases: dict[str, Any], **keys: Any) -> Path:
    recipe = folder / "fire.yaml"
    recipe.write_text(json.dumps({
        "source": {"path": str(shipped("samples") / "campfire"), "height": 64, "fps": 24},
        "flakes": {"bake": False}, "tracks": ["light"], "phases": phases,
        "exports": ["json", {"unity": {"player": "package"}}], **keys,
    }))  # fmt: skip
    assert main(["build", "-q", str(recipe)]) == 0
    return folder / "build"


@dataclass(frozen=True, slots=True)
class PhasedFire:
    """A build and what its JSON file says of it."""

    build: Path
    sheet: AtlasSheet
    graph: StateGraph
    controller: Controller

    @property
    def counts(self) -> dict[str, int]:
        """The number of frames of each animation."""
        return {each.name: len(each.frames) for each in self.sheet.animations}

    def has(self, phase: str) -> bool:
        return phase in self.counts

    def walk_out(self, frame: int) -> list[tuple[str, int]]:
        """Return all that is shown from a frame of the loop on, when the fire is to go out."""
        if not self.has("extinguish"):
            return [("burn", frame), (OUT, 0)]
        shown = [("burn", frame)]
        while True:
            state, frame = shown[-1]
            steps = {s.frame: s for s in self.graph.transitions if s.before == state}
            if frame in steps:
                shown.append((steps[frame].after, steps[frame].entry))
            elif state == "burn" or frame + 1 < self.counts[state]:
                shown.append((state, (frame + 1) % self.counts[state]))
            else:
                return [*shown, (OUT, 0)]

    def walk_in(self) -> list[tuple[str, int]]:
        """Return all that is shown from a fire that is out to the first frames of its loop."""
        burn = [("burn", i) for i in range(5)]
        if not self.has("ignite"):
            return [(OUT, 0), *burn]
        (step,) = (step for step in self.graph.transitions if step.before == "ignite")
        assert (step.frame, step.after, step.entry) == (self.counts["ignite"] - 1, "burn", 0)
        return [(OUT, 0), *(("ignite", i) for i in range(self.counts["ignite"])), *burn]


@pytest.fixture(scope="module", params=PHASES)
def fire(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> PhasedFire:
    build = build_of(tmp_path_factory.mktemp("phases"), PHASES[request.param])
    sheet = read_atlas(build / "fire.json").sheet
    assert sheet.states is not None
    return PhasedFire(build, sheet, sheet.states, Controller(build))


def steady(seconds: float) -> Iterator[float]:
    """Yield the times between the updates of a game that draws at one rate."""
    return itertools.repeat(seconds)


def uneven(chance: np.random.Generator) -> Iterator[float]:
    """Yield those of a game that draws now faster, now slower, but faster than the fire plays."""
    return (float(chance.uniform(1 / 200, 1 / 40)) for _ in itertools.count())


def walked(animator: Animator, updates: Iterator[float], most: int) -> list[tuple[str, int]]:
    """Return what an Animator shows, one after the other, until it shows ``most`` frames."""
    shown = [animator.shown]
    for seconds in itertools.islice(updates, 100 * most):
        animator.update(seconds)
        if animator.shown != shown[-1]:
            shown.append(animator.shown)
        if len(shown) == most:
            break
    return shown


def test_the_editor_knows_every_key(fire: PhasedFire) -> None:
    texts = [*fire.build.glob("*.controller"), *fire.build.glob("*.anim")]
    texts += [*fire.build.glob("*.prefab"), *fire.build.glob("*.meta")]
    assert (fire.build / f"fire.{OUT}.anim.meta") in texts
    assert [fault for path in texts for fault in faults(path.name, path.read_text())] == []


def test_every_id_is_one_objects_and_every_reference_finds_its_own(fire: PhasedFire) -> None:
    controller = fire.controller
    assert len(set(controller.ids)) == len(controller.ids) and 0 not in controller.ids
    listed = [
        each["fileID"] for state in controller.states.values() for each in state["m_Transitions"]
    ]
    transitions = [i for i, (kind, _) in controller.objects.items() if kind == TRANSITION]
    assert sorted(listed) == sorted(transitions), "each belongs to one state"
    for file_id in transitions:
        controller.name(controller.objects[file_id][1]["m_DstState"])
    assert controller.clips.keys() == {*fire.counts, OUT} == set(controller.states)
    assert controller.default == "burn"
    (of_all,) = (f for kind, f in controller.objects.values() if kind == ANIMATOR_CONTROLLER)
    (parameter,) = of_all["m_AnimatorParameters"]
    assert parameter["m_Name"] == BURNING
    assert (parameter["m_Type"], parameter["m_DefaultBool"]) == (4, 1), "a bool that is on"


def test_transitions_are_the_steps_of_the_graph_and_take_no_time(fire: PhasedFire) -> None:
    controller, counts = fire.controller, fire.counts
    found = {
        (state, controller.name(each["m_DstState"])): each
        for state in controller.states
        for each in controller.transitions(state)
    }
    for step in fire.graph.transitions:
        transition = found.pop((step.before, step.after))
        assert transition["m_HasExitTime"] == 1
        end, entry = (step.frame + 1) / counts[step.before], step.entry / counts[step.after]
        assert transition["m_ExitTime"] == pytest.approx(end, abs=1.1e-3 / counts[step.before])
        assert transition["m_TransitionOffset"] == pytest.approx(entry, abs=1e-3)
        modes = [each["m_ConditionMode"] for each in transition["m_Conditions"]]
        assert modes == ([2] if step.before == "burn" else [])
        assert transition["m_ExitTime"] < 1 or step.before != "burn", "else it is asked for once"
    over = {pair: each["m_HasExitTime"] for pair, each in found.items()}
    assert over == {
        ("extinguish", OUT) if fire.has("extinguish") else ("burn", OUT): fire.has("extinguish"),
        (OUT, "ignite" if fire.has("ignite") else "burn"): 0,
    }
    for state in controller.states:
        for transition in controller.transitions(state):
            assert transition["m_TransitionDuration"] == transition["m_InterruptionSource"] == 0


def test_a_fire_that_is_out_shows_what_stays_of_it(fire: PhasedFire) -> None:
    clips = fire.controller.clips
    stays = clips["extinguish"].sprites[-1] if fire.has("extinguish") else 0
    assert clips[OUT].sprites == (stays,) and not clips[OUT].loop
    flakes = (fire.build / "fire.flakes.bytes").read_bytes()
    assert b"burn" in flakes and len(OUT).to_bytes(4, "little") + OUT.encode() not in flakes


@pytest.mark.parametrize("goes_on", [False, True])
@pytest.mark.parametrize("rate", ["steady", "uneven"])
def test_it_goes_out_and_is_lit_frame_by_frame_as_the_graph_says(
    fire: PhasedFire, rate: str, goes_on: bool
) -> None:
    chance = np.random.default_rng(3)
    updates = steady(1 / 60) if rate == "steady" else uneven(chance)
    for moment in chance.uniform(0, 3, 20):
        animator = Animator(fire.controller, "burn", float(moment), goes_on=goes_on)
        for _ in range(5):
            animator.update(next(updates))
        animator.burning = False
        wanted = fire.walk_out(animator.shown[1])
        assert walked(animator, updates, len(wanted) + 1) == wanted
        animator.burning = True
        wanted = fire.walk_in()
        assert walked(animator, updates, len(wanted)) == wanted


@pytest.mark.parametrize("seconds", [1 / 240, 1 / 60, 1 / 10])
def test_it_leaves_its_loop_in_time(fire: PhasedFire, seconds: float) -> None:
    chance, longest = np.random.default_rng(4), 0.0
    for moment in chance.uniform(0, 500, 20):
        animator = Animator(fire.controller, "burn", float(moment), burning=False)
        waited = 0.0
        while animator.state == "burn":
            animator.update(seconds)
            waited += seconds
        longest = max(longest, waited)
    assert longest <= (LONGEST if fire.has("extinguish") else 0) + seconds


def test_it_finishes_what_it_has_begun(fire: PhasedFire) -> None:
    """Lit while it goes out, and put out while it is lit."""
    controller, updates = fire.controller, steady(1 / 60)
    if fire.has("extinguish"):
        count = fire.counts["extinguish"]
        animator = Animator(controller, "extinguish", 2.5 / count)
        wanted = [*(("extinguish", i) for i in range(2, count)), *fire.walk_in()]
        assert walked(animator, updates, len(wanted)) == wanted
    if fire.has("ignite"):
        count = fire.counts["ignite"]
        animator = Animator(controller, "ignite", 2.5 / count, burning=False)
        wanted = [*(("ignite", i) for i in range(2, count)), *fire.walk_out(0)]
        assert walked(animator, updates, len(wanted)) == wanted


def test_a_fire_of_one_scale_or_another_has_the_same_ids(fire: PhasedFire, tmp_path: Path) -> None:
    """However long it takes, and whoever plays it."""
    build = build_of(
        tmp_path, {"ignite": 0.5, "extinguish": 0.5}, exports=["unity"], atlas={"scales": [1, 0.5]}
    )
    controllers = [fire.controller, Controller(build), Controller(build, "fire@0.5x")]
    ids = [{name: _ids_of(each, name) for name in each.states} for each in controllers]
    assert ids[1] == ids[2]
    for name in ids[0].keys() & ids[1].keys():
        shared = ids[0][name].keys() & ids[1][name].keys()
        assert {each: ids[0][name][each] for each in shared} == {
            each: ids[1][name][each] for each in shared
        }
    assert not [*build.glob("*.light.json.meta")] and (build / "fire_flakes.cs").exists()


def _ids_of(controller: Controller, state: str) -> dict[str, int]:
    """Return the id of a state, and of each transition from it by where that leads."""
    (own,) = (i for i, (_, f) in controller.objects.items() if f is controller.states[state])
    listed = controller.states[state]["m_Transitions"]
    names = [controller.name(each["m_DstState"]) for each in controller.transitions(state)]
    return {"": own} | {name: each["fileID"] for name, each in zip(names, listed, strict=True)}


def test_lamps_follow_every_animation(fire: PhasedFire) -> None:
    prefab = list(documents((fire.build / "fire.prefab").read_text()))
    (player,) = (fields for kind, _, fields in prefab if kind == 114 and "lights" in fields)
    assert [light["state"] for light in player["lights"]] == list(fire.counts)
    script = files_of_package()["Runtime/FireAtlasPlayer.cs"]
    assert f'Animator.StringToHash("{BURNING}")' in script
    assert f'Burn = "burn", Out = "{OUT}"' in script


@pytest.mark.parametrize("extinguish", ["none", 0.5])
def test_heat_stays_dark_when_the_fire_is_out(
    mono: None, extinguish: float | str, tmp_path: Path
) -> None:
    build = build_of(
        tmp_path, {"ignite": 0.5, "extinguish": extinguish}, atlas={"pixels": "heat"},
        flakes="none", exports=["unity"],
    )  # fmt: skip
    player = Player(build, tmp_path)
    (shown,) = player.properties([0.5], "once", state=OUT)
    channels = shown["_HereChannel"], shown["_NextChannel"]
    if extinguish == "none":
        assert channels == ([0] * 4, [0] * 4), "of which the shader sees nothing"
    else:
        (last,) = player.properties([12], "once", state="extinguish")
        assert {**shown, "_Blend": 0} == {**last, "_Blend": 0}
        assert channels == ([1, 0, 0, 0], [1, 0, 0, 0])


def test_the_game_code_of_the_docs_compiles(mono: None, tmp_path: Path) -> None:
    component, lines = (
        block for block in code_blocks("docs/engines/unity.md", "csharp") if "Burning" in block
    )
    inside = f"using UnityEngine; class Lines : MonoBehaviour {{ void Start() {{\n{lines}}} }}"
    files = {"Campfire.cs": component, "Lines.cs": inside}
    for path, text in files_of_package().items():
        if path.startswith("Runtime/") and path.endswith(".cs"):
            files[Path(path).name] = text
    for name, text in files.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    sources = [*tmp_path.glob("*.cs"), CSHARP / "Stubs.cs", CSHARP / "EditorStubs.cs"]
    command = ["mcs", "-langversion:7.2", "-target:library", f"-out:{tmp_path / 'game.dll'}"]
    subprocess.run([*command, *map(str, sources)], check=True)

"""Fire that a game lights and puts out: its loop, what leads to it and from it, and their graph."""

import json
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from fire_atlas.cli import main
from fire_atlas.core.pixels import Pixels
from fire_atlas.core.shipped import shipped
from fire_atlas.formats.tracks.tracks_json import read_tracks
from fire_atlas.recipe.phases import MAX_EXIT
from fire_atlas.timeline.phase_change import MAX_STEP
from tests.support.clips import real
from tests.support.repo import contents
from tests.support.wind import SILK, Walker, recipe_in

PHASES = {"ignite": 0.8, "extinguish": 1.2}

CAMPFIRE: dict[str, Any] = {
    "source": {"path": str(shipped("samples") / "campfire"), "fps": 24, "height": 80},
    "phases": PHASES,
}

FIRES: dict[str, dict[str, Any]] = {
    "campfire": CAMPFIRE["source"],
    "candle": {"path": str(shipped("samples") / "candle"), "fps": 24, "height": 96},
    "torch": {"path": str(shipped("samples") / "torch.gif"), "matte": "luminance", "height": 120},
    "cartoon": {
        "path": str(shipped("samples") / "cartoon_flame.png"),
        "grid": {"columns": 6, "rows": 4}, "fps": 12, "height": 96,
    },
    "pixel_art": {
        "path": str(shipped("samples") / "pixel_flame.png"),
        "grid": {"columns": 8, "rows": 1}, "fps": 10, "sampling": "nearest",
    },
}  # fmt: skip


def built(folder: Path, keys: dict[str, Any], **others: Any) -> Walker:
    recipe = recipe_in(folder, keys, **others)
    assert main(["build", str(recipe), "-q"]) == 0
    return Walker.of(folder / "build" / "fire.json")


def frames_of(walker: Walker, name: str) -> list[Pixels]:
    return [walker.frames[name, i] for i in range(walker.count(name))]


def light_of(walker: Walker, name: str) -> list[float]:
    """Return the light of each frame of an animation, of the mean of the burning fire's."""
    burning = np.mean([frame[..., :3].sum() for frame in frames_of(walker, "burn")])
    return [float(frame[..., :3].sum() / burning) for frame in frames_of(walker, name)]


def source_of(clip: str, clips: Path) -> dict[str, Any]:
    return {"path": str(clips / clip / "frames"), "height": 96}


@pytest.fixture(scope="module")
def campfire(tmp_path_factory: pytest.TempPathFactory) -> Walker:
    return built(tmp_path_factory.mktemp("campfire"), CAMPFIRE, flakes={"rate": 60})


def test_the_graph_leads_from_every_phase_to_the_next(campfire: Walker) -> None:
    names = [each.name for each in campfire.atlas.sheet.animations]
    assert names[:3] == ["burn", "ignite", "extinguish"]
    assert [campfire.count(name) for name in names[:3]] == [48, 19, 29]
    assert [each.loop for each in campfire.atlas.sheet.animations] == [True] + [False] * (
        len(names) - 1
    )
    following = {state.animation: state.following for state in campfire.graph.states}
    assert following["ignite"] == "burn"
    assert following["burn"] is following["extinguish"] is None
    assert {following[name] for name in names[3:]} == {"extinguish"}
    ways = {(way.before, way.frame): (way.after, way.entry) for way in campfire.graph.transitions}
    assert ways["ignite", 18] == ("burn", 0)
    assert ways["burn", 47] == ("extinguish", 0)
    for name in names[3:]:
        count = campfire.count(name)
        assert ways[name, count - 1] == ("extinguish", count)
    assert len(ways) == 2 + 2 * len(names[3:])


def test_a_fire_leaves_its_loop_in_time(campfire: Walker) -> None:
    exits = sorted(way.frame for way in campfire.graph.transitions if way.before == "burn")
    assert np.diff([exits[-1] - 48, *exits]).max() <= MAX_EXIT * 24


@pytest.mark.slow
@pytest.mark.parametrize("fire", [*FIRES, real("real_firewall_stock")])
def test_no_step_between_phases_is_seen_and_light_falls_to_nothing(
    fire: str, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    source = FIRES.get(fire) or source_of(fire, request.getfixturevalue("clips"))
    walker = built(tmp_path, {"source": source, "phases": PHASES}, flakes="none")
    names = {each.name for each in walker.atlas.sheet.animations}
    usual = {
        name: np.median([walker.step((name, i), (name, j)) for i, j in pairwise(range(count))])
        for name in names
        if (count := walker.count(name)) > 1
    }
    for way in walker.graph.transitions:
        step = walker.step((way.before, way.frame), (way.after, way.entry))
        assert step <= MAX_STEP * max(usual[way.before], usual[way.after]), way
    out = light_of(walker, "extinguish")
    assert out[0] > 0.6
    assert out[-1] < 0.01 + (0.1 if fire == "candle" else 0)  # its wick stays
    lit = light_of(walker, "ignite")
    assert lit[0] < 0.15
    assert lit[-1] > 0.6


def test_flakes_fly_on_when_the_fire_is_put_out(campfire: Walker) -> None:
    folder = campfire.atlas.path.parent
    loop, dying = (
        read_tracks(folder / f"fire.{name}.flakes.json") for name in ("burn", "extinguish")
    )
    assert loop is not None
    assert dying is not None
    places = {tuple(row[1:3]) for row in dying.frames[0].tolist()}
    newest = {tuple(row[1:3]) for row in loop.frames[0].tolist() if row[12] > 2 / 24}
    assert len(newest) > 3
    assert newest <= places
    assert not len(dying.frames[-1])


def test_what_stands_in_a_fire_stays_and_gets_darker(tmp_path: Path) -> None:
    logs = {"shape": "log", "at": [0, 0, 0.05], "radius": 0.07, "length": 0.5}
    source = {**SILK["source"], "intruders": [logs]}
    timeline = {"frames": 12, "fps": 12}
    keys = {"source": source, "timeline": timeline, "phases": PHASES}
    walker = built(tmp_path, keys, flakes="none")
    burning, out = frames_of(walker, "burn")[0], frames_of(walker, "extinguish")[-1]
    stays = out[..., 3] > 0.9
    assert stays.sum() > 100
    assert out[..., :3][stays].mean() < 0.4 * burning[..., :3][stays].mean()
    assert out[..., 3][~stays].mean() < 0.2 * burning[..., 3][~stays].mean()
    assert stays[: len(stays) // 2].sum() == 0


def smoky(frame: Pixels) -> int:
    """Return how many pixels are grey and hide what is behind them."""
    light = frame[..., :3]
    grey = np.ptp(light, axis=-1) < 0.2 * light.max(axis=-1)
    return int((grey & (frame[..., 3] > 0.08)).sum())


def test_a_wisp_of_smoke_rises_where_it_dies_and_is_gone_at_its_end(campfire: Walker) -> None:
    found = [smoky(frame) for frame in frames_of(campfire, "extinguish")]
    assert max(found) > 60
    assert found[-1] == found[0] == 0
    assert int(np.argmax(found)) > 10


@pytest.mark.parametrize(
    "keys", [{"atlas": {"alpha": "additive"}}, {"source": FIRES["pixel_art"]}], ids=["light", "art"]
)
def test_pages_of_light_alone_and_art_have_no_smoke(keys: dict[str, Any], tmp_path: Path) -> None:
    walker = built(tmp_path, {**CAMPFIRE, **keys}, flakes="none")
    assert max(smoky(frame) for frame in frames_of(walker, "extinguish")) == 0


@pytest.mark.parametrize(
    ("phases", "names"),
    [
        ({"ignite": "none"}, ["burn", "extinguish"]),
        ({"extinguish": "none"}, ["burn", "ignite"]),
    ],
)
def test_a_phase_may_be_left_out(phases: dict[str, str], names: list[str], tmp_path: Path) -> None:
    walker = built(tmp_path, {**CAMPFIRE, "phases": phases}, flakes="none")
    found = [each.name for each in walker.atlas.sheet.animations]
    assert [name for name in found if "_" not in name] == names
    assert {name.partition("_")[0] for name in found} == {*names}


@pytest.mark.parametrize(("key", "frames"), [("ignite", 12), ("extinguish", 48)])
def test_a_phase_takes_its_seconds(key: str, frames: int, tmp_path: Path) -> None:
    walker = built(tmp_path, {**CAMPFIRE, "phases": {**PHASES, key: frames / 24}}, flakes="none")
    assert walker.count(key) == frames


def test_statistics_say_what_entries_cost(campfire: Walker) -> None:
    manifest = json.loads((campfire.atlas.path.parent / "fire.manifest.json").read_text())
    found = manifest["statistics"]["phases"]
    entries = [each for each in campfire.atlas.sheet.animations if "_" in each.name]
    assert found["entry_frames"] == sum(len(each.frames) for each in entries)
    area = {frame.name: frame.width * frame.height for frame in campfire.atlas.frames}
    ours = sum(area[name] for each in entries for name in each.frames)
    assert found["entry_pixels"] == pytest.approx(ours / sum(area.values()), abs=0.02)


@pytest.mark.slow
def test_a_ramp_colours_every_phase_and_leaves_the_smoke_grey(tmp_path: Path) -> None:
    walker = built(tmp_path, CAMPFIRE, flakes="none", composite={"ramp": "soul"})
    for name in ("burn", "ignite", "extinguish"):
        light = np.sum(
            [frame[..., :3].sum(axis=(0, 1)) for frame in frames_of(walker, name)[:12]], 0
        )
        assert light[2] > light[0], name
    assert max(smoky(frame) for frame in frames_of(walker, "extinguish")) > 60


@pytest.mark.slow
def test_the_number_of_workers_changes_nothing(tmp_path: Path) -> None:
    short = {"source": {**CAMPFIRE["source"], "count": 16}}
    keys = {**CAMPFIRE, **short, "tracks": ["json", "light"], "maps": {"motion": "godot"}}
    recipe = recipe_in(tmp_path, keys)
    found = []
    for jobs in ("1", "3"):
        assert main(["build", str(recipe), "-q", "--force", "--jobs", jobs]) == 0
        found.append(contents(tmp_path / "build"))
    assert found[0] == found[1]


REFUSED: list[tuple[dict[str, Any], str]] = [
    ({"timeline": {"loop": "none"}}, "are of a fire that loops"),
    ({"phases": {"ignite": "none", "extinguish": "none"}}, "has neither ignite nor extinguish"),
    ({"phases": {"ignite": 0.1}}, "ignite"),
    ({"composite": {"ramp": ["soul", "gas"]}}, "name one ramp"),
    ({"flakes": {"rounds": 2}}, "flakes repeat with their loop"),
    ({"source": {"kind": "fluid", "fire": "explosion"}}, "plays once"),
    ({**SILK, "wind": {"levels": [0, 2]}}, "one wind"),
    ({"source": SILK["source"], "views": {"count": 4}}, "one side of the fire"),
]  # fmt: skip


@pytest.mark.parametrize(("keys", "says"), REFUSED, ids=[says for _, says in REFUSED])
def test_check_refuses_what_cannot_be_combined(
    keys: dict[str, Any], says: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    recipe = recipe_in(tmp_path, {**CAMPFIRE, **keys})
    for command in ("check", "build"):
        assert main([command, str(recipe)]) in (1, 2)
        assert says in " ".join(capsys.readouterr().err.split())
    assert not (tmp_path / "build").exists()


def test_a_clip_that_plays_once_is_refused_where_it_is_known(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    clip = {"path": str(shipped("samples") / "explosion"), "fps": 24, "height": 64}
    recipe = recipe_in(tmp_path, {**CAMPFIRE, "source": clip})
    assert main(["build", str(recipe), "-q"]) == 2
    assert "phases: are of a fire that loops, but this one plays once" in capsys.readouterr().err
    assert not list((tmp_path / "build").glob("fire*")) if (tmp_path / "build").exists() else True


def test_members_with_phases_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "one.yaml").write_text(json.dumps(CAMPFIRE))
    recipe = recipe_in(tmp_path, {"atlas": {"members": ["one.yaml"]}})
    assert main(["check", str(recipe)]) == 2
    assert "one has phases, which need pages of their own" in capsys.readouterr().err


def filmed(folder: Path, begins: int, ends: int) -> dict[str, Any]:
    """Write a clip in which the sample campfire is lit in so many frames and goes out in so many:
    it is bright first at its foot, and last. Return its source."""
    frames = folder / "frames"
    frames.mkdir()
    files = sorted((shipped("samples") / "campfire").glob("*.png"))
    light = [*np.linspace(0, 1, begins), *np.ones(len(files)), *np.linspace(1, 0, ends)]
    for number, share in enumerate(light):
        picture = Image.open(files[(number - begins) % len(files)]).convert("RGBA").resize((64, 80))
        shown = np.asarray(picture).astype(np.float64)
        shown[: round(80 * (1 - share))] = 0
        Image.fromarray((shown * min(1, 0.2 + share)).astype(np.uint8)).save(
            frames / f"{number:04}.png"
        )
    return {"path": str(frames), "fps": 24}


@pytest.mark.parametrize(("begins", "ends"), [(16, 20), (16, 0), (0, 20)])
def test_a_clip_shows_its_own_beginning_and_end(
    begins: int, ends: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    keys = {"source": filmed(tmp_path, begins, ends), "phases": PHASES, "flakes": "none"}
    recipe = recipe_in(tmp_path, keys, motion_blur="none")
    assert main(["build", str(recipe)]) == 0
    said = capsys.readouterr().err
    walker = Walker.of(tmp_path / "build" / "fire.json")
    files = sorted((tmp_path / "frames").glob("*.png"))
    plain = recipe_in(
        tmp_path, {"source": keys["source"], "timeline": {"loop": "none"}}, flakes="none"
    )
    assert main(["build", str(plain), "-q", "-o", str(tmp_path / "whole")]) == 0
    whole = frames_of(Walker.of(tmp_path / "whole" / "fire.json"), "fire")
    assert len(whole) == len(files)
    if begins:
        lit = frames_of(walker, "ignite")
        assert len(lit) >= begins
        assert all((one == other).all() for one, other in zip(lit, whole, strict=False))
    if ends:
        out = frames_of(walker, "extinguish")
        assert len(out) >= ends
        assert all((one == other).all() for one, other in zip(out[::-1], whole[::-1], strict=False))
    for phase, is_filmed in (("ignite", begins > 0), ("extinguish", ends > 0)):
        assert (f"{phase}: the clip's own" in said) == is_filmed
        assert is_filmed or walker.count(phase) == round(24 * PHASES[phase])
    burning = light_of(walker, "burn")
    assert min(burning) > 0.5
    steps = walker.steps_of("burn")
    for way in walker.graph.transitions:
        step = walker.step((way.before, way.frame), (way.after, way.entry))
        assert step <= 1.6 * np.median(steps), way


@pytest.mark.clips
def test_wax_stays_and_its_glow_goes(clips: Path, tmp_path: Path) -> None:
    walker = built(
        tmp_path, {"source": source_of("real_candle_red", clips), "phases": PHASES}, flakes="none"
    )
    burning, out = frames_of(walker, "burn")[0][..., 3], frames_of(walker, "extinguish")[-1][..., 3]
    foot = round(walker.atlas.frames[0].anchor[1] * len(out))
    wax = (out > 0.9).sum(axis=1)
    assert wax[-1] > 15
    assert out[: foot - 6].max() < 0.05 < 0.5 < burning[: foot - 6].max()
    rim = int(np.flatnonzero(wax > 0.7 * wax[-1])[0])
    assert (wax[rim:] > 0.7 * wax[-1]).all()

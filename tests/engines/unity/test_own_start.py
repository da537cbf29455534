"""Loops that stand in a scene several times: each begins at a moment of its own."""

import re
import subprocess
from collections.abc import Callable, Sequence

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.engines.unity.products import Fire, exported
from tests.engines.unity.test_package import harness
from tests.engines.unity.test_player import compiled

__all__ = ["harness"]

COUNT = 12

Run = Callable[..., list[str]]


@pytest.fixture(scope="module")
def own(mono: None, tmp_path_factory: pytest.TempPathFactory) -> Run:
    """Run the script that a build writes; return the lines that it prints."""
    folder = tmp_path_factory.mktemp("start")
    script = folder / "fire_start.cs"
    script.write_bytes(exported(Fire({"fire": 7}).product())[script.name])
    program = compiled(script, harness="StartHarness.cs")

    def run(*arguments: object) -> list[str]:
        done = subprocess.run(
            ["mono", program, *map(str, arguments)], capture_output=True, text=True, check=True
        )
        return done.stdout.splitlines()

    return run


def rows_of(lines: Sequence[str]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return what is told of loops, and of what plays once, (12, n) each."""
    table = np.array([line.split() for line in lines], float)
    return table[:COUNT], table[COUNT:]


def check_apart(loops: NDArray[np.float64], once: NDArray[np.float64]) -> None:
    """``loops`` and ``once``: where each begins, where it is an update later, state, and speed."""
    begun = loops[:, 0]
    assert begun.min() >= 0 and begun.max() <= 1 and np.ptp(begun) > 0.5
    assert len({*begun}) == COUNT and (loops[:, 1] == begun).all()
    speeds = loops[:, 3] / 2
    assert speeds.min() >= 0.9 and speeds.max() <= 1.1 and len({*speeds}) == COUNT
    assert (loops[:, 2] == 7).all()
    np.testing.assert_array_equal(once, np.tile([0, 0, 7, 2], (COUNT, 1)))


def test_every_loop_of_a_build_begins_at_a_moment_of_its_own(own: Run) -> None:
    loops, once = rows_of(own())
    check_apart(loops[:, :4], once[:, :4])
    again = loops[:, 4:]
    check_apart(again, once[:, 4:])
    assert (again[:, 3] == loops[:, 3]).all() and (again[:, 0] != loops[:, 0]).all()


def test_every_player_of_the_package_begins_a_loop_at_a_moment_of_its_own(harness: Run) -> None:
    check_apart(*rows_of(harness("apart")))


@pytest.mark.parametrize("of_package", [True, False])
def test_start_and_speed_are_properties_of_their_own(
    own: Run, harness: Run, *, of_package: bool
) -> None:
    def run(*stated: object) -> list[str]:
        return harness("apart", *stated) if of_package else own(*stated)

    fast, _ = rows_of(run(False, 0.5))
    assert (fast[:, 0] == 0).all()
    speeds = fast[:, 3] / 2
    # Of twelve even draws a range of 0.3 or less comes twice in a hundred thousand runs.
    assert speeds.min() >= 0.5 and speeds.max() <= 1.5 and np.ptp(speeds) > 0.3
    slow, _ = rows_of(run(True, 0))
    assert (slow[:, 3] == 2).all() and len({*slow[:, 0]}) == COUNT


def test_a_prefab_has_the_script_or_the_player_of_the_package() -> None:
    files = exported(Fire({"fire": 7}).product())
    guid = re.findall(rb"guid: (\w+)", files["fire_start.cs.meta"])[0]
    prefab = files["fire.prefab"].decode()
    assert f"guid: {guid.decode()}, type: 3" in prefab
    assert "randomStart: 1" in prefab and "speedSpread: 0.1" in prefab and "variants: []" in prefab
    whole = exported(Fire({"fire": 7}).product(), player="package")
    assert "fire_start.cs" not in whole and b"randomStart: 1" in whole["fire.prefab"]


NAMES = ("v0_burn", "v1_burn", "v2_burn")


def check_turns(shown: list[str]) -> None:
    """Check that of three neighbours each shows another variant."""
    assert {*shown} == {*NAMES}
    assert all(len({*shown[at : at + 3]}) == 3 for at in range(COUNT - 2))


def test_fires_of_a_build_show_one_variant_after_the_other(own: Run) -> None:
    rows = [line.split() for line in own(True, 0.1, -1, *NAMES)]
    check_turns([row[0] for row in rows])
    assert all(row[2:] == row[:2] for row in rows), "one that begins again stays as it is"
    assert {row[1] for row in rows} == {"True", "False"}
    for number in range(4):
        chosen = {line.split()[0] for line in own(True, 0.1, number, *NAMES)}
        assert chosen == {NAMES[number % 3]}


def test_players_of_the_package_show_one_variant_after_the_other(harness: Run) -> None:
    rows = [line.split() for line in harness("vary", -1, *NAMES)]
    check_turns([row[0] for row in rows])
    assert {row[1] for row in rows} == {"True", "False"}
    assert {row[2] for row in rows} == {"1"}, "each knows when its own variant is out"
    for number in range(4):
        chosen = {line.split()[0] for line in harness("vary", number, *NAMES)}
        assert chosen == {NAMES[number % 3]}

"""Profile files: read back whole, recoloured, and refused when they are not sound."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fire_atlas.core.errors import SourceError
from fire_atlas.generators.profile.file import read_profile, write_profile
from fire_atlas.generators.profile.model import Profile
from tests.generators.profile.flames import swaying
from tests.support.likeness import generated, learnt, learnt_kite, settings


@pytest.fixture(scope="module")
def profile() -> Profile:
    return learnt_kite()


@pytest.fixture(scope="module")
def file(profile: Profile) -> bytes:
    return write_profile(profile)


def _frame(profile: Profile, i: int = 5) -> np.ndarray[Any, Any]:
    return generated(profile, settings(12))[0].read(i)


def test_a_profile_read_back_gives_the_same_fire_to_the_last_bit(
    profile: Profile, file: bytes
) -> None:
    again = read_profile(file, "x")
    assert write_profile(again) == file
    assert (_frame(again) == _frame(profile)).all()


@pytest.mark.slow
def test_two_sides_are_kept() -> None:
    front, side = swaying()[0], swaying(half=30.0)[0]
    profile = learnt(front, side)
    again = read_profile(write_profile(profile), "x")
    assert again.side is not None
    ninety = generated(again, settings(12), [90.0])[0].read(3)
    assert (ninety == generated(profile, settings(12), [90.0])[0].read(3)).all()


def test_people_can_read_it(file: bytes) -> None:
    values = json.loads(file)
    assert values["format"] == "fire-atlas/profile" and values["version"] == 3
    assert len(values["sides"][0]["colours"]["rows"]) == 5
    assert [len(each) for each in values["sides"][0]["points"]] == [6] * 32
    readable = file.split(b'"scores"')[0]
    assert max(map(len, readable.splitlines())) < 400


def test_an_edited_colour_table_recolours_the_fire(file: bytes) -> None:
    plain = _frame(read_profile(file, "x"))
    values = json.loads(file)
    rows = values["sides"][0]["colours"]["rows"]
    values["sides"][0]["colours"]["rows"] = [
        [f"#{c[5:7]}{c[3:5]}{c[1:3]}" for c in row] for row in rows
    ]
    blue = _frame(read_profile(json.dumps(values).encode(), "x"))
    assert (blue[..., 3] == plain[..., 3]).all()
    lit = plain[..., 3] > 0.9
    assert (blue[lit][:, 2] > blue[lit][:, 0]).mean() > 0.95
    np.testing.assert_allclose(blue[lit][:, ::-1][:, 1:], plain[lit][:, :3], atol=0.03)


Change = Callable[[dict[str, Any]], object]


@pytest.mark.parametrize(
    ("change", "where"),
    [
        (lambda v: v.pop("grid"), "grid"),
        (lambda v: v["grid"].update(up=10**9), "grid.up"),
        (lambda v: v["grid"].update(up=v["grid"]["up"] + 6), "flow"),
        (lambda v: v["sides"][0].update(scores="AAAA"), "scores"),
        (lambda v: v["sides"][0].update(scores="not base64!"), "scores"),
        (lambda v: v["sides"][0].update(shades=v["sides"][0]["scores"]), "shades"),
        (lambda v: v["sides"][0]["points"].pop(), "points"),
        (lambda v: v["sides"][0]["offset"][0].pop(), "offset"),
        (lambda v: v["sides"][0]["sets"][0].update(frames=[99]), "sets"),
        (lambda v: v["sides"][0]["colours"]["rows"][0].pop(), "colour table"),
        (
            lambda v: v["sides"][0]["colours"]["rows"][0].__setitem__(0, "red"),
            "sides.0.colours.rows.0.0",
        ),
        (lambda v: v.update(rise=float("nan")), "rise"),
        (lambda v: v.update(more=1), "more"),
        (lambda v: v.update(sides=[]), "sides"),
        (lambda v: v.update(version="1"), "version"),
    ],
)
def test_a_damaged_profile_is_refused_saying_where(file: bytes, change: Change, where: str) -> None:
    values = json.loads(file)
    change(values)
    with pytest.raises(SourceError) as caught:
        read_profile(json.dumps(values).encode(), "candle.profile.json")
    message = str(caught.value)
    assert message.startswith("candle.profile.json: is damaged") and where in message, message
    assert "fire-atlas learn" in message and "\n" not in message


@pytest.mark.parametrize(
    ("data", "what"),
    [
        (b"", "is damaged or not a fire profile"),
        (b"\xff\xfe{}", "is damaged or not a fire profile"),
        (b"[" * 100_000, "is damaged or not a fire profile"),
        (b"[]", "is not a fire profile"),
        (b'{"frames": {}}', "is not a fire profile"),
        (b'{"format": "fire-atlas/profile", "version": 4}', "version 4, but this fire-atlas reads"),
        (b'{"format": "fire-atlas/profile", "version": 2}', "of version 2, which has the colours"),
    ],
)
def test_what_is_no_profile_is_refused(data: bytes, what: str) -> None:
    with pytest.raises(SourceError) as caught:
        read_profile(data, "x.json")
    assert what in str(caught.value) and "fire-atlas learn" in str(caught.value)


def test_half_a_profile_is_refused(file: bytes, tmp_path: Path) -> None:
    for share in (0.1, 0.5, 0.99):
        with pytest.raises(SourceError, match="is damaged"):
            read_profile(file[: int(len(file) * share)], "x")

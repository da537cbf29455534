"""Frame numbers in names: order, patterns, gaps; and names that would be one file elsewhere."""

import random
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fire_atlas.core.errors import SourceError
from fire_atlas.sources.listing import ALL_FRAMES, FixedRange, locate
from fire_atlas.sources.sequence import in_playing_order, pattern_of


def folder_of(folder: Path, *names: str) -> Path:
    folder.mkdir(exist_ok=True)
    for name in names:
        (folder / name).touch()
    return folder


def ordered(*names: str) -> list[str]:
    shuffled = random.Random(3).sample(names, len(names))
    return [path.name for path in in_playing_order(map(Path, shuffled))]


@pytest.mark.parametrize(
    "names",
    [
        ("foo -003.png", "foo -002.png", "foo 0000.png", "foo 0001.png"),
        ("f.-10.exr", "f.-9.exr", "f.-1.exr"),  # a hyphen after a dot separates nothing
        ("fire-1.png", "fire-2.png", "fire-10.png"),
        ("fire-2.png", "fire-1.png", "fire0.png", "fire1.png"),
        ("1.png", "2.png", "10.png"),
        ("Fire_1.PNG", "fire_2.png", "FIRE_3.png"),
        ("f.0001.png", "f.0001.5.png", "f.0002.png"),
        ("f.-2_v3.png", "f.-1_v3.png", "f.0_v3.png", "f.10_v3.png"),
        ("fire-1_4k.png", "fire-2_4k.png", "fire-10_4k.png"),
        ("fire.png", "fire2.png", "fire10.png"),
    ],
)
def test_frames_play_in_the_order_of_their_numbers(names: tuple[str, ...]) -> None:
    assert ordered(*names) == list(names)


@given(
    st.sets(st.integers(-999, 9999), min_size=2, max_size=30),
    st.sampled_from(["f.", "f_", "my fire ", "", "f", "take 2 "]),
    st.sampled_from(["", "_v2", ".linear", " 1080p 24"]),
    st.integers(0, 5),
)
def test_any_numbers_come_back_sorted(
    numbers: set[int], head: str, tail: str, padding: int
) -> None:
    # Without a number that is not negative, a hyphen after a letter or a space is a hyphen.
    numbers |= {0}
    names = [f"{head}{'-' * (n < 0)}{abs(n):0{padding}}{tail}.png" for n in sorted(numbers)]
    assert ordered(*names) == names


@pytest.mark.parametrize(
    ("pattern", "matches", "others"),
    [
        ("f_%04d.exr", ["f_0001.exr", "f_-001.exr", "f_12345.exr"], ["f_1.exr", "g_0001.exr"]),
        ("f.####.exr", ["f.0001.exr", "f.-001.exr"], ["f.001.exr", "f.0001.exr.bak", "fx0001.exr"]),
        ("f.$F4.exr", ["f.0001.exr", "f.-0001.exr"], ["f.01.exr"]),
        ("f%d.png", ["f1.png", "f-3.png", "f0001.png"], ["f.png", "f1a.png"]),
        ("f[1]_#.png", ["f[1]_7.png", "f[1]_12.png"], ["f1_7.png"]),
        ("*_$F.png", ["a_1.png", "b_2.png"], ["a.png"]),
        ("*a*b?_#_*.png", ["aabb1_22_.png", "xaxbx_-2_a_3_.png"], ["ab_1_.png", "abx_1.png"]),
        ("take#2_%04d.png", ["take#2_0001.png"], ["take12_0001.png"]),
        ("f1%02d.png", ["f101.png", "f1111.png"], ["f11.png", "f201.png"]),
    ],
)
def test_patterns_stand_for_the_names_that_renderers_write(
    pattern: str, matches: list[str], others: list[str]
) -> None:
    found = pattern_of(pattern)
    assert [name for name in (*matches, *others) if found.fullmatch(name)] == matches


def test_a_pattern_finds_its_frames_alone(tmp_path: Path) -> None:
    folder = folder_of(tmp_path / "f", "a.0002.png", "a.0001.png", "b.0001.png", "a.0003.txt")
    for pattern in ("a.####.png", "a.%04d.png", "a.$F4.png", "a.$F.png"):
        assert [p.name for p in locate(folder / pattern).files] == ["a.0001.png", "a.0002.png"]
    with pytest.raises(SourceError, match=r"c\.####\.png: no file matches; .* holds 'a.0001.png"):
        locate(folder / "c.####.png")
    with pytest.raises(
        SourceError, match=r"no file matches; did you mean 'a\.#\.png', as of 'a\.0"
    ):
        locate(folder / "a.%05d.png")
    (folder / "a.####.png").touch()
    assert locate(folder / "a.####.png").files == (folder / "a.####.png",)


@pytest.mark.parametrize(
    ("names", "note"),
    [
        (["f1.png", "f2.png", "f4.png"], "frame 3 is missing between f1.png and f4.png"),
        (["f1.png", "f5.png", "f6.png", "f8.png"], "frames 2 to 4, 7 are missing"),
        (["f-2.png", "f0.png", "f1.png"], "frame -1 is missing"),
        (["f1_v2.png", "f3_v2.png", "f4_v2.png"], "frame 2 is missing"),
        (["f1.png", "f3.png", "f5.png", "f9.png"], "frame 7 is missing"),  # drawn on twos
        (["f1.png", "f01.png", "f2.png"], "f01.png and f1.png have one frame number"),
        (["f1.png", "f1.exr", "f2.png", "f2.exr"], "f1.png have one frame number, and 1 more"),
        (["f1.png", "f3.png", "f5.png"], None),
        (["f1.png", "f2.png", "f3.png"], None),
        (["walk1.png", "run4.png", "run9.png"], None),
        (["a_1.png", "a_2.png", "b_1.png", "b_2.png"], "a_1.png and b_1.png begin sequences of"),
        (["fire.png"], None),
    ],
)
def test_missing_and_doubled_frames_are_noted(
    names: list[str], note: str | None, tmp_path: Path
) -> None:
    notes = locate(folder_of(tmp_path / "f", *names)).notes(ALL_FRAMES)
    assert (note in notes[0] and len(notes) == 1) if note else notes == ()


def test_gaps_beside_the_frames_that_are_used_are_not_noted(tmp_path: Path) -> None:
    located = locate(folder_of(tmp_path / "f", *(f"f{i}.png" for i in (-4, -3, -1, 0, 1, 5, 6))))
    assert [located.notes(FixedRange(*used)) for used in ((0, 2), (2, 3), (5, None))] == [()] * 3
    assert "frame -2 is missing between f-3.png and f-1" in located.notes(FixedRange(1, 2))[0]
    assert "frames 2 to 4 are missing" in located.notes(FixedRange(2))[0]


@pytest.mark.parametrize(
    "name", ["f%999999999999999d.png", "f$F99999999999999.png", "f%999d.png", "f_%0d.png", "%d%d%d"]
)
def test_patterns_of_any_length_are_harmless(name: str, tmp_path: Path) -> None:
    folder = folder_of(tmp_path / "f", "a.png")
    with pytest.raises(SourceError, match=r"(no file matches|does not exist); .*f holds 'a\.png'"):
        locate(folder / name)


def test_many_wildcards_in_a_pattern_take_no_longer() -> None:
    name = pattern_of("*a" * 60 + "_#" + "*a" * 60 + "b.png")
    assert not name.fullmatch("a" * 120 + "_1" + "a" * 120 + ".png")

"""What a manifest states of motion vectors is read back from it."""

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fire_atlas.maps.vectors.cross_validation import (
    Residuals,
    ValidationReport,
    better_method,
    motion_statistics,
    read_reports,
)
from fire_atlas.maps.vectors.flow import Method

GAINS = st.floats(-1e6, 1, allow_nan=False).map(lambda gain: round(gain, 4))
LEFT = st.floats(0, 255).map(lambda left: round(left, 3))
REPORTS = st.none() | st.builds(
    ValidationReport,
    held_out=st.integers(1, 8),
    gain=GAINS,
    helps=st.booleans(),
    method=st.sampled_from(["dis", "farneback"]),
    residual=st.fixed_dictionaries({"blend": LEFT, "dis": LEFT, "farneback": LEFT}),
    fewer=st.dictionaries(st.sampled_from([2, 5]), st.builds(Residuals, LEFT, LEFT)),
    still=st.booleans(),
)


@given(REPORTS)
def test_a_report_is_read_as_it_was_written(report: ValidationReport | None) -> None:
    assert read_reports({"frames": 12, **motion_statistics(report)}) == {"": report}


@given(st.dictionaries(st.text(min_size=1), REPORTS))
def test_the_reports_of_several_animations_are_read_by_name(
    reports: dict[str, ValidationReport | None],
) -> None:
    several = {name: motion_statistics(report) for name, report in reports.items()}
    assert read_reports({"animations": several}) == reports
    assert read_reports({"animations": len(several), "motions": several}) == reports
    shared = {"members": {"torch": {"animations": several}}}
    assert read_reports(shared) == {f"torch/{name}": each for name, each in reports.items()}


def test_statistics_without_motion_hold_no_report() -> None:
    assert read_reports({"frames": 12, "members": {"torch": {"frames": 12}}}) == {}


def test_both_methods_and_fewer_frames_are_stated() -> None:
    left = {"blend": 4.56, "dis": 1.6664, "farneback": 2.65}
    report = ValidationReport(8, 0.63456, True, "dis", left, {5: Residuals(10.7861, 7.13)})
    assert motion_statistics(report)["motion"] == {
        "held_out": 8, "written": True, "gain": 0.6346, "method": "dis",
        "residual": {"blend": 4.56, "dis": 1.666, "farneback": 2.65},
        "fewer_frames": {"5": {"blend": 10.786, "vectors": 7.13}},
    }  # fmt: skip


@pytest.mark.parametrize(
    ("blend", "dis", "farneback", "better"),
    [
        (9, 4, 4, "dis"),
        (9, 4, 3.97, "dis"),
        (9, 4, 3.95, "farneback"),
        (9, 4, 4.5, "dis"),
        (9, 9.5, 9.1, "dis"),  # neither helps: the frames are blended
        (9, 12, 8.95, "dis"),  # as close as the blend, but for chance
        (9, 12, 8, "farneback"),
        (0, 0, 0, "dis"),
    ],
)
def test_the_better_method_wins_and_a_tie_is_for_dis(
    blend: float, dis: float, farneback: float, better: str
) -> None:
    left: dict[Method, Residuals] = {
        "dis": Residuals(blend, dis), "farneback": Residuals(blend, farneback),
    }  # fmt: skip
    assert better_method(left, steps_are_double=True) == better


@pytest.mark.parametrize(
    "change",
    [
        {"gain": None},
        {"held_out": [8]},
        {"written": "yes"},
        {"method": "brox"},
        {"residual": {"blend": 2.0, "dis": 1.0}},
        {"fewer_frames": {"2": {"blend": 2.0}}},
    ],
)
def test_figures_of_another_kind_are_refused(change: dict[str, Any]) -> None:
    left = {"blend": 3.0, "dis": 2.1, "farneback": 2.2}
    figures = motion_statistics(ValidationReport(8, 0.3, True, "dis", left, {}))["motion"]
    with pytest.raises(ValueError, match="are no figures of motion vectors"):
        read_reports({"motion": {**figures, **change}})

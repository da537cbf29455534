"""What a manifest states of motion vectors is read back from it."""

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fire_atlas.maps.vectors.cross_validation import (
    ValidationReport,
    motion_statistics,
    read_reports,
)

GAINS = st.floats(-1e6, 1, allow_nan=False).map(lambda gain: round(gain, 4))
REPORTS = st.none() | st.builds(
    ValidationReport,
    held_out=st.integers(1, 8),
    gain=GAINS,
    helps=st.booleans(),
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


@pytest.mark.parametrize("change", [{"gain": None}, {"held_out": [8]}, {"written": "yes"}])
def test_figures_of_another_kind_are_refused(change: dict[str, Any]) -> None:
    figures = motion_statistics(ValidationReport(8, 0.3, True))["motion"]
    with pytest.raises(ValueError, match="are no figures of motion vectors"):
        read_reports({"motion": {**figures, **change}})

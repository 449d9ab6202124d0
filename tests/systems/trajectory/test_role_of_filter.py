"""The role by which other systems learn the errors of the on-board filter."""

import pytest

from groundstation.systems.trajectory.answer import BestTrajectory
from groundstation.systems.trajectory.wording_answer import opening_error
from tests.systems.trajectory.made_answers import accepted, ambiguous, doubtful, without_filter


def test_an_accepted_trajectory_tells_the_errors_that_its_own_page_tells() -> None:
    answer = accepted()
    errors, opening = answer.filter_errors("ins"), opening_error(answer)
    assert answer.filter_topics == ("ins",) and answer.onboard is not None and opening is not None
    assert [(one.quantity, one.rms, one.sigma_rms) for one in errors] == [
        (row.quantity, row.rms, row.sigma_rms) for row in answer.onboard.rows
    ]
    worst = max((span for one in errors for span in one.wrong), key=lambda span: span.over)
    assert worst.over >= 1.0 and worst.span_s == (opening[1].start_s, opening[1].end_s)
    assert worst.value == pytest.approx(2.1, abs=0.3) and worst.whole_s == (answer.start_s, answer.end_s)


@pytest.mark.parametrize("make", [doubtful, ambiguous, without_filter])
def test_no_errors_where_the_checks_do_not_hold(make: object) -> None:
    answer = make()  # type: ignore[operator]
    assert isinstance(answer, BestTrajectory)
    assert answer.filter_topics == () and answer.filter_errors("ins") == ()

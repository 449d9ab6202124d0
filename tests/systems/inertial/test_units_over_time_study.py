"""The study of INS units over time on a few histories: tables, honest intervals, few false changes."""

import numpy as np

from groundstation.systems.inertial.study import units_over_time as study
from groundstation.systems.inertial.study.units_over_time import FAMILY, FLIGHTS, judge, study_units_over_time


def test_the_study_has_a_row_for_each_kind_and_length(monkeypatch) -> None:  # type: ignore[no-untyped-def]
    monkeypatch.setattr(study, "FLIGHTS", (8, 15))
    told: list[str] = []
    found = study_units_over_time(2, 5, told.append)
    histories, false = found.tables
    assert len(histories) == 2 * len(FAMILY) == len(told) and "False changes" in found.markdown
    assert false["histories"][-1] == sum(4 for one in FAMILY if one.level != "step" and not one.is_broken)


def test_a_step_is_found_and_steady_units_are_left_alone() -> None:
    step = next(one for one in FAMILY if one.level == "step")
    steady = FAMILY[0]
    stepped = [judge(step, 30, np.random.default_rng([9, run])) for run in range(8)]
    quiet = [judge(steady, 30, np.random.default_rng([9, run])) for run in range(20)]
    assert sum(one.step_found for one in stepped) >= 6 and sum(one.changed for one in quiet) <= 2
    assert max(FLIGHTS) == 60 and sum(bool(one.slope_held) for one in quiet) >= 15

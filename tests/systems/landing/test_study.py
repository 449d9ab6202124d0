"""The study of the localizer as a reference: its family, its page, and (slow) the coverage that the manual states."""

from pathlib import Path

import numpy as np
import pytest

from groundstation.pipeline.verbs.synthesis import simulate_to
from groundstation.systems.landing.study import FAMILIES, drawn, study_approach

COVERAGE_TOLERANCE = 0.05  # two and a half standard deviations of the share at 100 runs
COVERED = 0.95


def test_runs_are_the_same_for_every_family_and_repeatable() -> None:
    first, again = (drawn(np.random.default_rng((7, 3))) for _ in range(2))
    assert first == again
    rng = np.random.default_rng(1)
    changed = {family.name: family.change(first, rng) for family in FAMILIES}
    assert changed["plain"] == first
    assert all(one.runway == first.runway and one.seed == first.seed for one in changed.values())
    assert changed["line"].recorded.course_line_m == 30.0 and changed["crab"].flown.crab_deg == 10.0


def test_the_page_has_a_row_for_each_family() -> None:
    found = study_approach(3, 5, families=FAMILIES[:2])
    (table,) = found.tables
    assert table["family"].tolist() == ["plain", "rounded"] and (table["measured"] == 3).all()
    assert "| plain | 3 |" in found.markdown and "nan" not in found.markdown


def test_simulate_writes_the_approach_and_keeps_a_file_that_is_there(tmp_path: Path) -> None:
    (path,) = simulate_to("ils-approach", tmp_path)
    assert path.name == "ils-approach.csv" and "guidance.lateral_deviation_dots" in path.read_text()[:600]
    with pytest.raises(Exception, match="a file that exists"):
        simulate_to("ils-approach", tmp_path)


@pytest.mark.slow
def test_intervals_hold_the_truth_where_the_assumptions_hold() -> None:
    (table,) = study_approach(100, 71, families=FAMILIES[:2]).tables
    assert (np.abs(table["coverage"] - COVERED) <= COVERAGE_TOLERANCE).all()
    assert (np.abs(table["rate_coverage"] - COVERED) <= COVERAGE_TOLERANCE).all()

"""Study of the trajectory's sigmas: its families, its page, and NEES in a band."""

from dataclasses import replace

import numpy as np
import pytest

from groundstation.systems.trajectory.study.family import FAMILIES, StudyFamily, known_model, known_sigmas
from groundstation.systems.trajectory.study.judged import QUANTITIES
from groundstation.systems.trajectory.study.trajectory import row_of, study_trajectory

NEES = [f"{kind}_{name}_nees" for kind in ("smoothed", "filtered") for name in QUANTITIES]
BAND = 0.8, 1.2  # per degree of freedom, 200 runs
RUNS, FAST_RUNS = 200, 6
# A run has some ten independent errors of a quantity: the constants of the unit and the slow errors of GNSS are drawn
# once a run. Six runs of one family spread by a third about 1.
FAST_BAND = 0.35, 2.0
SHORT_S = 150.0


def short(family: StudyFamily) -> StudyFamily:
    """The family with logs of less time and rate."""
    return replace(family, unit=replace(family.unit, duration_s=SHORT_S, rate_hz=50.0))


def test_a_family_has_what_makes_a_log_hard() -> None:
    assert [one.name for one in FAMILIES] == [
        "uav-mems",
        "uav-consumer",
        "hover-mems",
        "hover-consumer",
        "start-in-motion",
    ]
    for one in FAMILIES:
        unit = one.unit
        assert (unit.scale_factor, unit.misalignment_deg, unit.stamps.jitter_s) == (0.005, 0.3, 0.003)
        assert len(unit.stamps.gaps) == 2 and unit.gnss.latency_s == 0.3


def test_the_known_model_is_that_of_the_simulation() -> None:
    unit = FAMILIES[1].unit
    model, sigmas = known_model(unit), known_sigmas(unit)
    gnss = unit.gnss
    stated = np.sqrt(gnss.position_white_m**2 + gnss.position_slow_m**2 + gnss.position_fast_m**2)
    noise = model.noise(np.full(3, stated))
    np.testing.assert_allclose(np.sqrt(noise.variance[:6]), np.repeat([gnss.position_slow_m, gnss.position_fast_m], 3))
    assert model.position_scale * stated == pytest.approx(gnss.position_white_m)
    assert np.sqrt(noise.density[1]) == pytest.approx(4e-3)  # of the class consumer, m/s in the root of a second
    assert sigmas.gyro_bias_dps == pytest.approx(np.hypot(0.5, 60.0 / 3600.0))
    assert sigmas.accel_square_deg == pytest.approx(0.3 / np.sqrt(2.0))


def test_a_refused_run_is_counted() -> None:
    row = row_of("none", [None, None])
    assert row["refused_share"] == 1.0 and np.isnan(row["coverage"])


@pytest.mark.slow
def test_sigmas_are_near_in_a_few_runs() -> None:
    found = study_trajectory(FAST_RUNS, 5, families=(short(FAMILIES[0]),))
    (table,) = found.tables
    assert table["refused_share"][0] == 0.0
    for name in NEES:
        assert FAST_BAND[0] < table[name][0] < FAST_BAND[1], name
    assert table["coverage"][0] > 0.85 and table["latency_rms_s"][0] < 0.02
    assert "| uav-mems | 6 |" in found.markdown and "nan" not in found.markdown


@pytest.mark.slow
@pytest.mark.parametrize("family", FAMILIES, ids=lambda one: one.name)
def test_sigmas_hold(family: StudyFamily) -> None:
    (table,) = study_trajectory(RUNS, 5, families=(family,)).tables
    figures = {name: round(float(table[name][0]), 2) for name in NEES}
    print(figures)
    assert all(BAND[0] <= value <= BAND[1] for value in figures.values()), figures
    assert 0.92 < table["coverage"][0] < 0.98

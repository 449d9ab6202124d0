"""Parts of the magnetic estimator: signs by worked example, iron to rounding, forecasts against published figures."""

import math

import numpy as np
import pytest

from groundstation.base.angles import wrap_180
from groundstation.base.errors import SettingsError
from groundstation.methods import harmonics
from groundstation.systems.magnetic.alignment import align
from groundstation.systems.magnetic.answer import Method, MethodName
from groundstation.systems.magnetic.apply import corrected_by_coefficients, corrected_by_iron, corrected_by_table
from groundstation.systems.magnetic.attitude import field_in_body, levelled_heading_deg
from groundstation.systems.magnetic.compass_table import CENTRES_DEG, build_table
from groundstation.systems.magnetic.held_out import Unseen, advantage
from groundstation.systems.magnetic.iron import Iron, bank_bias, heading_errors, parameters_of
from groundstation.systems.magnetic.manoeuvre import covered_bins, widest_gap_deg
from groundstation.systems.magnetic.modulus import fit_modulus
from groundstation.systems.magnetic.poisson import EarthField
from groundstation.systems.magnetic.readings import Readings
from groundstation.systems.magnetic.settings import MagneticSettings
from groundstation.systems.magnetic.three_methods import recommend
from tests.systems.magnetic.example import correlated, taxi_heading

EARTH = EarthField(11.0, 17_000.0, 50_000.0)
ROUNDING_DEG = 1e-9


@pytest.mark.parametrize(("roll", "pitch"), [(0.0, 0.0), (20.0, 0.0), (-45.0, 10.0), (5.0, -30.0)])
def test_levelling_undoes_roll_and_pitch(roll: float, pitch: float) -> None:
    heading = np.arange(0.0, 360.0, 7.0)
    level = np.full(len(heading), roll), np.full(len(heading), pitch)
    shown = levelled_heading_deg(field_in_body(17_000.0, 50_000.0, heading, *level), *level)
    assert np.abs(wrap_180(shown - heading)).max() < ROUNDING_DEG


def test_sign_of_error_and_deviation_by_worked_example() -> None:
    """Iron that pulls north forward: at magnetic east the needle shows atan(17000 / 1000) = 86.63 deg.

    Error = 86.63 - 90 = -3.37 deg (B = -3.37); the deviation to add is +3.37 deg.
    """
    iron = Iron(np.eye(3), np.array([1000.0, 0.0, 0.0]))
    error = heading_errors(iron, 17_000.0, 50_000.0)
    shown = math.degrees(math.atan2(17.0, 1.0))
    at = np.interp(shown, CENTRES_DEG, error)
    assert at == pytest.approx(shown - 90.0, abs=1e-3)
    assert at == pytest.approx(-3.37, abs=0.01)
    assert harmonics.fit(CENTRES_DEG, error)[0] == pytest.approx([0.0, -3.37, 0.0, 0.0, 0.0], abs=0.01)
    corrected = corrected_by_table(np.array([shown]), -error)
    assert corrected[0] == pytest.approx(90.0, abs=1e-3)


def test_corrections_agree_and_cross_north() -> None:
    iron = Iron(np.array([[1.01, 0.01, 0.0], [0.0, 0.99, 0.0], [0.0, 0.0, 1.0]]), np.array([300.0, -200.0, 100.0]))
    heading = np.array([0.2, 359.8, 123.4, 270.0])
    level = np.zeros(4), np.zeros(4)
    reading = field_in_body(17_000.0, 50_000.0, heading, *level) @ iron.soft.T + iron.hard_nt
    shown = levelled_heading_deg(reading, *level)
    error = heading_errors(iron, 17_000.0, 50_000.0)
    values, _ = harmonics.fit(CENTRES_DEG, error)
    by_table = corrected_by_table(shown, -error)
    by_letters = corrected_by_coefficients(shown, dict(zip("ABCDE", values, strict=True)))
    by_iron = corrected_by_iron(reading, *level, parameters_of(iron, np.zeros((12, 12))))
    assert np.abs(wrap_180(by_iron - heading)).max() < ROUNDING_DEG
    assert np.abs(wrap_180(by_table - heading)).max() < 1e-3
    assert np.abs(wrap_180(by_letters - heading)).max() < 0.02  # what five coefficients leave of this iron


def test_bank_bias_grows_as_bank_squared_and_is_that_published() -> None:
    """Published for hard iron 1500 nT, soft iron 0.02, H 17 uT, Z 50 uT: 0.12, 0.46, 1.04 deg rms at 10, 20, 30 deg."""
    rng = np.random.default_rng(7)
    irons = [Iron(np.eye(3) + 0.02 * rng.standard_normal((3, 3)), 1500.0 * rng.standard_normal(3)) for _ in range(200)]
    rms = [
        float(np.sqrt(np.mean([np.mean(bank_bias(iron, 17_000.0, 50_000.0, bank) ** 2) for iron in irons])))
        for bank in (10.0, 20.0, 30.0)
    ]
    assert rms == pytest.approx([0.12, 0.46, 1.04], rel=0.2)  # the spread of a draw of 200
    assert [rms[1] / rms[0], rms[2] / rms[0]] == pytest.approx([4.0, 9.0], rel=0.1)


def test_coefficients_know_their_error_when_noise_is_correlated() -> None:
    rng = np.random.default_rng(3)
    heading = np.linspace(0.0, 720.0, 4000) % 360.0
    truth = np.array([0.5, -2.0, 1.0, 0.3, -0.2])
    scores = []
    for _ in range(200):
        noise = 0.3 * correlated(rng, (len(heading), 1), 2.0)[:, 0]
        values, covariance = harmonics.fit(heading, harmonics.design(heading) @ truth + noise)
        scores.append((values - truth) / np.sqrt(np.diag(covariance)))
    assert np.sqrt(np.mean(np.square(scores), axis=0)) == pytest.approx(np.ones(5), abs=0.2)  # 4 sigma of 200 draws


def test_coefficients_know_their_error_when_noise_wanders_below_white_noise() -> None:
    """White noise hides 20 s of correlation from neighbours; by these alone sigmas would be four times too small."""
    rng = np.random.default_rng(3)
    heading = np.linspace(0.0, 720.0, 4000) % 360.0
    scores = []
    for _ in range(200):
        noise = 0.3 * correlated(rng, (len(heading), 1), 20.0)[:, 0] + 0.2 * rng.standard_normal(len(heading))
        values, covariance = harmonics.fit(heading, noise)
        scores.append(values / np.sqrt(np.diag(covariance)))
    assert (np.sqrt(np.mean(np.square(scores), axis=0)) < 1.7).all()


def test_table_averages_branches_and_fills_gaps() -> None:
    heading = np.concatenate([np.arange(0.5, 360.0), np.arange(0.5, 360.0)])
    error = np.where(np.arange(720) < 360, 182.0, -176.0)  # 182 and 184 on the circle
    kept = np.flatnonzero((heading < 100.0) | (heading > 110.0))
    right, left = kept[kept < 360], kept[kept >= 360]
    table = build_table(heading, error, right, left)
    assert wrap_180(table.average_deg - 183.0) == pytest.approx(np.zeros(360), abs=1e-9)
    assert np.count_nonzero(~table.is_measured) == 10
    assert widest_gap_deg(table.is_measured) == 10.0
    assert covered_bins(heading[right], 5.0).mean() == pytest.approx(350 / 360)
    assert covered_bins(heading[right], 10.0).all()
    assert not covered_bins(np.zeros(0), 10.0).any()


# Prior art


def test_modulus_finds_its_own_six_coefficients_in_steep_turns() -> None:
    heading = np.tile(np.arange(0.0, 360.0, 3.0), 5)
    roll = np.repeat([0.0, 60.0, -60.0, 30.0, 0.0], 120)
    pitch = np.repeat([0.0, 0.0, 0.0, 25.0, -40.0], 120)
    soft = np.array([[1.03, 0.01, 0.0], [0.01, 0.98, 0.0], [0.0, 0.0, 1.0]])
    hard = np.array([900.0, -700.0, 1200.0])
    reading = field_in_body(17_000.0, 50_000.0, heading, roll, pitch) @ soft.T + hard
    fit = fit_modulus(reading, EARTH, MagneticSettings())
    assert fit.reason == ""
    assert fit.iron.hard_nt == pytest.approx(hard, abs=0.01)
    assert fit.iron.soft == pytest.approx(soft, abs=1e-6)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("field", [np.zeros((0, 3)), np.zeros((5, 3)), np.ones((1, 3)), np.full((50, 3), 1e12)])
def test_modulus_refuses_what_says_nothing(field: np.ndarray) -> None:
    assert fit_modulus(field, EARTH, MagneticSettings()).reason


# Alignment


def test_alignment_is_carried_to_the_figure() -> None:
    """0.3 deg at 600 s, drift 0.05 +- 0.06 weighed against 0 +- 0.1: after an hour 0.3 + 0.0368."""
    heading = taxi_heading(
        error_deg=0.3, standard_error_deg=0.1, drift_deg_per_h=0.05, drift_sigma_deg_per_h=0.06, reference_time_s=600.0
    )
    found = align(heading, "ins", 4200.0, MagneticSettings())
    weight = 0.1**2 / (0.1**2 + 0.06**2)
    assert found.error_deg == pytest.approx(0.3 + weight * 0.05)
    assert found.sigma_deg == pytest.approx(math.hypot(0.1, math.sqrt(weight) * 0.06))


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"ins_topic": "ins.2"}, "is that of ins.2"),
        ({"verdict": "reject", "verdict_reason": "too few"}, "rejected (too few)"),
        ({"error_deg": math.nan}, "not a number"),
    ],
)
def test_an_alignment_that_does_not_hold_is_not_used(changes: dict[str, object], reason: str) -> None:
    found = align(taxi_heading(**changes), "ins", 100.0, MagneticSettings())
    assert (found.error_deg, found.sigma_deg, found.aligned_at_s) == (0.0, 1.0, None)
    assert reason in found.origin
    assert (
        align(None, "ins", 100.0, MagneticSettings()).origin
        == "not aligned: no heading error from taxi; no azimuth by turns"
    )


def test_settings_out_of_range_are_refused() -> None:
    with pytest.raises(SettingsError, match="coverage_min"):
        MagneticSettings(coverage_min=2.0)


@pytest.mark.parametrize(("roll", "pitch", "letter"), [(0.1, 0.0, 2), (0.0, 0.1, 1)])
def test_roll_held_wrong_is_seen_as_c_and_pitch_as_b(roll: float, pitch: float, letter: int) -> None:
    """0.1 deg x Z / H: what the setting ``attitude_wander_deg`` puts into the sigmas of B and C."""
    heading = np.arange(0.0, 360.0, 1.0)
    level = np.zeros(len(heading))
    reading = field_in_body(EARTH.horizontal_nt, EARTH.down_nt, heading, level, level)
    shown = levelled_heading_deg(reading, level + roll, level + pitch)
    found = harmonics.fit(shown, wrap_180(shown - heading))[0]
    assert abs(found[letter]) == pytest.approx(0.1 * 50.0 / 17.0, rel=0.01)
    assert np.abs(np.delete(found, letter)).max() < 0.005


# Which method


def rows_of(table_deg: float, iron_deg: float, sigma_table: float, sigma_iron: float) -> tuple[Method, ...]:
    def row(name: MethodName, left_deg: float, sigma_deg: float) -> Method:
        sigmas = dict.fromkeys("ABCDE", sigma_deg)
        return Method(name, "fitted", held_out_after_deg=left_deg, coefficients_sigma_deg=sigmas)

    return row("compass_table", table_deg, sigma_table), row("poisson_attitude", iron_deg, sigma_iron)


@pytest.mark.parametrize(
    ("gain_sigmas", "sigmas", "method", "reason"),
    [
        (3.0, (0.1, 0.5), "poisson_attitude", "the iron leaves less: 0.30 against 0.90 deg rms"),
        (-3.0, (0.5, 0.1), "compass_table", "the iron leaves more: 0.30 against 0.90 deg rms"),
        (1.0, (0.5, 0.1), "poisson_attitude", "has none"),
        (1.0, (0.1, 0.5), "compass_table", "known less well (0.71 against 0.14 deg)"),
    ],
)
def test_what_is_left_decides_where_it_tells_and_the_sigma_elsewhere(
    gain_sigmas: float, sigmas: tuple[float, float], method: str, reason: str
) -> None:
    found, told = recommend(rows_of(0.9, 0.3, *sigmas), gain_sigmas, 0.2, 20.0, MagneticSettings())
    assert found == method
    assert told.endswith(reason)


def test_advantage_counts_stretches_not_readings() -> None:
    """Six stretches of 20 s, 1 deg in each against 0.5 in all but one: mean gain over its scatter."""
    time_s = np.concatenate([100.0 * stretch + np.arange(0.0, 20.0, 0.5) for stretch in range(6)])
    nothing = np.zeros(len(time_s))
    readings = Readings(time_s, np.zeros((len(time_s), 3)), *[nothing] * 7)
    unseen = Unseen(readings, nothing, 0.0)
    second = np.where(time_s < 50.0, 1.2, 0.5)
    gains = np.array([1.0 - 1.44, *[0.75] * 5])
    expected = np.mean(gains) / np.std(gains, ddof=1) * np.sqrt(6)
    assert advantage(unseen, np.ones(len(time_s)), second) == pytest.approx(expected)
    assert advantage(unseen, second, second) == 0.0

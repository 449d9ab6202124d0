"""Truth of the magnetic deviation: readings of a simulated magnetometer at every heading.

They are without noise.
"""

from collections.abc import Mapping

import numpy as np

from groundstation.base.angles import FloatArray, direction_of, unwrap, wrap_180
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import frozen
from groundstation.simulation.magnetometer import sensed_nt, world_field_nt
from groundstation.simulation.scenario import MagnetometerSettings, Scenario
from groundstation.simulation.trajectory import ANGLE_OF_ATTACK_DEG, Trajectory, rotation_n_from_b

HEADING_DEG = np.arange(0.0, 360.0, 0.25)
BIN_MIDDLES_DEG = np.arange(360) + 0.5
LETTERS = "ABCDE"


@dataclass(frozen=True)
class DeviationTruth:
    """Deviation of one magnetometer at one place and one attitude, for all headings.

    Parameters
    ----------
    compass_error_deg : ndarray, shape (360,)
        Magnetic heading shown minus true heading, in the middle of bin [k, k+1) of the heading shown. NaN all over
        where iron is so strong that one heading shown belongs to several true ones.
    declination_deg : float
        East positive.
    horizontal_nt : float
    """

    compass_error_deg: FloatArray
    declination_deg: float
    horizontal_nt: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "compass_error_deg", frozen(self.compass_error_deg))

    @property
    def deviation_deg(self) -> FloatArray:
        """Angle to add to the heading shown to get the magnetic heading, by bin, shape (360,)."""
        return np.asarray(wrap_180(-self.compass_error_deg - self.declination_deg))

    @property
    def coefficients_deg(self) -> Mapping[str, float]:
        """Coefficients A to E of heading shown minus magnetic heading.

        The difference is A + B sin c + C cos c + D sin 2c + E cos 2c.
        """
        shown_rad = np.deg2rad(BIN_MIDDLES_DEG)
        waves = (np.sin(shown_rad), np.cos(shown_rad), np.sin(2.0 * shown_rad), np.cos(2.0 * shown_rad))
        error = -self.deviation_deg
        values = [float(np.mean(error)), *(2.0 * float(np.mean(wave * error)) for wave in waves)]
        return dict(zip(LETTERS, values, strict=True))


def levelled_heading_deg(field_body_nt: FloatArray, roll_deg: FloatArray, pitch_deg: FloatArray) -> FloatArray:
    """Return the magnetic heading of a field in body axes, shape (n, 3), in [0, 360).

    The field is turned level by roll and pitch.

    Examples
    --------
    >>> level = np.zeros(1)
    >>> levelled_heading_deg(np.array([[0.0, -17e3, 50e3]]), level, level).tolist()  # north is to the left
    [90.0]
    """
    level_from_b = rotation_n_from_b(roll_deg, pitch_deg, np.zeros_like(roll_deg))
    level = np.einsum("nij,nj->ni", level_from_b, field_body_nt)
    return direction_of(level[:, 0], -level[:, 1])


def deviation_truth(
    settings: MagnetometerSettings,
    field_ned_nt: FloatArray,
    *,
    roll_deg: float = 0.0,
    pitch_deg: float = 0.0,
    current_a: float = 0.0,
    roll_error_deg: float = 0.0,
    pitch_error_deg: float = 0.0,
) -> DeviationTruth:
    """Return the deviation of a magnetometer at a roll and pitch held on every heading.

    The reading is levelled with this roll and pitch.

    Parameters
    ----------
    settings : MagnetometerSettings
    field_ned_nt : ndarray, shape (3,)
    roll_deg, pitch_deg, current_a : float
    roll_error_deg, pitch_error_deg : float
        Errors of the attitude it is levelled with.

    Examples
    --------
    >>> truth = deviation_truth(MagnetometerSettings(hard_iron_nt=(170.0, 0.0, 0.0)), np.array([17e3, 0.0, 50e3]))
    >>> round(truth.coefficients_deg["B"], 3), round(float(truth.deviation_deg[90]), 2)
    (-0.573, 0.57)
    """
    roll, pitch, current = (np.full(len(HEADING_DEG), value) for value in (roll_deg, pitch_deg, current_a))
    field_body = np.einsum("nji,j->ni", rotation_n_from_b(roll, pitch, HEADING_DEG), field_ned_nt)
    reading = sensed_nt(field_body, roll, current, settings)
    shown = levelled_heading_deg(reading, roll + roll_error_deg, pitch + pitch_error_deg)
    going_on = unwrap(np.append(shown, shown[0]))
    goes_round_once = bool(np.all(np.diff(going_on) > 0.0)) and round(going_on[-1] - going_on[0]) == 360
    error = going_on[:-1] - HEADING_DEG
    place = np.argsort(shown)
    by_bin = np.interp(BIN_MIDDLES_DEG, shown[place], error[place], period=360.0)
    return DeviationTruth(
        compass_error_deg=wrap_180(by_bin) if goes_round_once else np.full(360, np.nan),
        declination_deg=float(np.rad2deg(np.arctan2(field_ned_nt[1], field_ned_nt[0]))),
        horizontal_nt=float(np.hypot(field_ned_nt[0], field_ned_nt[1])),
    )


def scenario_deviation(scenario: Scenario, motion: Trajectory) -> DeviationTruth | None:
    """Return the deviation in level flight under the base load; None without magnetometer.

    Without level flight it is that on the ground. Constant errors of the INS's roll and pitch are in it: the heading
    shown is levelled with them on every flight. The field is that of the middle of the flight: over 50 km the
    declination changes by tenths of a degree.
    """
    if scenario.magnetometer is None:
        return None
    flown = np.flatnonzero(motion.airborne)
    middle = flown[len(flown) // 2] if flown.size else len(motion) // 2
    field = world_field_nt(motion.at(np.array([middle])), scenario, scenario.magnetometer)[0]
    pitch_deg = ANGLE_OF_ATTACK_DEG if flown.size else 0.0
    base_a = scenario.electric.base_a if scenario.electric else 0.0
    return deviation_truth(
        scenario.magnetometer,
        field,
        pitch_deg=pitch_deg,
        current_a=base_a,
        roll_error_deg=scenario.ins.roll_error_deg,
        pitch_error_deg=scenario.ins.pitch_error_deg,
    )

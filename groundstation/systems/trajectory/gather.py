"""Input of the trajectory estimator from the tables of a flight."""

import numpy as np

from groundstation.base.errors import NotAssessableError
from groundstation.systems.known import Known
from groundstation.systems.trajectory.gathered import Gathered
from groundstation.systems.trajectory.gnss_input import gnss_of
from groundstation.systems.trajectory.imu_input import imu_of
from groundstation.systems.trajectory.imu_samples import SUBJECT
from groundstation.systems.trajectory.input_settings import InputSettings
from groundstation.tables.table import Flight

LEAST_OVERLAP_S = 1.0


def gather(flight: Flight, known: Known, settings: InputSettings) -> Gathered:
    """Return increments of the best inertial unit and fixes of the best receiver of a flight.

    Parameters
    ----------
    flight : Flight
    known : Known
        Its excluded intervals take fixes away.
    settings : InputSettings

    Raises
    ------
    NotAssessableError
        With the reason where there is no inertial unit, no GNSS, or no time in common.
    """
    imu, gnss = imu_of(flight, settings), gnss_of(flight, known.excluded_s, settings)
    start_s, end_s = float(imu.imu.time_s[0]), float(imu.imu.time_s[-1])
    common = np.count_nonzero((gnss.gnss.time_s >= start_s) & (gnss.gnss.time_s <= end_s))
    if common >= 2 and end_s - start_s < LEAST_OVERLAP_S:
        raise NotAssessableError(SUBJECT, f"{imu.facts.topic} has only {end_s - start_s:.1f} s")
    if common < 2:
        names = f"{imu.facts.topic} ({start_s:.0f} to {end_s:.0f} s) and {gnss.facts.topic}"
        span = f"{gnss.gnss.time_s[0]:.0f} to {gnss.gnss.time_s[-1]:.0f} s"
        raise NotAssessableError(SUBJECT, f"{names} ({span}) have no time in common")
    return Gathered(imu.imu, gnss.gnss, imu.facts, gnss.facts, (*imu.notes, *gnss.notes))

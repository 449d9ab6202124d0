"""Answer of the forecast mode (system 2): accuracy of a forecast of the INS errors.

The forecast is replayed on the flight itself.
"""

from dataclasses import field
from typing import ClassVar

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.results.answer import Answer
from groundstation.results.arrays.typed import found_in
from groundstation.results.figures import FigureData
from groundstation.results.forecast_methods import FORECAST_METHODS
from groundstation.results.roles import ForecastOfErrors, ReplayedForecasts
from groundstation.systems.inertial.forecast_arrays import ForecastFan

WITHIN, TOO_FEW = "within limits", "too few to judge"  # verdicts by NEES
FEWEST_STARTS = 5  # independent ones: with fewer the limits of NEES are so wide that anything passes

# Names of the contract, in the order they are shown; titles for people.


@dataclass(frozen=True)
class SkillRow:
    """Radial position error since the start of the outage, over all starts.

    It is of one method at one horizon. ``coverage95`` is the share of the channel errors inside the forecast's own 95 %
    band, None for a method without one; ``coverage95_model`` the same before the sigma is scaled to what the class and
    the flight's past show.
    """

    schema_name: ClassVar[str] = "skill"

    #: How the error is forecast; default_method is the shipped one.
    method: str = field(metadata={"one_of": tuple(FORECAST_METHODS)})
    horizon_min: float  #: Minutes since GNSS was lost.
    starts: int  #: Outages replayed.
    rms_m: float  #: RMS of the radial error built up since the start of the outage.
    median_m: float  #: Median of the same.
    p95_m: float  #: 95th percentile of the same.
    coverage95: float | None  #: Share of the channel errors inside the forecast's own 95 % band; null without a band.
    coverage95_model: float | None = None  #: The same before the sigma is scaled by class and past of the flight.


@dataclass(frozen=True)
class GapRow:
    """Errors of replayed gaps with GNSS on both sides.

    ``max_error_rms_m`` is the root mean square over the gaps of the largest radial error in each.
    """

    schema_name: ClassVar[str] = "gap"

    #: forward filter, or rts: smoothed with GNSS on both sides.
    method: str = field(metadata={"one_of": ("forward", "rts")})
    length_min: float  #: Length of the gap.
    starts: int  #: Gaps replayed.
    max_error_rms_m: float  #: RMS over the gaps of the largest radial error in each.
    coverage95: float | None  #: Share of the errors inside the 95 % band.


@dataclass(frozen=True)
class PhaseRow:
    """Replayed outages of one length that begin in one phase of flight, default method.

    ``is_early``: they begin before ``first_start_s``, when the filter has hardly settled, and every minute. All others
    are those of ``SkillRow``, parted by phase. None of an older version, which had both in one row.
    """

    schema_name: ClassVar[str] = "phase_outage"

    phase: str  #: Phase of flight in which they begin.
    length_s: float  #: Length of the outage.
    starts: int  #: Outages replayed.
    rms_m: float  #: RMS radial error of the default method.
    raw_rms_m: float  #: RMS radial error of the raw INS.
    is_early: bool | None = None  #: Begin before ``first_start_s``; null in results of older versions.


@dataclass(frozen=True)
class ClassicStart:
    """One of the paper's four starts (1.5, 2, 2.5, 3 h).

    It has the radial and the east error at the end and at equal horizons.
    """

    start_h: float  #: Hours from the beginning to the loss of GNSS.
    method: str = field(metadata={"one_of": tuple(FORECAST_METHODS)})  #: How the error is forecast.
    horizon_min: float  #: Minutes since GNSS was lost.
    error_m: float  #: Radial error.
    east_error_m: float  #: East error, forecast minus truth.


@dataclass(frozen=True)
class CalibrationRow:
    """Honesty of the forecast's sigma at one horizon: shares inside bands, and NEES.

    The bands are those of 50, 68 and 95 %. ``nees`` is the mean normalised squared error of the position forecast (two
    degrees of freedom, divided by two, so 1 is honest), ``nees_low``, ``nees_high`` its 95 % limits from the number of
    independent starts. ``scale`` is what the model's sigma was multiplied by (mean over the starts).
    """

    schema_name: ClassVar[str] = "calibration"

    method: str = field(metadata={"one_of": tuple(FORECAST_METHODS)})  #: How the error is forecast.
    horizon_min: float  #: Minutes since GNSS was lost.
    starts: int  #: Outages replayed: they overlap.
    independent_starts: int  #: Outages that fit in one after the other.
    inside50: float  #: Share of errors inside the 50 % band.
    inside68: float  #: Share of errors inside the 68 % band.
    inside95: float  #: Share of errors inside the 95 % band.
    nees: float  #: Mean normalised squared position error; 1 is honest.
    nees_low: float  #: Lower 95 % limit of NEES by independent starts.
    nees_high: float  #: Upper 95 % limit of NEES by independent starts.
    scale: float  #: Factor on the model's sigma, mean over the starts.


@dataclass(frozen=True)
class CoupledRow:
    """Gain of the coupled model over two separate channels.

    It is 1 - RMS ratio, of the last estimates of both. The coupled model has sixteen states: six of each channel, the
    azimuth error, its drift, two accelerometer biases.
    """

    schema_name: ClassVar[str] = "coupled"

    horizon_min: float  #: Minutes since GNSS was lost.
    rms_m: float  #: RMS radial error of the coupled model.
    gain: float  #: 1 minus its RMS over that of two separate channels.


@dataclass(frozen=True)
class ForecastResult(Answer, ForecastOfErrors):
    """Forecast skill on one flight.

    Parameters
    ----------
    default_method : str
        The method the corrected trajectory and the fan use.
    first_start_s, start_step_s : float
        Starts of ``skill``: every ``start_step_s`` from ``first_start_s`` of flight time on.
    is_calibrated : bool
        True where the log holds at least one Schuler period before the first outage; ``calibration_reason`` says why
        not.
    skill, gaps, phases, classic_starts, calibration, coupled
        Tables; see the rows. ``skill`` of the short term (up to 10 min) and of the long term differ by horizon alone.
    best_method : dict
        Horizon in minutes (as text) to the method with the least RMS on this flight.
    figures : tuple of FigureData
        ``forecast_map``, ``forecast_fan``, ``forecast_classic``.
    """

    analysis: ClassVar[str] = "forecast"
    schema_name: ClassVar[str] = analysis

    default_method: str = field(metadata={"one_of": tuple(FORECAST_METHODS)})
    first_start_s: float  #: Flight second of the first start of `skill`.
    start_step_s: float  #: Seconds between two starts of `skill`.
    is_calibrated: bool
    calibration_reason: str  #: Why it is not calibrated; empty where it is.
    skill: tuple[SkillRow, ...]  #: Error that builds up without GNSS, by method and horizon.
    gaps: tuple[GapRow, ...] = ()  #: Error within replayed gaps that have GNSS on both sides.
    phases: tuple[PhaseRow, ...] = ()  #: Error of outages that begin in one phase of flight.
    classic_starts: tuple[ClassicStart, ...] = ()  #: The paper's four starts, of a flight long enough.
    calibration: tuple[CalibrationRow, ...] = ()  #: Whether the forecast's sigma is honest, by horizon.
    coupled: tuple[CoupledRow, ...] = ()  #: What the coupled model gains over two channels.
    best_method: dict[str, str] = field(default_factory=dict, metadata={"one_of": tuple(FORECAST_METHODS)})
    figures: tuple[FigureData, ...] = ()

    def replayed(self) -> ReplayedForecasts | None:
        """Return the fan of the default method, None where it is not kept."""
        fan = found_in(self.figures, ForecastFan)
        if fan is None:
            return None
        forecast_m = np.stack([fan.north.forecast_m, fan.east.forecast_m], axis=1)
        sigma_m = np.stack([fan.north.sigma_m, fan.east.sigma_m], axis=1)
        return ReplayedForecasts(self.default_method, fan.start_s, fan.lead_s, forecast_m, sigma_m)


def honesty(independent_starts: int, nees: float, nees_low: float, nees_high: float) -> str:
    """Say in words what the NEES of a :class:`CalibrationRow` tells of the forecast's sigma.

    Examples
    --------
    >>> honesty(11, 1.1, 0.5, 1.7), honesty(11, 0.3, 0.5, 1.7), honesty(11, 2.0, 0.5, 1.7)
    ('within limits', 'modest', 'too sure')
    >>> honesty(1, 1.0, 0.03, 3.7)
    'too few to judge'
    """
    if independent_starts < FEWEST_STARTS:
        return TOO_FEW
    if nees > nees_high:
        return "too sure"
    return "modest" if nees < nees_low else WITHIN

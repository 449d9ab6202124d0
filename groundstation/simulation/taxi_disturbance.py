"""Disturbances of airframe, INS and GNSS on taxi, drawn one kind at a time.

The first family of taxi runs leaves them out. docs/evidence/heading.md tells the second family in words; :data:`KINDS`
are its cells.
"""

from dataclasses import replace
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.metar import MPS_PER
from groundstation.simulation.processes import gauss_markov

FloatArray = NDArray[np.float64]
Kind = Literal[
    "plain",
    "motion",
    "multipath",
    "multipath patches",
    "sideslip wander",
    "crab one way",
    "crab back-taxi",
    "INS wander",
    "step",
    "settling",
    "late receiver",
    "1 Hz receiver",
    "take-off run",
    "several at once",
]
KINDS: tuple[Kind, ...] = get_args(Kind)
PLAIN: Kind = "plain"
OWN_CRAB: tuple[Kind, ...] = ("crab one way", "crab back-taxi")  # their sideslip is what the cell is about
# Sideslip by crosswind, deg per m/s: the mean of a class; an aircraft has its own, half of the mean away (one sigma).
CLASS_FACTORS = {"light": 0.051, "jet trainer": 0.027, "business jet": 0.038, "airliner": 0.031}
WIND_MPS, REPORT_MPS = 3.6, 1.5  # sigma of either component of the wind, and of what a report says of it


@dataclass(frozen=True)
class Disturbance:
    """Sizes of the disturbances of one run; the defaults disturb nothing.

    Parameters
    ----------
    kind : str
        Cell of the family.
    motion_factor : float
        Correlated GNSS velocity error in motion over that at standstill.
    multipath_mps, multipath_phase_deg : float
        GNSS velocity error in motion whose direction is phase + 2 x track: constant along a straight, another in
        another direction.
    patches_mps, patches_s : float
        Gauss-Markov GNSS velocity error in motion, and its correlation time.
    sideslip_deg, sideslip_s : float
        Gauss-Markov sideslip (heading minus track), and its correlation time.
    crab_deg, is_crab_of_wind : float, bool
        Steady sideslip: the same in every direction, or crab x cos(track - first track) as a crosswind has it.
    ins_wander_deg, ins_wander_s : float
        Gauss-Markov error of the INS heading, and its correlation time. It is no part of the constant error.
    step_deg, step_share : float
        Step of the INS heading, at that share of the time between the end of standstill and the end of the run.
    settling_deg, settling_s : float
        INS heading error more at the first sample, gone with exp(-t / settling_s).
    latency_s, filter_s : float
        GNSS velocity as it was so long ago, and the time constant of a first-order filter before that.
    gnss_every_s : float
        Interval of the GNSS epochs; 0: as in the first family.
    factor, wind_mps : float, (float, float)
        Sideslip by crosswind, deg per m/s, and the velocity of the air, north and east.
    aircraft_class, metar : str
        Knowledge of the estimator: class of the aircraft and a METAR line; empty where nothing is stated.
    take_off_crab_deg : float or None
        The log goes on with a take-off run with so much sideslip; None: it ends at the holding point.
    """

    kind: Kind = PLAIN
    motion_factor: float = 1.0
    multipath_mps: float = 0.0
    multipath_phase_deg: float = 0.0
    patches_mps: float = 0.0
    patches_s: float = 20.0
    sideslip_deg: float = 0.0
    sideslip_s: float = 15.0
    crab_deg: float = 0.0
    is_crab_of_wind: bool = False
    ins_wander_deg: float = 0.0
    ins_wander_s: float = 100.0
    step_deg: float = 0.0
    step_share: float = 0.5
    settling_deg: float = 0.0
    settling_s: float = 100.0
    latency_s: float = 0.0
    filter_s: float = 0.0
    gnss_every_s: float = 0.0
    factor: float = 0.0
    wind_mps: tuple[float, float] = (0.0, 0.0)
    aircraft_class: str = ""
    metar: str = ""
    take_off_crab_deg: float | None = None

    def sideslip(self, rng: np.random.Generator, track_deg: FloatArray, first_deg: float, step_s: float) -> FloatArray:
        """Heading minus track beside sway, degrees, shape (n,)."""
        wind = np.cos(np.deg2rad(track_deg - first_deg)) if self.is_crab_of_wind else 1.0
        track_rad, (north_mps, east_mps) = np.deg2rad(track_deg), self.wind_mps
        from_left_mps = east_mps * np.cos(track_rad) - north_mps * np.sin(track_rad)
        steady = self.crab_deg * wind * np.ones(len(track_deg)) - self.factor * from_left_mps
        if not self.sideslip_deg:
            return steady
        return steady + gauss_markov(rng, (len(track_deg),), step_s, self.sideslip_deg, self.sideslip_s)

    def ins_error(self, time_s: FloatArray, taxi_start_s: float) -> FloatArray:
        """INS heading error beside constant, drift and wander, degrees, shape (n,)."""
        step_at_s = taxi_start_s + self.step_share * (float(time_s[-1]) - taxi_start_s)
        return self.step_deg * (time_s >= step_at_s) + self.settling_deg * np.exp(-time_s / self.settling_s)

    def ins_wander(self, rng: np.random.Generator, count: int, step_s: float) -> FloatArray:
        """Wander of the INS heading about its error, degrees, shape (n,)."""
        if not self.ins_wander_deg:
            return np.zeros(count)
        return gauss_markov(rng, (count,), step_s, self.ins_wander_deg, self.ins_wander_s)

    def multipath(self, track_deg: FloatArray) -> FloatArray:
        """GNSS velocity error in motion that depends on direction, m/s, shape (2, n): north, east."""
        angle = np.deg2rad(self.multipath_phase_deg + 2.0 * track_deg)
        return self.multipath_mps * np.stack([np.cos(angle), np.sin(angle)])

    def patches(self, rng: np.random.Generator, count: int, step_s: float) -> FloatArray:
        """GNSS velocity error in motion that changes along the way, m/s, shape (2, n)."""
        if not self.patches_mps:
            return np.zeros((2, count))
        return gauss_markov(rng, (2, count), step_s, self.patches_mps, self.patches_s)

    def delayed(self, time_s: FloatArray, velocity_mps: FloatArray) -> FloatArray:
        """Velocity, shape (2, n), as the receiver shows it: filtered, then late."""
        if self.filter_s:
            from scipy.signal import lfilter

            keep = float(np.exp(-(time_s[1] - time_s[0]) / self.filter_s))
            velocity_mps = np.asarray(lfilter([1.0 - keep], [1.0, -keep], velocity_mps, axis=-1))
        if not self.latency_s:
            return velocity_mps
        return np.stack([np.interp(time_s - self.latency_s, time_s, row) for row in velocity_mps])


NO_DISTURBANCE = Disturbance()


def draw_disturbance(rng: np.random.Generator, kind: Kind) -> Disturbance:
    """Draw one disturbance of a cell of the second family."""

    def either(low: float, high: float) -> float:
        return float(rng.choice([-1.0, 1.0]) * rng.uniform(low, high))

    def spread(low: float, high: float) -> float:
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    none = Disturbance(kind)
    if kind == "motion":
        return replace(none, motion_factor=spread(2.0, 4.0))
    if kind == "multipath":
        phase = float(rng.uniform(0.0, 360.0))
        return replace(none, multipath_mps=float(rng.uniform(0.03, 0.1)), multipath_phase_deg=phase)
    if kind == "multipath patches":
        return replace(none, patches_mps=float(rng.uniform(0.03, 0.1)), patches_s=spread(10.0, 40.0))
    if kind == "sideslip wander":
        return replace(none, sideslip_deg=float(rng.uniform(0.15, 0.6)), sideslip_s=float(rng.uniform(10.0, 25.0)))
    if kind in ("crab one way", "crab back-taxi"):
        return replace(none, crab_deg=either(0.2, 0.5), is_crab_of_wind=kind == "crab back-taxi")
    if kind == "INS wander":
        return replace(none, ins_wander_deg=float(rng.uniform(0.05, 0.2)), ins_wander_s=spread(30.0, 200.0))
    if kind == "step":
        return replace(none, step_deg=either(0.3, 0.6), step_share=float(rng.uniform(0.3, 0.7)))
    if kind == "settling":
        return replace(none, settling_deg=either(0.1, 0.5), settling_s=spread(60.0, 300.0))
    if kind == "late receiver":
        return replace(none, latency_s=float(rng.uniform(0.1, 0.3)), filter_s=float(rng.uniform(0.2, 0.6)))
    if kind == "1 Hz receiver":
        return replace(none, gnss_every_s=1.0, latency_s=float(rng.uniform(0.0, 0.3)))
    if kind == "take-off run":
        return replace(none, take_off_crab_deg=either(0.5, 2.0))
    if kind == "several at once":
        return replace(
            none,
            motion_factor=spread(1.0, 3.0),
            multipath_mps=float(rng.uniform(0.0, 0.05)),
            multipath_phase_deg=float(rng.uniform(0.0, 360.0)),
            sideslip_deg=float(rng.uniform(0.0, 0.3)),
            sideslip_s=float(rng.uniform(10.0, 25.0)),
            crab_deg=float(rng.normal(0.0, 0.15)),
            ins_wander_deg=float(rng.uniform(0.0, 0.1)),
        )
    return none


def draw_wind(rng: np.random.Generator, disturbance: Disturbance) -> Disturbance:
    """Add the wind of an ordinary day to a disturbance.

    In half of the runs class and wind are stated.
    """
    name = str(rng.choice(list(CLASS_FACTORS)))
    wind_mps, off_mps = rng.normal(0.0, WIND_MPS, 2), rng.normal(0.0, REPORT_MPS, 2)
    factor, is_stated = CLASS_FACTORS[name] * float(rng.normal(1.0, 0.5)), rng.random() < 0.5
    if disturbance.kind in OWN_CRAB:
        return disturbance
    there = replace(disturbance, factor=factor, wind_mps=(float(wind_mps[0]), float(wind_mps[1])))
    return replace(there, aircraft_class=name, metar=metar_line(wind_mps + off_mps)) if is_stated else there


def metar_line(wind_mps: FloatArray) -> str:
    """Return a METAR line with this wind, at the time of the simulated flights.

    The wind is velocity north and east, rounded to 10 deg and 1 kt.
    """
    knots = round(float(np.hypot(*wind_mps)) / MPS_PER["KT"])
    tens = round(float(np.rad2deg(np.arctan2(-wind_mps[1], -wind_mps[0]))) / 10.0) % 36 or 36
    return f"METAR XXXX 040600Z {10 * tens if knots else 0:03d}{knots:02d}KT 9999 FEW030 12/05 Q1013="


def turns_of(kind: Kind, rng: np.random.Generator, turns_deg: tuple[float, ...]) -> tuple[float, ...]:
    """Return the turns between the segments.

    They are as drawn, but for the cells that are about directions.
    """
    if kind == "crab one way":
        return tuple(30.0 * (-1.0) ** number for number in range(len(turns_deg)))
    if kind == "crab back-taxi":
        return tuple(180.0 * float(rng.choice([-1.0, 1.0])) for _ in turns_deg)
    return turns_deg

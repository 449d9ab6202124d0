"""Flights of the study of alignment and shutdown: simulated, judged, kept small."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import NotAssessableError
from groundstation.base.units import M_PER_NAUTICAL_MILE
from groundstation.simulation.ins_parked import ParkedFlight, ParkedSettings, simulate_parked
from groundstation.systems.inertial.alignment_answer import GroundResult
from groundstation.systems.inertial.alignment_ends import EDGE_S, PARKED_S
from groundstation.systems.inertial.alignment_findings import assess_ground
from groundstation.systems.inertial.alignment_slopes import means_with_sigma, slopes_of
from groundstation.systems.inertial.analysis import INERTIAL
from groundstation.systems.inertial.settings import InertialSettings
from groundstation.systems.inertial.units_answer import Measured
from groundstation.systems.known import Known
from groundstation.systems.study import RunStore
from groundstation.tables.phases import Phases

Progress = Callable[[str], None]
FIRST_SEED = 70_000
ARCSEC_PER_RAD = 180.0 / np.pi * 3600.0
S_PER_MIN = 60.0
STILL = ParkedSettings(alignment="still")
# The assumptions hold in the first five; the wind, a tug and cold sensors break them in the others.
CASES: dict[str, ParkedSettings] = {
    "navigation, manoeuvring": ParkedSettings(),
    "navigation, straight": replace(STILL, route="straight"),
    "navigation, dogleg": ParkedSettings(route="dogleg", stand_s=120.0),
    "i-21, manoeuvring": ParkedSettings(ins="i-21"),
    "i-21, straight": replace(STILL, ins="i-21", route="straight"),
    "rocking in the wind": ParkedSettings(rocking_mps=0.1),
    "moved by a tug": ParkedSettings(tug_m=40.0),
    "warm-up": ParkedSettings(warm_up_dph=0.05, warm_up_ug=100.0),
}


@dataclass(frozen=True)
class GroundCell:
    """One value of the table: its error against the truth, and half of its interval."""

    quantity: str
    error: float
    half95: float


@dataclass(frozen=True)
class GroundOutcome:
    """Outcome of one flight. ``why_not`` is the reason where nothing was told."""

    case: str
    run: int
    kind: str = ""
    basis: str = ""
    is_moved: bool | None = None
    is_above: bool | None = None
    drift_over_limit: float = float("nan")
    cells: tuple[GroundCell, ...] = ()
    why_not: str = ""


def run_ground(
    runs: int,
    seed: int,
    progress: Progress | None = None,
    *,
    kept: RunStore[GroundOutcome] | None = None,
    is_over: Callable[[], bool] = lambda: False,
) -> list[GroundOutcome]:
    """Fly every case so many times."""
    found: list[GroundOutcome] = []
    for run in range(runs):
        for number, (name, settings) in enumerate(CASES.items()):
            if is_over():
                return found
            place, own_seed = f"ground {name}", FIRST_SEED + 100 * seed + number
            outcome = None if kept is None else kept.get(f"{place} {own_seed}", run)
            if outcome is None:
                outcome = judge_parked(name, settings, own_seed, run)
                if kept is not None:
                    kept.put(f"{place} {own_seed}", run, outcome)
            found.append(outcome)
            if progress is not None:
                progress(f"{name}: flight {run + 1} of {runs}")
    return found


def judge_parked(case: str, settings: ParkedSettings, seed: int, run: int) -> GroundOutcome:
    """Simulate a flight and hold what is told of it against the truth."""
    flight = simulate_parked(settings, seed, run)
    try:
        found = _assessed(flight)
    except NotAssessableError as error:
        return GroundOutcome(case, run, why_not=str(error))
    standing = found.standing
    over = float("nan")
    if standing is not None and standing.limit_mps_per_min:
        over = standing.size_mps_per_min.value / standing.limit_mps_per_min
    return GroundOutcome(
        case,
        run,
        found.alignment.kind,
        found.alignment.basis,
        found.alignment.is_moved,
        None if standing is None else standing.is_above,
        over,
        tuple(_cells(flight, found)),
    )


def _assessed(flight: ParkedFlight) -> GroundResult:
    settings = InertialSettings()
    known = Known(Phases((), "not asked for"), settings={"inertial": settings})
    inertial = INERTIAL.run(flight.log, known, settings)
    workings = {} if inertial.workings is None else {"inertial": inertial.workings}
    known = replace(known, answers={"inertial": inertial.answer}, workings=workings)
    return assess_ground(flight.log, known, settings)[0]


def _cells(flight: ParkedFlight, found: GroundResult) -> list[GroundCell]:
    cells: list[GroundCell] = []

    def hold(quantity: str, told: Measured | None, truth: float) -> None:
        if told is not None:
            cells.append(GroundCell(quantity, told.value - truth, told.half95))

    start, standing, end = found.at_start, found.standing, found.shutdown
    if start is not None:
        tilt = ARCSEC_PER_RAD * flight.tilt_rad[0]
        hold("tilt, arcsec", start.tilt_north_arcsec, float(tilt[0]))
        hold("tilt, arcsec", start.tilt_east_arcsec, float(tilt[1]))
        hold("azimuth, deg", start.azimuth_deg, float(np.rad2deg(flight.azimuth_error_rad[0])))
    if standing is not None:
        rows = (flight.time_s >= standing.start_s) & (flight.time_s < standing.end_s)
        slopes = slopes_of(flight.time_s[rows], flight.velocity_error_mps[rows])
        if slopes is not None:
            truth = S_PER_MIN * float(np.hypot(slopes[0].value, slopes[1].value))
            hold("standing drift, m/s per min", standing.size_mps_per_min, truth)
    if end.start_s is not None and end.end_s is not None:
        begin_s = max(end.start_s + EDGE_S, end.end_s - PARKED_S)
        rows = (flight.time_s >= begin_s) & (flight.time_s <= end.end_s)
        means = means_with_sigma(flight.time_s[rows], flight.velocity_error_mps[rows])
        if means is not None:
            hold("speed at shutdown, m/s", end.residual_speed_mps, float(np.hypot(means[0].value, means[1].value)))
        distance = float(np.hypot(*np.mean(flight.position_error_m[rows], axis=0)))
        hold("position at the end, m", end.position_error_m, distance)
        if end.hours:
            hold("terminal rate, nmi/h", end.terminal_rate_nmiph, distance / M_PER_NAUTICAL_MILE / end.hours)
    return cells


def ratios(cells: list[GroundCell]) -> FloatArray:
    """Return errors over half of the interval."""
    return np.array([one.error / one.half95 for one in cells if one.half95 > 0.0])

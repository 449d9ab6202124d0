"""Third family of the magnetic study: figure-eights after a taxi of every verdict.

Described in docs/evidence/magnetic.md. The INS is off by up to 2 deg; what aligns it is the flight's own taxi, or its
turns where the taxi may not.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from groundstation.base.angles import FloatArray, wrap_180, wrap_360
from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import NotAssessableError
from groundstation.base.records import Column
from groundstation.methods.roles import HeadingOnGround
from groundstation.results.figures import FigureData
from groundstation.results.roles import AzimuthByTurns, Delays, HeadingByTrack
from groundstation.simulation.deviation import deviation_truth
from groundstation.simulation.flight import Simulated, simulate
from groundstation.simulation.legs import GroundTurn, Leg, Parked, Taxi
from groundstation.simulation.magnetic_family import draw_magnetic_scenario
from groundstation.simulation.magnetometer import world_field_nt
from groundstation.simulation.processes import gauss_markov
from groundstation.simulation.readings import generator
from groundstation.simulation.scenario import GnssSettings, GroundMotion, Scenario
from groundstation.simulation.trajectory import ANGLE_OF_ATTACK_DEG
from groundstation.systems.answers_by_role import answered
from groundstation.systems.magnetic.estimate import estimate_deviation
from groundstation.systems.magnetic.study.cases import JUDGED, seed_of
from groundstation.tables.phases import flight_phases
from groundstation.tables.table import Flight

TAXIED = replace(JUDGED, wind_sigma_mps=3.6)
AZIMUTH_MAX_DEG = 2.0
FACTORS_DEG_PER_MPS = (0.051, 0.027, 0.038, 0.031)  # light, jet trainer, business jet, airliner
STEADY_DEG, MOUNTING_DEG = 0.05, 0.1
STAND, LINED_UP = Parked(40.0), Parked(5.0)
TWO_WAYS = (Taxi(450.0, 10.0), GroundTurn(180.0), Taxi(450.0, 10.0))
CORNER = (Taxi(400.0, 10.0), GroundTurn(90.0), Taxi(400.0, 10.0))
LEGS_BEFORE_TAKE_OFF = 5  # of the family's flights
QUIET_MPS, NOISY_MPS = (0.02, 0.005), (0.05, 0.03)  # velocity of the receiver: white, correlated over 3 s
QUALITY = frozenset({"gdop", "pdop", "hdop", "vdop", "tdop", "velocity_sigma_mps"})
Spoil = Callable[[Flight, np.random.Generator], Flight]


@dataclass(frozen=True)
class TaxiCell:
    """A taxi, a receiver, and what is spoilt in the log afterwards."""

    taxi: tuple[Leg, ...] = CORNER
    receiver_mps: tuple[float, float] = QUIET_MPS
    spoil: Spoil | None = None


@dataclass(frozen=True)
class TaxiOutcome:
    """One flight: verdicts, source of its alignment, error and sigma of A of the table.

    ``heading_error_deg``: heading analysis minus truth of the airframe; NaN where there is none. ``left_deg``: error of
    the alignment at the figure.
    """

    cell: str
    heading_verdict: str
    verdict: str
    reason: str
    origin: str
    a_error_deg: float
    a_sigma_deg: float
    left_deg: float
    heading_error_deg: float


def taxi_cells() -> dict[str, TaxiCell]:
    """Return the cells by name, in the order of the runs."""
    return {
        "two ways": TaxiCell(TWO_WAYS),
        "one way": TaxiCell((Taxi(800.0, 10.0),)),
        "short": TaxiCell((Taxi(130.0, 10.0),)),
        "no switch": TaxiCell(spoil=_without_switch),
        "noisy receiver": TaxiCell(receiver_mps=NOISY_MPS),
        "multipath": TaxiCell(spoil=_multipath),
        "step": TaxiCell(spoil=_step),
        "mode change": TaxiCell(spoil=_mode_change),
        "held velocity": TaxiCell(TWO_WAYS, spoil=_held),
        "wandering INS": TaxiCell(spoil=_wander),
        "begins in the air": TaxiCell(spoil=_in_the_air),
    }


def simulate_taxi_flight(cell: TaxiCell, seed: int) -> Simulated:
    """Simulate one flight of a cell.

    The truth of the INS heading is that of its scenario, except for what the cell spoils.
    """
    simulated = simulate(_drawn(cell, seed))
    if cell.spoil is None:
        return simulated
    return replace(simulated, flight=cell.spoil(simulated.flight, generator(seed, "spoilt taxi")))


def taxi_outcome(name: str, seed: int) -> TaxiOutcome:
    """Fly one flight of a cell, answer it as the pipeline does and judge A by the truth."""
    simulated = simulate_taxi_flight(taxi_cells()[name], seed)
    flight, scenario = simulated.flight, simulated.scenario
    known = answered(flight, flight_phases(flight), (Delays, HeadingByTrack, AzimuthByTurns))
    heading = known.answer_meeting(HeadingByTrack)
    truth = true_airframe_error(simulated)
    off = np.nan if heading is None else wrap_180(heading.error_deg - truth(heading.reference_time_s or 0.0))
    told = "none" if heading is None else heading.verdict
    try:
        found = estimate_deviation(
            flight,
            heading=heading,
            on_ground=known.role(HeadingOnGround),
            by_turns=known.answer_meeting(AzimuthByTurns),
            latencies=known.answer_meeting(Delays),
        )
    except NotAssessableError as error:
        nan = float("nan")
        return TaxiOutcome(name, told, "not assessable", error.found, "", nan, nan, nan, float(off))
    a_error = wrap_180(found.coefficients_deg["A"] - true_a_deg(simulated))
    left = wrap_180(found.alignment.error_deg - truth(found.alignment.figure_at_s))
    assert scenario.magnetometer is not None
    return TaxiOutcome(
        *(name, told, found.verdict, found.verdict_reason, found.alignment.origin),
        *(float(a_error), found.coefficients_sigma_deg["A"], float(left), float(off)),
    )


def true_airframe_error(simulated: Simulated) -> Callable[[float], float]:
    """Return the true airframe error, INS heading minus heading of the nose, by flight second.

    The INS heading is that of the log, after all that was spoilt.
    """
    ins, truth = simulated.flight["ins"], simulated.flight["truth"]
    true_deg = np.interp(
        simulated.flight.time_s("ins"),
        simulated.flight.time_s("truth"),
        np.unwrap(truth.values("true_heading_deg"), period=360.0),
    )
    error_deg, time_s = wrap_180(ins.values("true_heading_deg") - true_deg), simulated.flight.time_s("ins")

    def at(when_s: float) -> float:
        near = np.abs(time_s - when_s) <= 1.0
        return float(np.median(error_deg[near]))

    return at


def true_a_deg(simulated: Simulated) -> float:
    """Return A of level flight by the truth, in the field at the middle of the flight."""
    scenario, magnetometer = simulated.scenario, simulated.scenario.magnetometer
    assert magnetometer is not None
    field = world_field_nt(simulated.trajectory, scenario, magnetometer)
    ins = scenario.ins
    truth = deviation_truth(
        magnetometer,
        field[len(field) // 2],
        pitch_deg=ANGLE_OF_ATTACK_DEG,
        roll_error_deg=ins.roll_error_deg,
        pitch_error_deg=ins.pitch_error_deg,
    )
    return truth.coefficients_deg["A"]


def fly_taxis(seed: int, runs: Sequence[int]) -> tuple[TaxiOutcome, ...]:
    """Fly some runs of the family; run k belongs to cell k modulo the number of cells."""
    names = tuple(taxi_cells())
    return tuple(taxi_outcome(names[run % len(names)], seed_of(seed, run)) for run in runs)


def taxi_table(outcomes: Sequence[TaxiOutcome]) -> FigureData:
    """Tabulate the error of A, a row for each cell and one for all.

    ``inside_3_sigma``: share of all tables, ``accepted_rms_deg`` and ``accepted_worst_deg``: error of A where accepted.
    """
    names = ("cell", "flights", "tables", "accepted", "inside_3_sigma", "accepted_rms_deg", "accepted_worst_deg")
    cells = [*dict.fromkeys(one.cell for one in outcomes), "all"]
    rows = [(cell, *_row([one for one in outcomes if cell in (one.cell, "all")])) for cell in cells]
    columns = {name: np.array([row[place] for row in rows]) for place, name in enumerate(names)}
    return FigureData("magnetic_taxis", columns, dict.fromkeys(names[4:], 3))


def _row(outcomes: Sequence[TaxiOutcome]) -> tuple[float, ...]:
    error = np.array([one.a_error_deg for one in outcomes])
    sigma = np.array([one.a_sigma_deg for one in outcomes])
    is_table = np.isfinite(error)
    accepted = np.abs(error[[one.verdict == "accept" for one in outcomes]])
    inside = np.abs(error[is_table]) <= 3.0 * sigma[is_table]
    return (
        *(len(outcomes), int(is_table.sum()), len(accepted)),
        float(np.mean(inside)) if inside.size else float("nan"),
        float(np.sqrt(np.mean(accepted**2))) if accepted.size else float("nan"),
        float(np.max(accepted, initial=0.0)),
    )


def _drawn(cell: TaxiCell, seed: int) -> Scenario:
    drawn, rng = draw_magnetic_scenario(TAXIED, seed), generator(seed, "taxi before a figure")
    factor = float(rng.choice(FACTORS_DEG_PER_MPS) * rng.normal(1.0, 0.5))
    ins = replace(
        drawn.ins,
        azimuth_error_deg=float(rng.uniform(-AZIMUTH_MAX_DEG, AZIMUTH_MAX_DEG)),
        boresight_deg=float(rng.normal(0.0, MOUNTING_DEG)),
        turns_velocity=True,
    )
    ground = GroundMotion(sideslip_deg=float(rng.normal(0.0, STEADY_DEG)), crosswind_slip_deg_per_mps=factor)
    white_mps, correlated_mps = cell.receiver_mps
    gnss = GnssSettings(
        rate_hz=10.0,
        velocity_white_mps=white_mps,
        velocity_correlated_mps=correlated_mps,
        velocity_correlation_s=3.0,
    )
    legs = (STAND, *cell.taxi, LINED_UP, *drawn.legs[LEGS_BEFORE_TAKE_OFF:])
    return replace(drawn, legs=legs, ins=ins, ground=ground, gnss=gnss)


def _without_switch(flight: Flight, _rng: np.random.Generator) -> Flight:
    gnss = flight["gnss"]
    bare = {name: column for name, column in gnss.columns.items() if name not in QUALITY}
    tables = {topic: flight[topic] for topic in flight.topics() if topic != "discrete"}
    return replace(flight, tables={**tables, "gnss": replace(gnss, columns=bare)})


def _taxi_s(flight: Flight) -> tuple[float, float]:
    """Return begin and end of the motion on the ground before the take-off run, s."""
    truth, time_s = flight["truth"], flight.time_s("truth")
    speed = np.hypot(truth.values("velocity_north_mps"), truth.values("velocity_east_mps"))
    moving = (speed > 2.0) & (time_s < time_s[np.argmax(speed > 25.0)] - 15.0)
    return float(time_s[moving][0]), float(time_s[moving][-1])


def _changed(flight: Flight, topic: str, **values: FloatArray) -> Flight:
    table = flight[topic]
    columns = {**table.columns, **{name: Column(value) for name, value in values.items()}}
    return replace(flight, tables={**flight.tables, topic: replace(table, columns=columns)})


def _heading_off(flight: Flight, added_deg: FloatArray) -> Flight:
    return _changed(flight, "ins", true_heading_deg=wrap_360(flight["ins"].values("true_heading_deg") + added_deg))


def _step(flight: Flight, rng: np.random.Generator) -> Flight:
    """Add a step of U(0.3, 0.6) deg to the INS heading at U(0.3, 0.7) of the taxi.

    From the step on the error is that of the scenario.
    """
    begin_s, end_s = _taxi_s(flight)
    at_s = begin_s + rng.uniform(0.3, 0.7) * (end_s - begin_s)
    size = rng.choice([-1.0, 1.0]) * rng.uniform(0.3, 0.6)
    return _heading_off(flight, size * (flight.time_s("ins") < at_s))


def _mode_change(flight: Flight, rng: np.random.Generator) -> Flight:
    """Let the INS leave alignment in the middle of the taxi.

    Over 20 s its heading settles to the scenario's.
    """
    begin_s, end_s = _taxi_s(flight)
    time_s, at_s = flight.time_s("ins"), begin_s + rng.uniform(0.5, 0.7) * (end_s - begin_s)
    size = rng.choice([-1.0, 1.0]) * rng.uniform(0.2, 0.6)
    since_s = np.maximum(time_s - at_s, 0.0)
    settled = _heading_off(flight, size * np.exp(-since_s / 20.0))
    return _changed(settled, "ins", mode=np.where(time_s >= at_s, "nav", "align"))


def _held(flight: Flight, _rng: np.random.Generator) -> Flight:
    """Hold the receiver's velocity through the turn between the straights."""
    truth = flight["truth"]
    rate = np.gradient(np.unwrap(truth.values("true_heading_deg"), period=360.0), flight.time_s("truth"))
    begin_s, end_s = _taxi_s(flight)
    time_s = flight.time_s("truth")
    turning = time_s[(np.abs(rate) > 4.0) & (time_s > begin_s) & (time_s < end_s)]
    gnss_s = flight.time_s("gnss")
    rows = np.flatnonzero((gnss_s >= turning[0]) & (gnss_s <= turning[-1]))
    values = {name: flight["gnss"].values(name).copy() for name in ("velocity_north_mps", "velocity_east_mps")}
    for column in values.values():
        column[rows] = column[rows[0]]
    return _changed(flight, "gnss", **values)


def _multipath(flight: Flight, rng: np.random.Generator) -> Flight:
    """Add a GNSS velocity error in motion.

    U(0.03, 0.1) m/s in the direction phase + 2 x track.
    """
    size, phase = rng.uniform(0.03, 0.1), rng.uniform(0.0, 360.0)
    gnss, time_s = flight["gnss"], flight.time_s("gnss")
    north, east = gnss.values("velocity_north_mps"), gnss.values("velocity_east_mps")
    begin_s, end_s = _taxi_s(flight)
    inside = (time_s >= begin_s) & (time_s <= end_s) & (np.hypot(north, east) > 1.0)
    towards_rad = np.deg2rad(phase) + 2.0 * np.arctan2(east, north)
    return _changed(
        flight,
        "gnss",
        velocity_north_mps=north + inside * size * np.cos(towards_rad),
        velocity_east_mps=east + inside * size * np.sin(towards_rad),
    )


def _wander(flight: Flight, rng: np.random.Generator) -> Flight:
    """Let the INS heading wander by U(0.1, 0.4) deg over LU(30, 200) s."""
    time_s = flight.time_s("ins")
    over_s = float(np.exp(rng.uniform(np.log(30.0), np.log(200.0))))
    step_s = float(np.median(np.diff(time_s)))
    return _heading_off(flight, gauss_markov(rng, (len(time_s),), step_s, float(rng.uniform(0.1, 0.4)), over_s))


def _in_the_air(flight: Flight, _rng: np.random.Generator) -> Flight:
    """Cut the log so that it begins 20 s after lift-off."""
    truth = flight["truth"]
    altitude = truth.values("altitude_ellipsoid_m")
    from_ns = int(truth.time_ns[np.argmax(altitude > altitude[0] + 1.0)]) + 20 * 10**9
    kept = {topic: flight[topic].take(flight[topic].time_ns >= from_ns) for topic in flight.topics()}
    return replace(flight, tables=kept, start_ns=from_ns)

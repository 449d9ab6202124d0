"""Flights of the study of several units: each simulated and judged, a small outcome kept."""

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Literal

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import NotAssessableError
from groundstation.base.geodesy import displaced_deg
from groundstation.simulation.ins_units.family import (
    BAD_INPUTS,
    BROKEN,
    FAULT_CASES,
    FaultCase,
    GnssMode,
    faulty_flight,
    gnss_mode,
    healthy_flight,
)
from groundstation.simulation.ins_units.flight import UnitsFlight, simulate_units
from groundstation.simulation.ins_units.log import units_log
from groundstation.simulation.ins_units.scenario import UnitsScenario
from groundstation.simulation.ins_units.settings import (
    AnyUnitFault,
    UnitClock,
    UnitReset,
    UnitsSettings,
    UnitStep,
)
from groundstation.simulation.ins_units.unit_faults import UnitErrors
from groundstation.systems.inertial.settings import InertialSettings
from groundstation.systems.inertial.units import judge_units
from groundstation.systems.inertial.units_answer import InsFault, InsUnit, Measured, UnitsResult
from groundstation.systems.inertial.units_grid import OnGrid, apart_m
from groundstation.systems.inertial.units_growth import growth_of
from groundstation.systems.inertial.units_log import unit_class, unit_reference, unit_tracks
from groundstation.systems.inertial.units_track import ReferenceTrack, UnitTrack
from groundstation.systems.inertial.units_verdict import size_of
from groundstation.systems.known import Known
from groundstation.systems.study import RunStore
from groundstation.tables.phases import Phases

Group = Literal["healthy", "fault", "bad", "broken"]
Progress = Callable[[str], None]

FIRST_SEED, SEEDS_PER_STUDY = 60_000, 10
FAULT_SHARE, BAD_SHARE, BROKEN_SHARE = 0.12, 0.06, 0.21  # of the healthy flights, for each case
FEWEST = 6  # flights of a case: one of each number of units and GNSS mode
CALLED = ("off", "one_of")
QUANTITIES = ("rate_fit_nmiph", "velocity_rms_mps", "schuler_mps", "largest_m")
GROWTHS = ("rate_nmiph", "velocity_mps", "schuler_mps", "largest_m")  # their names in a growth
WITH_TRUTH = ("healthy", "broken")  # groups of which the table of units is held against the truth
NO_PHASES = Phases((), "not asked for")  # the tracks of units do not rest on them
# Kinds under which a fault of the family may be reported.
EXPECTED_KIND = {
    **{kind: kind for kind in ("drift", "tilt", "step", "stuck", "frozen", "heading")},
    "reset": "step",
    "swapped": "swapped_axis",
}
EXACT = 1e-3  # sigma of the truth in place of GNSS: metres, and thousandths of it in m/s


@dataclass(frozen=True)
class CellError:
    """One value of the table of units: its error against the truth, and half of its interval."""

    quantity: str
    error: float
    half95: float


@dataclass(frozen=True)
class UnitsOutcome:
    """One judged flight.

    Parameters
    ----------
    group, case, size : str
        ``case`` is the kind of fault, the bad input or the broken assumption, empty on healthy flights.
    run, units : int
    mode, ins, route : str
    hours : float
    verdict, sentence : str
        ``not_assessable`` where the analysis gave no answer.
    off, faulty : tuple of str
        Topics that were named, and those that had something.
    kinds : tuple of str
        Of the faults reported.
    faulty_kinds : tuple of str
        Of those that name the faulty unit.
    late_s : float
        Seconds from the begin of the fault to the begin reported, NaN where none is.
    is_told : bool
        A bad input was recognised as what it is.
    cells : tuple of CellError
    """

    group: Group
    case: str
    size: str
    run: int
    units: int
    mode: GnssMode
    ins: str
    route: str
    hours: float
    verdict: str
    sentence: str
    off: tuple[str, ...] = ()
    faulty: tuple[str, ...] = ()
    kinds: tuple[str, ...] = ()
    faulty_kinds: tuple[str, ...] = ()
    late_s: float = float("nan")
    is_told: bool = False
    cells: tuple[CellError, ...] = ()

    @property
    def is_called(self) -> bool:
        """Some unit was called faulty."""
        return self.verdict in CALLED

    @property
    def is_found(self) -> bool:
        """The faulty unit is among those named, alone or as one of two."""
        return self.is_called and bool(set(self.faulty) & set(self.off))

    @property
    def is_named(self) -> bool:
        """The faulty unit is named, and no other."""
        return self.verdict == "off" and self.off == self.faulty

    @property
    def is_wrong(self) -> bool:
        """Units are named, and the faulty one is not among them."""
        return self.is_called and not self.is_found

    @property
    def has_kind(self) -> bool:
        """The kind of the fault is among those told of the faulty unit."""
        return EXPECTED_KIND.get(self.case, "") in self.faulty_kinds


@dataclass(frozen=True)
class UnitsCase:
    """Flights of one kind: group, case, size, seed, number of them, and what makes them."""

    group: Group
    case: str
    size: str
    seed: int
    flights: int
    draw: Callable[[int, int], UnitsSettings]

    @property
    def name(self) -> str:
        """File name of its runs."""
        parts = [self.group, self.case, self.size, str(self.seed)]
        return "-".join(part.replace(" ", "_").replace("/", "p") for part in parts if part)


def units_cases(runs: int, seed: int) -> tuple[UnitsCase, ...]:
    """Return all cases of a study with ``runs`` healthy flights.

    Examples
    --------
    >>> cases = units_cases(200, 81)
    >>> [(case.name, case.flights) for case in cases[:2]], len(cases)
    ([('healthy-60810', 200), ('fault-drift-2-60810', 24)], 36)
    """
    first = FIRST_SEED + SEEDS_PER_STUDY * seed

    def of_fault(group: Group, case: FaultCase, share: float) -> UnitsCase:
        def draw(family_seed: int, run: int) -> UnitsSettings:
            return faulty_flight(case, family_seed, run)

        return UnitsCase(group, case.kind, case.size, first, max(FEWEST, round(share * runs)), draw)

    def of_broken(name: str) -> UnitsCase:
        def draw(family_seed: int, run: int) -> UnitsSettings:
            return BROKEN[name](healthy_flight(family_seed, run))

        return UnitsCase("broken", name, "", first + 1, max(FEWEST, round(BROKEN_SHARE * runs)), draw)

    return (
        UnitsCase("healthy", "", "", first, runs, healthy_flight),
        *(of_fault("fault", case, FAULT_SHARE) for case in FAULT_CASES),
        *(of_fault("bad", case, BAD_SHARE) for case in BAD_INPUTS),
        *(of_broken(name) for name in BROKEN),
    )


def run_units(
    cases: Iterable[UnitsCase],
    progress: Progress | None = None,
    *,
    kept: RunStore[UnitsOutcome] | None = None,
    is_over: Callable[[], bool] | None = None,
) -> tuple[UnitsOutcome, ...]:
    """Fly and judge all flights of the cases; fewer where time is over.

    Flights that ``kept`` has are taken from there. The first of each case is always flown.
    """
    found: list[UnitsOutcome] = []
    for case in cases:
        for run in range(case.flights):
            outcome = kept.get(case.name, run) if kept else None
            if outcome is None:
                if run and is_over is not None and is_over():
                    break
                outcome = judge_flight(case, run)
                if kept:
                    kept.put(case.name, run, outcome)
                if progress:
                    progress(f"{case.name} run {run}: {outcome.sentence}")
            found.append(outcome)
    return tuple(found)


def judge_flight(case: UnitsCase, run: int) -> UnitsOutcome:
    """Simulate a flight, judge it, and hold the answer against the truth."""
    settings = case.draw(case.seed, run)
    flight = simulate_units(settings, case.seed, run)
    faulty = () if case.group == "broken" else tuple(flight.units[one.unit - 1].topic for one in settings.faults)
    blank = UnitsOutcome(
        group=case.group,
        case=case.case,
        size=case.size,
        run=run,
        units=settings.units,
        mode=gnss_mode(settings),
        ins=settings.ins_class.name,
        route=settings.route,
        hours=settings.duration_s / 3600.0,
        verdict="not_assessable",
        sentence="",
        faulty=faulty,
    )
    tracks = tracks_of(flight)
    try:
        answer = tracks.judged(tracks.reference)
    except NotAssessableError as error:
        return replace(blank, sentence=str(error))
    of_faulty = [one for one in answer.faults if set(one.topics) & set(faulty)]
    return replace(
        blank,
        verdict=answer.verdict,
        sentence=answer.sentence,
        off=answer.off,
        kinds=tuple(one.kind for one in answer.faults),
        faulty_kinds=tuple(one.kind for one in of_faulty),
        late_s=_late_s(settings, of_faulty, case.case),
        is_told=any(_is_told(one, answer) for one in settings.faults),
        cells=(
            *(_cells(flight, tracks, answer) if case.group in WITH_TRUTH else ()),
            *(_pair_cells(flight, answer) if case.group == "healthy" else ()),
            *_lags(settings, answer),
            *_fault_cells(settings, answer),
        ),
    )


@dataclass(frozen=True)
class Tracks:
    """Units and reference as the analysis takes them off the log of a flight."""

    units: tuple[UnitTrack, ...]
    reference: ReferenceTrack | None
    ins_class: str

    def judged(self, reference: ReferenceTrack | None) -> UnitsResult:
        """Judge the units against a reference."""
        return judge_units(self.units, reference, ins_class=self.ins_class)


def tracks_of(flight: UnitsFlight) -> Tracks:
    """Read the tracks off the log, kinds and start of navigation with them."""
    log = units_log(flight, UnitsScenario(flown=flight.settings))
    settings = InertialSettings()
    known = Known(NO_PHASES, settings={"inertial": settings})
    noise, _who = unit_class(log, known, settings)
    return Tracks(unit_tracks(log, known, settings), unit_reference(log, known, noise), noise.name)


def truth_track(flight: UnitsFlight) -> ReferenceTrack | None:
    """Return the truth at the times of the fixes, in place of them."""
    if flight.gnss is None or not len(flight.gnss.time_s):
        return None
    rows = np.searchsorted(flight.time_s, flight.gnss.time_s)
    motion = flight.truth.motion
    velocity: FloatArray = np.stack([motion.velocity_north_mps[0], motion.velocity_east_mps[0]], axis=1)
    return ReferenceTrack(
        topic="gnss",
        title="the truth",
        time_s=flight.time_s[rows],
        latitude_deg=motion.latitude_deg[0][rows],
        longitude_deg=flight.truth.longitude_deg[rows],
        velocity_mps=velocity[rows],
        position_sigma_m=EXACT,
        velocity_sigma_mps=1e-3 * EXACT,
    )


def _late_s(settings: UnitsSettings, told: list[InsFault], case: str) -> float:
    begins = [float(getattr(one, "at_s", getattr(one, "from_s", 0.0))) for one in settings.faults]
    found = [one.start_s for one in told if one.start_s is not None and one.kind == EXPECTED_KIND.get(case, "")]
    return float(found[0]) - begins[0] if found and begins else float("nan")


def _is_told(fault: AnyUnitFault, answer: UnitsResult) -> bool:
    """Tell whether a bad input was recognised."""
    unit = answer.units[fault.unit - 1]
    match fault.kind:
        case "clock":
            lags = [one.lag_s for one in answer.units if one.lag_s is not None]
            return any(abs(lag.value) > lag.half95 and abs(lag.value) > 0.1 for lag in lags)
        case "no_position":
            return not unit.has_position
        case "aided":
            return unit.state == "aided"
        case "twin":
            return any(one.state == "copy" for one in answer.units)
        case "exchanged":
            return len(unit.serials) > 1
        case _:
            return False


def _cells(flight: UnitsFlight, tracks: Tracks, answer: UnitsResult) -> list[CellError]:
    """Return the errors of the table of units: its values with GNSS less those with the truth."""
    reference = truth_track(flight)
    if reference is None:
        return []
    true = tracks.judged(reference)
    found: list[CellError] = []
    for unit, truth in zip(answer.units, true.units, strict=True):
        for name in QUANTITIES:
            found += _difference(name, unit, truth)
    return found


def _pair_cells(flight: UnitsFlight, answer: UnitsResult) -> list[CellError]:
    """Return the errors of the table of pairs: its values less those of the simulated errors.

    The healthy flights of the family begin with navigation: at the first second of the log.
    """
    units = {unit.topic: unit.errors for unit in flight.units}
    found: list[CellError] = []
    for pair in answer.pairs:
        first, second = units[pair.first], units[pair.second]
        apart = apart_m(_exactly(flight, second), _exactly(flight, first))
        velocity = second.velocity_mps - first.velocity_mps
        true = growth_of(flight.time_s, apart, velocity, from_first=not pair.is_start_known)
        heading = float(np.median(np.rad2deg(second.azimuth_rad - first.azimuth_rad)))
        truths = {name: size_of(true, of) for name, of in zip(QUANTITIES, GROWTHS, strict=True)}
        truths["heading_difference_deg"] = Measured(heading, 0.0)
        for name, truth in truths.items():
            value = getattr(pair, name)
            if value is not None and truth is not None:
                found.append(CellError(f"pair {name}", value.value - truth.value, value.half95))
    return found


def _exactly(flight: UnitsFlight, errors: UnitErrors) -> OnGrid:
    """Return the track of a unit without noise and rounding."""
    motion = flight.truth.motion
    places = motion.latitude_deg[0], flight.truth.longitude_deg
    latitude, longitude = displaced_deg(*places, motion.altitude_m[0], errors.position_m)
    heading = motion.heading_deg[0] + np.rad2deg(errors.azimuth_rad)
    return OnGrid(flight.time_s, latitude, longitude, motion.altitude_m[0], errors.velocity_mps, heading)


def _difference(name: str, unit: InsUnit, truth: InsUnit) -> list[CellError]:
    value, true = getattr(unit, name), getattr(truth, name)
    if value is None or true is None:
        return []
    return [CellError(name, value.value - true.value, value.half95)]


def _lags(settings: UnitsSettings, answer: UnitsResult) -> list[CellError]:
    """Return the errors of how late stamps are, where clocks have no rate.

    Clocks are set by the one unit that has no lag.
    """
    clocks = {one.unit: one for one in settings.faults if isinstance(one, UnitClock)}
    bases = [number for number, unit in enumerate(answer.units, start=1) if unit.lag_s is None and not unit.same_as]
    if len(bases) != 1 or any(one.rate_ppm for one in clocks.values()):
        return []
    late = {number: clocks[number].late_s if number in clocks else 0.0 for number in range(1, settings.units + 1)}
    return [
        CellError("lag_s", unit.lag_s.value - (late[number] - late[bases[0]]), unit.lag_s.half95)
        for number, unit in enumerate(answer.units, start=1)
        if unit.lag_s is not None
    ]


def _fault_cells(settings: UnitsSettings, answer: UnitsResult) -> list[CellError]:
    """Return the errors of the sizes of steps that were told of the unit that had them."""
    found = []
    for fault in settings.faults:
        if not isinstance(fault, UnitStep) or isinstance(fault, UnitReset):
            continue
        topic = answer.units[fault.unit - 1].topic
        sizes = {"m": np.hypot(fault.north_m, fault.east_m), "m/s": np.hypot(fault.north_mps, fault.east_mps)}
        for told in answer.faults:
            size = sizes.get(told.unit, 0.0)
            if told.kind == "step" and topic in told.topics and size and told.value is not None and told.half95:
                value = Measured(told.value, told.half95)
                found.append(CellError(f"step, {told.unit}", value.value - float(size), value.half95))
    return found

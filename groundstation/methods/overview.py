"""Arrays of the overview and data-quality figures: thinned flight, states, GNSS, ledger.

The states include the flight phases.
"""

from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from groundstation.base.gaps import Gaps, logged_ns
from groundstation.base.ledger import Ledger
from groundstation.base.nearest import nearest_rows
from groundstation.base.records import BoolArray, Int64Array
from groundstation.base.signals import EVENT_SEPARATOR, topics_of_kind
from groundstation.results.arrays.flight import GapRows, GnssLanes, LedgerRows, Overview, PhaseSpans, StateLanes
from groundstation.results.figures import FigureData
from groundstation.results.flight import ALTITUDE_DATUM, KIND_OF_VEHICLE, PHASES_BY, WHY_THAT_VEHICLE
from groundstation.tables.phases import Phases
from groundstation.tables.sources import FIX_FIELDS, sources_of_kind
from groundstation.tables.table import Flight, Table
from groundstation.tables.wheels import contact_of

MAX_OVERVIEW_ROWS = 4000
GAP_PERIODS = 5.0
LARGEST_QUIET_GAP_S = 3.0
ROWS_AT_ONCE = 1 << 18  # working arrays do not grow with a log
NEAR_NS = 1_000_000_000  # a value this near in time stands for a row that lacks it
# Also drawn where a topic of the kind has it: name, kind, and the columns in whose place it stands when they are empty.
ALSO = (
    ("roll_deg", "ins", ()),
    ("pitch_deg", "ins", ()),
    ("magnetic_heading_deg", "ins", ("heading_deg",)),
    ("true_airspeed_mps", "air", ()),
    ("indicated_airspeed_mps", "air", ("true_airspeed_mps",)),
    ("pressure_altitude_m", "baro", ("altitude_m",)),
    ("height_above_airfield_m", "baro", ("altitude_m", "pressure_altitude_m")),
)
NO_GNSS, NO_FIX, NOT_LOGGED = "no GNSS", "no fix", "not logged"
ALTITUDES = {"altitude_msl_m": "MSL", "altitude_ellipsoid_m": "ellipsoid"}  # the first that is logged is drawn
WITHOUT_DOP = "DOP not logged"
MODE = "mode "  # what the names of events that change the flight mode begin with


def first_of_kind(flight: Flight, kind: str, *fields: str) -> str | None:
    """First topic of a kind that has all the fields, None when there is none."""
    return next((topic for topic in sources_of_kind(flight, kind) if flight[topic].has(*fields)), None)


def runs_of(states: NDArray[np.str_], time_s: NDArray[np.float64], end_s: float) -> GnssLanes:
    """Return the run-length form of a state per sample: ``start_s``, ``end_s``, ``state``.

    Each run lasts until the next one.
    """
    change = np.flatnonzero(np.r_[True, states[1:] != states[:-1]]) if len(states) else np.array([], dtype=int)
    starts = time_s[change]
    ends = np.r_[starts[1:], end_s] if len(starts) else starts
    return GnssLanes(start_s=starts, end_s=ends, state=states[change])


def gnss_lanes(flight: Flight, geometry_limit: float) -> GnssLanes | None:
    """Return the state of GNSS over the flight.

    Good, dilution of precision above the limit or not logged, integrity lost, no fix, no GNSS; not logged in a pause
    of the log.
    """
    topic = first_of_kind(flight, "gnss", "velocity_north_mps") or first_of_kind(flight, "gnss", "latitude_deg")
    if topic is None:
        return None
    table = flight[topic]
    name = next((factor for factor in ("gdop", "pdop", "hdop") if table.has(factor)), None)
    states = np.full(len(table), "good" if name else WITHOUT_DOP, dtype="U24")
    if name:
        factor = table.values(name)
        states[~np.isfinite(factor)] = WITHOUT_DOP
        states[factor > geometry_limit] = f"{name} > {geometry_limit:g}"
    if table.has("integrity_ok"):
        states[table.values("integrity_ok") == 0.0] = "integrity lost"
    states[~_has_fix(table)] = NO_FIX
    time_ns, states = _with_ends_of_pauses(table.time_ns, states, flight)
    time_s, step_s = flight.seconds(time_ns), np.diff(flight.seconds(logged_ns(time_ns, flight.pauses)))
    if len(step_s):
        limit_s = max(GAP_PERIODS * float(np.median(step_s)), LARGEST_QUIET_GAP_S)
        after = np.flatnonzero(step_s > limit_s)
        at = after + 1
        states, time_s = np.insert(states, at, NO_GNSS), np.insert(time_s, at, time_s[after])
    lanes = runs_of(states, time_s, flight.duration_s)
    if time_s.size and time_s[-1] < flight.duration_s - LARGEST_QUIET_GAP_S:
        lanes = GnssLanes(
            start_s=np.r_[lanes.start_s, time_s[-1]],
            end_s=np.r_[lanes.end_s[:-1], time_s[-1], flight.duration_s],
            state=np.r_[lanes.state, np.array([NO_GNSS])],
        )
    return _paused(lanes, flight)


def _has_fix(table: Table) -> BoolArray:
    """Tell which rows of a receiver have a place or a motion, and do not deny a fix."""
    known = table.text("fix") != "none"
    known &= np.any([table.valid(field) for field in FIX_FIELDS], axis=0)
    return np.asarray(known, dtype=bool)


def _with_ends_of_pauses(
    time_ns: Int64Array, states: NDArray[np.str_], flight: Flight
) -> tuple[Int64Array, NDArray[np.str_]]:
    """Return times and states with a row at either end of each pause of the log.

    It has the state of the row beside it, so that a gap ends where a pause begins.
    """
    inside = [one for one in flight.pauses if len(time_ns) and time_ns[0] <= one.start_ns and one.end_ns < time_ns[-1]]
    at = np.array([np.searchsorted(time_ns, one.start_ns, side="right") for one in inside], dtype=np.intp)
    beside = np.column_stack((states[at - 1], states[at])).ravel()
    edges = np.array(inside, dtype=np.int64).ravel()
    return np.insert(time_ns, np.repeat(at, 2), edges), np.insert(states, np.repeat(at, 2), beside)


def _paused(lanes: GnssLanes, flight: Flight) -> GnssLanes:
    """Return lanes with the pauses of the log laid over them."""
    start_s, end_s, state = lanes.start_s, lanes.end_s, lanes.state.astype("U24")
    for pause in flight.pauses:
        from_s, to_s = flight.seconds(np.array(pause)).tolist()
        if not len(start_s) or not start_s[0] <= from_s < end_s[-1]:
            continue
        before, behind = start_s < from_s, end_s > to_s
        begun = np.r_[start_s[before], from_s, np.maximum(start_s[behind], to_s)]
        ended = np.r_[np.minimum(end_s[before], from_s), to_s, end_s[behind]]
        state = np.r_[state[before], np.array([NOT_LOGGED]), state[behind]]
        start_s, end_s = begun, ended
    return GnssLanes(start_s=start_s, end_s=end_s, state=state)


def overview(flight: Flight, true_heading_deg: NDArray[np.float64] | None, ins_topic: str | None) -> Overview | None:
    """Thin the flight for the map and profiles, on the times of GNSS; NaN at gaps.

    The times are of INS or of the barometer where there is no GNSS. Position, altitude, ground speed, climb, heading
    and track are always there; the columns of :data:`ALSO` where they are known.
    """
    gnss, placed = _with_places(flight)
    base = placed or ins_topic or first_of_kind(flight, "ins") or first_of_kind(flight, "baro")
    if base is None or not len(flight[base]):
        return None
    every = flight[base]
    rows = np.arange(len(every)) if base == gnss else _rows_with_motion(every)
    keep = np.unique(np.linspace(0, len(rows) - 1, min(len(rows), MAX_OVERVIEW_ROWS)).round().astype(int))
    time_ns = every.time_ns[rows[keep]]
    columns = {
        "time_s": flight.seconds(time_ns),
        "latitude_deg": every.values("latitude_deg")[rows[keep]],
        "longitude_deg": every.values("longitude_deg")[rows[keep]],
        "altitude_m": _at(every, _altitude(every), rows[keep]),
        "ground_speed_mps": _at(every, ground_speed(every), rows[keep]),
        "heading_deg": _nearest_heading(flight, time_ns, true_heading_deg, ins_topic),
        "track_deg": _at(every, _track(every), rows[keep]),
        "climb_mps": _at(every, -every.values("velocity_down_mps"), rows[keep]),
    }
    for name, kind, instead_of in ALSO:
        source = first_of_kind(flight, kind, name)
        is_wanted = all(not np.isfinite(columns[other]).any() for other in instead_of if other in columns)
        if source is not None and is_wanted:
            columns[name] = _nearest(flight[source].time_ns, flight[source].values(name), time_ns)
    columns = _break_at_gaps(columns, flight.duration_s / MAX_OVERVIEW_ROWS)
    return Overview(**columns)


def _rows_with_motion(table: Table) -> NDArray[np.intp]:
    """Return the rows to draw: with a position, else with a velocity, else all.

    A row may have the fields of one source alone.
    """
    for names in (("latitude_deg", "longitude_deg"), ("velocity_north_mps", "velocity_east_mps")):
        if table.has(*names):
            return np.flatnonzero(table.columns[names[0]].mask & table.columns[names[1]].mask)
    return np.arange(len(table))


def _at(table: Table, values: NDArray[np.float64], rows: NDArray[np.intp]) -> NDArray[np.float64]:
    """Return the values of rows; if none has any, the nearest in time of another source."""
    own = values[rows]
    return own if np.isfinite(own).any() else _nearest(table.time_ns, values, table.time_ns[rows])


def ground_speed(table: Table) -> NDArray[np.float64]:
    """Ground speed, metres per second, shape (n,): from the velocities, else as logged."""
    if table.has("velocity_north_mps", "velocity_east_mps"):
        return np.asarray(np.hypot(table.values("velocity_north_mps"), table.values("velocity_east_mps")))
    return table.values("ground_speed_mps")


def _with_places(flight: Flight) -> tuple[str | None, str | None]:
    """Return the GNSS with places, and the topic to draw: that one, else an INS."""
    gnss = first_of_kind(flight, "gnss", "latitude_deg", "longitude_deg")
    return gnss, gnss or first_of_kind(flight, "ins", "latitude_deg", "longitude_deg")


def altitude_facts(flight: Flight) -> dict[str, str]:
    """Return the datum of the altitude of the overview, ``MSL`` or ``ellipsoid``."""
    _, topic = _with_places(flight)
    known = () if topic is None else tuple(name for name in ALTITUDES if flight[topic].has(name))
    return {ALTITUDE_DATUM: ALTITUDES[known[0]]} if known else {}


def _altitude(table: Table) -> NDArray[np.float64]:
    return table.values(next((name for name in ALTITUDES if table.has(name)), "altitude_msl_m"))


def _track(table: Table) -> NDArray[np.float64]:
    from groundstation.base.angles import direction_of

    if not table.has("velocity_north_mps", "velocity_east_mps"):
        return table.values("track_deg")
    north, east = table.values("velocity_north_mps"), table.values("velocity_east_mps")
    track = np.empty(len(table))
    for start in range(0, len(table), ROWS_AT_ONCE):
        rows = slice(start, start + ROWS_AT_ONCE)
        is_moving = np.hypot(north[rows], east[rows]) > 1.0
        track[rows] = np.where(is_moving, direction_of(north[rows], east[rows]), np.nan)
    return track


def _nearest_heading(
    flight: Flight, time_ns: Int64Array, true_heading_deg: NDArray[np.float64] | None, ins_topic: str | None
) -> NDArray[np.float64]:
    if true_heading_deg is None or ins_topic is None:
        return np.full(len(time_ns), np.nan)
    return _nearest(flight[ins_topic].time_ns, true_heading_deg, time_ns)


def _nearest(times_ns: Int64Array, values: NDArray[np.float64], wanted_ns: Int64Array) -> NDArray[np.float64]:
    """The known value nearest in time to each wanted time, NaN where none is near."""
    known = np.isfinite(values)
    if not known.any():
        return np.full(len(wanted_ns), np.nan)
    if not known.all():
        times_ns, values = times_ns[known], values[known]
    nearest = nearest_rows(times_ns, wanted_ns, takes_later=True)
    return np.where(np.abs(times_ns[nearest] - wanted_ns) <= NEAR_NS, values[nearest], np.nan)


def _break_at_gaps(columns: dict[str, NDArray[np.float64]], thinned_step_s: float) -> dict[str, NDArray[np.float64]]:
    """Insert a row of NaN wherever time stands still for longer than thinning explains."""
    step_s = np.diff(columns["time_s"])
    if not len(step_s):
        return columns
    limit_s = max(GAP_PERIODS * float(np.median(step_s)), 2.0 * thinned_step_s, LARGEST_QUIET_GAP_S)
    after = np.flatnonzero(step_s > limit_s)
    broken = {name: np.insert(values, after + 1, np.nan) for name, values in columns.items() if name != "time_s"}
    middle = columns["time_s"][after] + 0.5 * step_s[after]
    return {"time_s": np.insert(columns["time_s"], after + 1, middle), **broken}


def phase_figure(phases: Phases) -> PhaseSpans:
    """Phases of the flight as figure data: the likely ones among those proven."""
    shown = phases.likely or phases.intervals
    return PhaseSpans(
        start_s=np.array([one.start_s for one in shown], dtype=np.float64),
        end_s=np.array([one.end_s for one in shown], dtype=np.float64),
        phase=np.array([one.phase for one in shown], dtype="U16"),
        proven=np.array([one.is_proven for one in shown], dtype=bool),
    )


def phase_facts(phases: Phases) -> dict[str, str]:
    """Return the kind of vehicle, its reason and the method of the phases, as metadata."""
    if not phases.likely:
        return {}
    return {
        KIND_OF_VEHICLE: phases.vehicle.kind or "unknown",
        WHY_THAT_VEHICLE: phases.vehicle.told,
        PHASES_BY: phases.method,
    }


def state_lanes(flight: Flight) -> StateLanes | None:
    """Return what the log says of flight mode, arming and ground contact, as spans.

    Columns ``lane``, ``start_s``, ``end_s``, ``state``. Mode and arming are read off the events (``mode LOITER``,
    ``armed``, ``disarmed``), each holds until the next one. The lane of ground contact is named after its source, a
    landed flag or weight on wheels.
    """
    events = [flight[topic] for topic in topics_of_kind("event", flight.topics()) if flight[topic].has("name")]
    time_ns = np.concatenate([np.zeros(0, dtype=np.int64), *(table.time_ns for table in events)])
    names = np.concatenate([np.zeros(0, dtype="U1"), *(table.text("name") for table in events)])
    order = np.argsort(time_ns, kind="stable")
    told = [
        (when, name)
        for when, row in zip(time_ns[order], names[order], strict=True)
        for name in row.split(EVENT_SEPARATOR)
    ]
    time_ns, names = (
        np.array([when for when, _ in told], dtype=np.int64),
        np.array([name for _, name in told], dtype="U"),
    )
    is_mode, is_arming = np.char.startswith(names, MODE), np.isin(names, ("armed", "disarmed"))
    lanes = [
        ("mode", time_ns[is_mode], np.array([name.removeprefix(MODE) for name in names[is_mode].tolist()], dtype="U")),
        ("arming", time_ns[is_arming], names[is_arming]),
    ]
    contact = contact_of(flight)
    if contact is not None:
        states = np.where(contact.on_ground, "on the ground", "in the air")
        lanes.append((contact.name.partition(" (")[0], contact.time_ns, states))
    spans = [(lane, runs_of(states, flight.seconds(times), flight.duration_s)) for lane, times, states in lanes]
    if not any(len(runs) for _, runs in spans):
        return None
    return StateLanes(
        lane=np.array([lane for lane, runs in spans for _ in range(len(runs))]),
        start_s=np.concatenate([runs.start_s for _, runs in spans]),
        end_s=np.concatenate([runs.end_s for _, runs in spans]),
        state=np.concatenate([runs.state for _, runs in spans]),
    )


def ledger_figures(flight: Flight, ledger: Ledger, gaps_of: Mapping[str, Gaps]) -> tuple[FigureData, ...]:
    """The ledger's topics and gaps as figure data, times in flight seconds."""
    names = [topic for topic in flight.topics() if topic in ledger.topics]
    topics = [ledger.topics[name] for name in names]
    rows = LedgerRows(
        topic=np.array(names, dtype=np.str_),
        rows=_counts(one.rows for one in topics),
        duplicates=_counts(one.duplicates for one in topics),
        backward_steps=_counts(one.backward_steps for one in topics),
        stray_rows=_counts(one.stray_rows for one in topics),
        nominal_rate_hz=_numbers(one.nominal_rate_hz for one in topics),
        actual_rate_hz=_numbers(one.actual_rate_hz for one in topics),
        coverage=_numbers(one.coverage for one in topics),
        gaps=_counts(one.gaps.count for one in topics),
        longest_gap_s=_numbers(one.gaps.longest_s for one in topics),
        dropped_rows=_counts(_dropped(ledger, name) for name in names),
        lost_by_counter=_counts(one.missing for one in topics),
        out_of_range=_counts(one.out_of_range for one in topics),
        stuck=_counts(one.stuck for one in topics),
        first_s=np.array([flight.time_s(name)[0] for name in names]),
        last_s=np.array([flight.time_s(name)[-1] for name in names]),
    )
    return rows, _gap_figure(flight, [gaps_of[name] for name in names])


def _gap_figure(flight: Flight, found: list[Gaps]) -> GapRows:
    return GapRows(
        topic=np.array([gaps.topic for gaps in found for _ in range(len(gaps))], dtype=np.str_),
        start_s=np.concatenate([np.zeros(0), *(flight.seconds(gaps.start_ns) for gaps in found)]),
        length_s=np.concatenate([np.zeros(0), *(gaps.length_s for gaps in found)]),
    )


def _dropped(ledger: Ledger, topic: str) -> int:
    return sum(one.count for one in ledger.damages if one.topic == topic and one.kind == "dropped_rows")


def _counts(values: Iterable[int]) -> NDArray[np.int64]:
    return np.array(list(values), dtype=np.int64)


def _numbers(values: Iterable[float | None]) -> NDArray[np.float64]:
    return np.array([np.nan if value is None else value for value in values], dtype=np.float64)

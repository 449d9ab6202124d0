"""Criteria of a stabilised approach, from a check height down to the start of the flare."""

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.results.gates import Bound, Gate, judged_gate
from groundstation.results.rules import Rejudged
from groundstation.systems.landing.answer import (
    GatePlace,
    LandingResult,
    Side,
    StabilisedAt,
    StabilisedVerdict,
    StabilityLost,
)
from groundstation.systems.landing.criteria_answer import REVERSED, Criterion, Place
from groundstation.systems.landing.criteria_settings import Limits
from groundstation.systems.landing.geometry import RelativeToRunway
from groundstation.systems.landing.logged import Logged
from groundstation.systems.landing.path import FlightPath
from groundstation.systems.landing.settings import LandingSettings
from groundstation.systems.landing.sustained import lasting, worst_sustained

LAST_SPEED_S = 10.0  # the speed of reference is that of so many seconds above the floor
LAST_FLAP_S = 10.0  # before the end: the flap of the landing
FEWEST = 3
PERCENT = 100.0


@dataclass(frozen=True, eq=False)
class Flown:
    """A quantity along the rows of a check, what is bounded, and why it may be none.

    ``sides`` are those of a negative and a positive value; of a quantity with sides its size is bounded.
    """

    name: str
    title: str
    unit: str
    values: FloatArray
    is_low_bad: bool = False
    reason: str = "not in the log"
    sides: tuple[Side, Side] = ("", "")

    @property
    def bounded(self) -> FloatArray:
        """Values that the limits bound."""
        return np.abs(self.values) if any(self.sides) else self.values

    def side_at(self, row: int) -> Side:
        """Return the side of the value of a row."""
        return self.sides[int(self.values[row] > 0.0)]


@dataclass(frozen=True)
class SetAt:
    """Height at which flaps or gear came into the position of the landing, and stayed."""

    place: Place | None
    reason: str = ""


def stabilised(
    path: FlightPath, relative: RelativeToRunway, logged: Logged, settings: LandingSettings
) -> tuple[StabilisedAt, ...]:
    """Judge the final from both check heights, the higher first."""
    checks = (settings.gate_high_m, settings.gate_low_m)
    return tuple(_from(path, relative, logged, height_m, settings) for height_m in checks)


def _from(
    path: FlightPath, relative: RelativeToRunway, logged: Logged, check_height_m: float, settings: LandingSettings
) -> StabilisedAt:
    """Return the worst lasting values from a check height down to the floor.

    Without a passage of the floor, to the lowest point.

    Samples count from the last time the aircraft was above that height.
    """
    reason = _not_passed(np.where(relative.is_final, relative.height_m, np.nan), check_height_m)
    if reason:
        return StabilisedAt(check_height_m, "not measured", None, (), reason)
    own = rows_below(relative, check_height_m, settings.gate_floor_m)
    rows = slice(relative.rows.start + own.start, relative.rows.start + own.stop)
    time_s = path.time_s[rows]
    bounds = criterion_bounds(settings, check_height_m)
    gates, places = list[Gate](), list[GatePlace]()
    over = list[tuple[str, np.ndarray, Flown | None]]()
    for one in _flown(path, logged, rows, settings):
        if bounds.get(one.name, (None, None)) == (None, None):
            continue
        gate, row = _judged(one, bounds[one.name], time_s, settings.sustained_s)
        gates.append(gate)
        if row is not None:
            places.append(GatePlace(one.name, place_at(path, relative, own.start + row), one.side_at(row)))
        if gate.value is not None:
            over.append((one.title, _is_over(one.bounded, bounds[one.name]), one))
    for name, title in (("flap", "landing flap set at"), ("gear", "gear down at")):
        found = set_at(name, path, relative, logged, settings)
        value = None if found.place is None else found.place.height_m
        gates.append(judged_gate(bounds[name], name, title, value, unit="m", reason=found.reason))
        if found.place is not None:
            places.append(GatePlace(name, found.place))
            over.append((title, time_s < found.place.time_s, None))
    criteria = tuple(gates)
    lost, stable_m = _lost(over, time_s, relative.height_m[own], settings.sustained_s)
    return StabilisedAt(
        check_height_m, decide(criteria), float(time_s[0]), criteria, places=tuple(places), lost=lost, stable_m=stable_m
    )


def rows_below(relative: RelativeToRunway, check_height_m: float, floor_m: float) -> slice:
    """Return the rows of a final from its last passage of a height down to a floor."""
    height = np.where(relative.is_final, relative.height_m, np.nan)
    known = np.isfinite(height)
    above = np.flatnonzero(known & (height >= check_height_m))
    start = int(above[-1]) if above.size else 0
    below = np.flatnonzero(known & (height < floor_m) & (np.arange(len(height)) > start))
    stop = int(below[0]) if below.size else int(np.flatnonzero(relative.is_final)[-1]) + 1
    return slice(start, stop)


def _flown(path: FlightPath, logged: Logged, rows: slice, settings: LandingSettings) -> tuple[Flown, ...]:
    return (
        Flown("lateral", "course deviation", "dots", path.lateral_dots[rows], sides=("left", "right")),
        Flown("vertical", "glide path deviation", "dots", path.vertical_dots[rows], sides=("low", "high")),
        Flown("sink_rate", "sink rate", "m/s", path.sink_rate_mps[rows]),
        Flown("bank", "bank", "deg", path.bank_deg[rows], sides=("left", "right")),
        _speed(path, logged, rows, settings),
        Flown("thrust", "lowest thrust", "%", PERCENT * logged.thrust_share[rows], is_low_bad=True),
    )


def _speed(path: FlightPath, logged: Logged, rows: slice, settings: LandingSettings) -> Flown:
    """Airspeed above the reference speed; where none is set, above that at the end."""
    if settings.reference_speed_mps is not None:
        above = logged.indicated_mps[rows] - settings.reference_speed_mps
        return Flown("speed", "airspeed above the reference speed", "m/s", above, reason="no indicated airspeed logged")
    time_s = path.time_s[rows]
    speed, name = path.airspeed_mps[rows], "airspeed"
    if not np.isfinite(speed).any():
        speed, name = path.ground_speed_mps[rows], "ground speed"
    last = speed[(time_s >= time_s[-1] - LAST_SPEED_S) & np.isfinite(speed)]
    faster = speed - float(np.median(last)) if last.size else np.full(len(speed), np.nan)
    return Flown("speed", f"{name} above that at the end", "m/s", faster)


def _judged(one: Flown, bound: Bound, time_s: FloatArray, for_s: float) -> tuple[Gate, int | None]:
    """Return the gate and the row of the worst value that lasted.

    Of a value bounded on both sides it is that which misses a bound the more.
    """
    found = {}
    values = one.bounded
    if np.isfinite(values).sum() >= FEWEST:
        low, high = bound
        if high is not None and (worst := worst_sustained(time_s, values, for_s)):
            found[worst.value - high] = worst
        if low is not None and (worst := worst_sustained(time_s, -values, for_s)):
            found[low + worst.value] = worst._replace(value=-worst.value)
    if not found:
        return judged_gate(bound, one.name, one.title, None, unit=one.unit, reason=one.reason), None
    worst = found[max(found)]
    return judged_gate(bound, one.name, one.title, worst.value, unit=one.unit), worst.row


def _is_over(values: FloatArray, bound: Bound) -> np.ndarray:
    low, high = bound
    with np.errstate(invalid="ignore"):
        over = np.zeros(len(values), dtype=bool) if high is None else values > high
        return over if low is None else over | (values < low)


def place_at(path: FlightPath, relative: RelativeToRunway, row: int) -> Place:
    """Return the instant of a row of the final."""
    height, before = float(relative.height_m[row]), float(relative.distance_m[row])
    return Place(
        float(path.time_s[relative.rows.start + row]),
        height if np.isfinite(height) else None,
        before if np.isfinite(before) else None,
    )


def set_at(name: str, path: FlightPath, relative: RelativeToRunway, logged: Logged, settings: LandingSettings) -> SetAt:
    """Find where flaps or gear came into the position of the end of the final, and stayed."""
    values = (logged.flap_deg if name == "flap" else logged.gear_share)[relative.rows][relative.is_final]
    known = np.isfinite(values)
    if not known.any():
        return SetAt(None, "not in the log")
    told = logged.tells.get(name, "")
    if told and told != REVERSED and (name == "flap" or values[known][-1] < 1.0):
        return SetAt(None, told)
    time_s = path.time_s[relative.rows][relative.is_final]
    if name == "flap":
        last = values[known & (time_s >= time_s[-1] - LAST_FLAP_S)]
        if not last.size:
            return SetAt(None, "not logged at the end")
        wanted = float(np.median(last)) if settings.landing_flap_deg is None else settings.landing_flap_deg
        off = known & (values < wanted - settings.flap_tolerance_deg)
        if settings.landing_flap_deg is None:
            off |= known & (values > wanted + settings.flap_tolerance_deg)
    else:
        off = known & (values < 1.0)
    rows = np.flatnonzero(off)
    if rows.size and rows[-1] >= np.flatnonzero(known)[-1]:
        return SetAt(place_at(path, relative, int(np.flatnonzero(relative.is_final)[-1])), "not by the end")
    row = int(np.flatnonzero(known & (np.arange(len(values)) > rows[-1]))[0]) if rows.size else 0
    if not np.isfinite(relative.height_m[row]):
        return SetAt(None, "no height above the threshold")
    early = "" if rows.size else "before the final began"
    return SetAt(place_at(path, relative, row), "; ".join(filter(None, (early, told if told == REVERSED else ""))))


def _lost(
    over: list[tuple[str, np.ndarray, Flown | None]], time_s: FloatArray, height_m: FloatArray, for_s: float
) -> tuple[StabilityLost | None, float | None]:
    """Return the first loss of a limit, and the height from which all were kept."""
    spans = [
        (first, last, title, "" if one is None else one.side_at(first))
        for title, rows, one in over
        for first, last in lasting(time_s, rows, for_s)
    ]
    if not over:
        return None, None
    if not spans:
        return None, float(height_m[0])
    first, _last, title, side = min(spans)
    end = max(span[1] for span in spans)
    stable_m = float(height_m[end]) if end < len(height_m) and np.isfinite(height_m[end]) else None
    lost = StabilityLost(float(height_m[first]), float(time_s[first]), title, first == 0, side)
    return lost, stable_m


def criterion_bounds(settings: LandingSettings, check_height_m: float) -> dict[str, Bound]:
    """Lowest and highest value with which each criterion is met."""
    shared: dict[str, Bound] = {
        "lateral": (None, settings.deviation_max_dots),
        "vertical": (None, settings.deviation_max_dots),
        "sink_rate": (None, settings.sink_rate_max_mps),
        "bank": (None, settings.bank_max_deg),
        "speed": (None if settings.reference_speed_mps is None else 0.0, settings.speed_above_max_mps),
        "flap": (check_height_m, None),
        "gear": (check_height_m, None),
        "thrust": (None, None),
    }
    return {name: _own_or(settings.criteria.of(name), bound) for name, bound in shared.items()}


def _own_or(limits: Limits, bound: Bound) -> Bound:
    return (limits.at_least, limits.at_most) if limits.is_set else bound


def decide(criteria: tuple[Gate, ...]) -> StabilisedVerdict:
    """Return the verdict: not stabilised if a criterion failed, stabilised if any was met."""
    states = {criterion.state for criterion in criteria}
    return "not stabilised" if "failed" in states else "stabilised" if "passed" in states else "not measured"


def rejudge(answer: LandingResult, settings: LandingSettings) -> tuple[Rejudged, ...]:
    """Apply other limits to the criteria of every approach.

    The worst values are those by which they were judged.
    """
    found = []
    for place, approach in enumerate(answer.approaches, start=1):
        for row in approach.stabilised:
            bounds = criterion_bounds(settings, row.height_m)
            after = tuple(
                one.under(bounds[one.name]) if bounds.get(one.name, (None, None)) != (None, None) else one
                for one in row.gates
            )
            subject = f"approach {place} from {row.height_m:.0f} m"
            found.append(Rejudged(subject, row.verdict, decide(after), row.gates, after))
        found += _rejudged_rest(place, approach.criteria, settings)
    return tuple(found)


def _rejudged_rest(place: int, criteria: tuple[Criterion, ...], settings: LandingSettings) -> list[Rejudged]:
    """Judge the other criteria again that had a limit and have one."""
    pairs = []
    for one in criteria:
        limits = settings.criteria.of(one.name)
        if not limits.is_set or (one.at_least, one.at_most) == (None, None):
            continue
        title = one.kind.title
        before = judged_gate((one.at_least, one.at_most), one.name, title, one.value, unit=one.unit, reason=one.reason)
        pairs.append((before, before.under((limits.at_least, limits.at_most))))
    if not pairs:
        return []
    before_after = tuple(zip(*pairs, strict=True))
    words = ["not met" if any(gate.state == "failed" for gate in gates) else "met" for gates in before_after]
    return [Rejudged(f"approach {place} at the runway", words[0], words[1], *before_after)]


def _not_passed(height_m: FloatArray, check_height_m: float) -> str:
    """Return why a check height was not passed on a final; empty where it was."""
    if not np.isfinite(height_m).any():
        return "no height above the threshold"
    if np.nanmax(height_m) < check_height_m:
        return f"the straight final begins at {np.nanmax(height_m):.0f} m"
    return f"the lowest point is at {np.nanmin(height_m):.0f} m" if np.nanmin(height_m) >= check_height_m else ""

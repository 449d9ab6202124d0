"""Histories of the INS units of a fleet by serial: trend, changes, moves, date of a limit."""

import math
import unicodedata
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import fields
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.base import words
from groundstation.base.dataclasses import dataclass
from groundstation.methods.fleet.slopes import FEWEST
from groundstation.methods.fleet.unit_series import (
    SeriesSettings,
    UnitSeries,
    crossing_of,
    flights_missing,
    series_of,
)
from groundstation.results.figures import FigureData
from groundstation.results.fleet_units import (
    RATE,
    UNIT_FIGURES,
    FleetUnitFlights,
    FleetUnitRow,
    UnitEventRow,
    UnitLimits,
    UnitOfFlight,
    UnitOutlook,
    UnitTrendRow,
)

FloatArray = NDArray[np.float64]
NS_PER_DAY = 86_400_000_000_000
DAYS_PER_YEAR, DAYS_PER_MONTH = 365.25, 30.4375
FIRST_YEAR = 1990  # a clock that was never set counts from 1970 or 1980
NO_DATE = "no date in the log"
CLOCK = f"dated before {FIRST_YEAR}: its clock was not set"
BOTH = "the same serial flies in two aircraft at the same time"
SOON_DAYS = 7.0  # an earliest date so near tells nothing
MOST_MISSING = 1000  # flights more: a larger number tells nothing


@dataclass(frozen=True)
class FlownUnit:
    """One INS of one flight with what tells where and when it flew.

    ``start_utc_ns`` is None without absolute time, ``end_utc_ns`` also without a duration.
    """

    unit: UnitOfFlight
    flight_id: str
    aircraft: str
    start_utc_ns: int | None
    end_utc_ns: int | None = None
    reason: str = ""

    @property
    def serial(self) -> str:
        """Serial, spelled as in the log but for blanks."""
        return serial_of(self.unit.ins_serial)

    @property
    def why_undated(self) -> str:
        """Words on why its date is not believed; empty where it is."""
        if self.start_utc_ns is None:
            return NO_DATE
        year = int(np.datetime64(self.start_utc_ns, "ns").astype("datetime64[Y]").astype(int)) + 1970
        return CLOCK if year < FIRST_YEAR else ""

    @property
    def order(self) -> tuple[bool, int, str, str]:
        """Key that orders flights by date, those without one behind."""
        is_dated = not self.why_undated
        return not is_dated, (self.start_utc_ns or 0) if is_dated else 0, self.flight_id, self.unit.topic


@dataclass(frozen=True)
class UnitHistories:
    """Histories of all units of a fleet."""

    rows: tuple[FleetUnitRow, ...]
    trends: tuple[UnitTrendRow, ...]
    events: tuple[UnitEventRow, ...]
    flights: FleetUnitFlights


def serial_of(text: str) -> str:
    """Return a serial without characters that nobody sees.

    Examples
    --------
    >>> serial_of(" SN\\u00a0 12\\x00"), serial_of("№ 7")
    ('SN 12', '№ 7')
    """
    shown = "".join(one if unicodedata.category(one)[0] != "C" else " " for one in text)
    return " ".join(shown.split())


def histories_of(flown: Sequence[FlownUnit], limits: UnitLimits | None = None) -> UnitHistories:
    """Return the history of every serial, and the flights behind it.

    Parameters
    ----------
    flown : sequence of FlownUnit
        In any order.
    limits : UnitLimits, optional
    """
    limits = limits or UnitLimits()
    by_serial: dict[str, list[FlownUnit]] = defaultdict(list)
    for one in flown:
        by_serial[one.serial].append(one)
    kept = {serial: _without_doubles(sorted(own, key=lambda one: one.order)) for serial, own in by_serial.items()}
    rows: list[FleetUnitRow] = []
    trends: list[UnitTrendRow] = []
    events: list[UnitEventRow] = []
    lines: dict[FlownUnit, tuple[float, float, float]] = {}
    for serial in sorted(set(kept) - {""}):
        own = kept[serial]
        row, found, changed = _history(len(rows) + 1, serial, own, limits, lines)
        rows.append(row)
        trends += found
        events += sorted([*_moves(serial, own, limits), *changed], key=lambda one: one.start_utc_ns or 0)
    events += [*_replaced([one for own in kept.values() for one in own]), *_alike(kept)]
    return UnitHistories(tuple(rows), tuple(trends), tuple(events), _table(kept, lines))


def _without_doubles(own: list[FlownUnit]) -> list[FlownUnit]:
    """Mark flights of one serial that overlap in different aircraft.

    Nobody knows which of them it was.
    """
    doubtful: set[str] = set()
    if not own[0].serial:
        return own
    dated = [one for one in own if not one.why_undated and one.aircraft]
    for place, one in enumerate(dated):
        for other in dated[place + 1 :]:
            if one.end_utc_ns is None or other.start_utc_ns is None or other.start_utc_ns >= one.end_utc_ns:
                break
            if other.aircraft != one.aircraft:
                doubtful |= {one.flight_id, other.flight_id}
    return [_doubted(one) if one.flight_id in doubtful else one for one in own]


def _doubted(one: FlownUnit) -> FlownUnit:
    return FlownUnit(one.unit, one.flight_id, one.aircraft, one.start_utc_ns, one.end_utc_ns, BOTH)


def _reason(one: FlownUnit) -> str:
    return one.unit.reason or one.reason


def _day(time_ns: int | None) -> str:
    return "an unknown day" if time_ns is None else str(np.datetime64(time_ns, "ns").astype("datetime64[D]"))


def _counted(own: Sequence[FlownUnit], quantity: str) -> list[FlownUnit]:
    return [
        one
        for one in own
        if not _reason(one) and not one.why_undated and np.isfinite(float(getattr(one.unit, quantity)))
    ]


def _days(own: Sequence[FlownUnit]) -> FloatArray:
    """Days since 1970."""
    return np.array([(one.start_utc_ns or 0) / NS_PER_DAY for one in own])


def _history(
    place: int,
    serial: str,
    own: Sequence[FlownUnit],
    limits: UnitLimits,
    lines: dict[FlownUnit, tuple[float, float, float]],
) -> tuple[FleetUnitRow, list[UnitTrendRow], list[UnitEventRow]]:
    trends: list[UnitTrendRow] = []
    events: list[UnitEventRow] = []
    series: dict[str, UnitSeries] = {}
    for quantity, figure in UNIT_FIGURES.items():
        counted = _counted(own, quantity)
        if not counted:
            continue
        day, value = _days(counted), np.array([float(getattr(one.unit, quantity)) for one in counted])
        found = series_of(day, value, settings=SeriesSettings(), is_positive=figure.is_positive)
        series[quantity] = found
        trends.append(_trend(serial, quantity, counted, day, found))
        events += _changes(serial, quantity, counted, value, found)
    counted = _counted(own, RATE)
    if RATE in series and (line := series[RATE].line) is not None:
        since = counted[series[RATE].since :]
        day = _days(since)
        told = zip(line.at(day).tolist(), *(one.tolist() for one in line.bounds(day)), strict=True)
        lines |= dict(zip(since, told, strict=True))
    row = _row(place, serial, own, counted, series.get(RATE), limits)
    return row, trends, events


def _trend(
    serial: str, quantity: str, counted: Sequence[FlownUnit], day: FloatArray, found: UnitSeries
) -> UnitTrendRow:
    since = counted[found.since].start_utc_ns
    flights, line = len(counted) - found.since, found.line
    if line is None:
        return UnitTrendRow(serial, quantity, flights, since, changes=len(found.changes))
    low, high = line.bounds(day[-1:])
    slope, slope_low, slope_high = (DAYS_PER_YEAR * one for one in (line.slope, line.slope_low, line.slope_high))
    return UnitTrendRow(
        serial,
        quantity,
        flights,
        since,
        level=float(line.at(day[-1:])[0]),
        level_low=float(low[0]),
        level_high=float(high[0]),
        slope_per_year=slope,
        slope_low_per_year=slope_low,
        slope_high_per_year=slope_high,
        scatter=line.scatter,
        changes=len(found.changes),
    )


def _changes(
    serial: str, quantity: str, counted: Sequence[FlownUnit], value: FloatArray, found: UnitSeries
) -> Iterator[UnitEventRow]:
    title, unit, decimals, _ = UNIT_FIGURES[quantity]
    places = [0, *(change.index for change in found.changes), len(value)]
    for (start, middle), (_, end) in pairwise(pairwise(places)):
        first = counted[middle]
        before, after = (float(np.median(part)) for part in (value[start:middle], value[middle:end]))
        text = f"{title} {before:.{decimals}f} before, {after:.{decimals}f} {unit} since"
        yield UnitEventRow("changed", serial, first.aircraft, first.flight_id, first.start_utc_ns, text, quantity)


def _limit_of(serial: str, counted: Sequence[FlownUnit], limits: UnitLimits) -> tuple[float | None, str]:
    """Limit on the rate and whose it is."""
    stated = next((one.rate_nmiph for one in limits.serials if serial_of(one.ins_serial) == serial), limits.rate_nmiph)
    if stated is not None:
        return stated, "stated"
    of_class = [one.unit.limit_nmiph for one in counted if np.isfinite(one.unit.limit_nmiph)]
    if not of_class:
        return None, ""
    return float(np.median(of_class)), f"class {counted[-1].unit.ins_class}"


def _row(
    place: int,
    serial: str,
    own: Sequence[FlownUnit],
    counted: Sequence[FlownUnit],
    found: UnitSeries | None,
    limits: UnitLimits,
) -> FleetUnitRow:
    dated = [one for one in own if not one.why_undated]
    names = list(dict.fromkeys(one.aircraft for one in [*dated, *own] if one.aircraft))
    limit, limit_by = _limit_of(serial, counted, limits)
    told = _outlook(own, counted, found, limit, limits)
    line = None if found is None else found.line
    now = _days(counted)[-1:] if counted else np.zeros(0)
    low, high = (None, None) if line is None else (float(one[0]) for one in line.bounds(now))
    level = None if line is None else float(line.at(now)[0])
    if line is None and counted and found is not None:
        level = float(np.median([one.unit.rate_nmiph for one in counted[found.since :]]))
    slopes = (None,) * 3 if line is None else (line.slope, line.slope_low, line.slope_high)
    last = max(dated, key=lambda one: one.order) if dated else own[-1]
    return FleetUnitRow(
        place=place,
        ins_serial=serial,
        aircraft=", ".join(names),
        fitted_to=last.aircraft,
        first_flight=own[0].flight_id,
        last_flight=last.flight_id,
        first_utc_ns=dated[0].start_utc_ns if dated else None,
        last_utc_ns=last.start_utc_ns if dated else None,
        flights=len({one.flight_id for one in own}),
        counted=len(counted),
        undated=len(own) - len(dated),
        rate_nmiph=level,
        rate_low_nmiph=None if low is None else max(low, 0.0),
        rate_high_nmiph=high,
        slope_nmiph_per_year=_per_year(slopes[0]),
        slope_low_nmiph_per_year=_per_year(slopes[1]),
        slope_high_nmiph_per_year=_per_year(slopes[2]),
        limit_nmiph=limit,
        limit_by=limit_by,
        outlook=told.outlook,
        due_utc_ns=_time_ns(told.due),
        due_earliest_utc_ns=_time_ns(told.earliest),
        due_latest_utc_ns=_time_ns(told.latest),
        flights_missing=told.missing,
        text=told.text,
    )


def _per_year(slope: float | None) -> float | None:
    return None if slope is None else DAYS_PER_YEAR * slope


def _time_ns(day: float | None) -> int | None:
    return None if day is None else round(day) * NS_PER_DAY


@dataclass(frozen=True)
class _Outlook:
    """Outlook of a unit with its words; dates in days since 1970."""

    outlook: UnitOutlook
    text: str
    due: float | None = None
    earliest: float | None = None
    latest: float | None = None
    missing: int | None = None


def _outlook(
    own: Sequence[FlownUnit],
    counted: Sequence[FlownUnit],
    found: UnitSeries | None,
    limit: float | None,
    limits: UnitLimits,
) -> _Outlook:
    if found is None or not counted:
        reasons = [_reason(one) or one.why_undated for one in own]
        why = max(reasons, key=reasons.count) or "too short or without GNSS"
        return _Outlook("no_rate", f"no flight shows its rate ({why}): no date")
    line, since = found.line, len(counted) - found.since
    if line is None:
        missing = max(FEWEST - since, 1)
        flights = words.counted(since, "flight")
        word = "since its last change " if found.since else ""
        text = f"{flights} {word}with a rate: {missing} more needed, no date"
        return _Outlook("few", text, missing=missing)
    if limit is None:
        return _Outlook("few", "no limit is stated and its class has none: no date")
    latest = counted[found.since :]
    day, value = _days(latest), np.array([one.unit.rate_nmiph for one in latest])
    low, high = (float(one[0]) for one in line.bounds(day[-1:]))
    level = float(line.at(day[-1:])[0])
    if low >= limit:
        return _Outlook("over", f"over {limit:.2f} nmi/h now: calibrate before the next flight", due=float(day[-1]))
    crossing = crossing_of(day, value, limit)
    if high >= limit and level < limit and line.slope_low <= 0.0:
        missing = max(math.ceil(line.flights * ((high - level) / (limit - level)) ** 2) - line.flights, 1)
        text = f"its interval holds {limit:.2f} nmi/h: about {_count(missing)} more flights are needed, no date"
        return _Outlook("few", text, missing=min(missing, MOST_MISSING))
    if high >= limit:
        doubt = "over" if level >= limit else "below"
        return _Outlook(
            "may_be_over",
            f"{doubt} {limit:.2f} nmi/h now, but its interval holds the limit",
            earliest=float(day[-1]),
            latest=crossing.latest if line.slope_low > 0.0 else None,
        )
    if line.slope_low > 0.0 and crossing.best is not None:
        end = "no sure end" if crossing.latest is None else _date(crossing.latest)
        text = f"calibrate by {_date(crossing.best)} ({_date(crossing.earliest)} to {end}): reaches {limit:.2f} nmi/h"
        return _Outlook("due", text, crossing.best, crossing.earliest, crossing.latest)
    period = limits.months_ahead * DAYS_PER_MONTH
    if crossing.earliest is None or crossing.earliest - day[-1] > period:
        until = "in ten years" if crossing.earliest is None else f"before {_date(crossing.earliest)}"
        rises = "rises, but" if line.slope_low > 0.0 else "no trend:"
        return _Outlook("steady", f"{rises} does not reach {limit:.2f} nmi/h {until}", earliest=crossing.earliest)
    needed = flights_missing(line, limit, float(day[-1]), period)
    more = f"about {_count(needed)} more flights" if needed else "more flights"
    soon = crossing.earliest - float(day[-1]) < SOON_DAYS
    end = "no date" if soon else f"not before {_date(crossing.earliest)}"
    return _Outlook(
        "few",
        f"no trend is shown, nor excluded: {more} are needed, {end}",
        earliest=None if soon else crossing.earliest,
        missing=min(needed, MOST_MISSING) if needed else None,
    )


def _count(flights: int) -> str:
    return str(flights) if flights <= MOST_MISSING else f"more than {MOST_MISSING}"


def _date(day: float | None) -> str:
    return _day(_time_ns(day))


def _moves(serial: str, own: Sequence[FlownUnit], limits: UnitLimits) -> Iterator[UnitEventRow]:
    """Moves to another aircraft, pauses, days in two aircraft, clocks that were not set."""
    dated = [one for one in own if not one.why_undated and one.aircraft]
    for one, other in pairwise(dated):
        assert one.start_utc_ns is not None
        assert other.start_utc_ns is not None
        place = (serial, other.aircraft, other.flight_id, other.start_utc_ns)
        if one.aircraft != other.aircraft and one.reason == other.reason == BOTH:
            yield UnitEventRow("two_aircraft", *place, f"in {one.aircraft} and {other.aircraft} at the same time")
        elif one.aircraft != other.aircraft and BOTH not in (one.reason, other.reason):
            told = f"removed from {one.aircraft} after {_day(one.start_utc_ns)}, fitted to {other.aircraft} by "
            yield UnitEventRow("moved", *place, f"{told}{_day(other.start_utc_ns)}")
            if _day(one.start_utc_ns) == _day(other.start_utc_ns):
                told = f"in {one.aircraft} and {other.aircraft} on {_day(one.start_utc_ns)}: check the serial"
                yield UnitEventRow("two_aircraft", *place, told)
        days = (other.start_utc_ns - one.start_utc_ns) / NS_PER_DAY
        if days > limits.gap_days:
            length = words.counted(round(days), "day")
            told = f"no flight from {_day(one.start_utc_ns)} to {_day(other.start_utc_ns)} ({length})"
            yield UnitEventRow("gap", *place, told)
    for one in own:
        if one.why_undated == CLOCK:
            yield UnitEventRow("clock", serial, one.aircraft, one.flight_id, None, CLOCK)


def _replaced(flown: Sequence[FlownUnit]) -> Iterator[UnitEventRow]:
    """Serials that follow each other at one place of one aircraft."""
    places: dict[tuple[str, str], list[FlownUnit]] = defaultdict(list)
    for one in flown:
        if one.aircraft and one.serial and not one.why_undated and not _reason(one):
            places[one.aircraft, one.unit.topic].append(one)
    for (aircraft, topic), own in sorted(places.items()):
        for one, other in pairwise(sorted(own, key=lambda one: one.order)):
            if one.serial != other.serial:
                text = f"{topic} of {aircraft}: {one.serial} until {_day(one.start_utc_ns)}, {other.serial} from "
                text += _day(other.start_utc_ns)
                yield UnitEventRow("replaced", other.serial, aircraft, other.flight_id, other.start_utc_ns, text)


def _alike(serials: Sequence[str] | dict[str, list[FlownUnit]]) -> Iterator[UnitEventRow]:
    """Serials that differ by case, blanks and dashes alone."""
    groups: dict[str, list[str]] = defaultdict(list)
    for serial in sorted(set(serials) - {""}):
        plain = "".join(one for one in unicodedata.normalize("NFKC", serial).casefold() if one.isalnum())
        groups[plain or serial].append(serial)
    for names in groups.values():
        if len(names) > 1:
            text = f"spelled alike: {', '.join(names)}; they count as units of their own"
            yield UnitEventRow("spelled_alike", names[0], "", "", None, text)


def _table(kept: dict[str, list[FlownUnit]], lines: dict[FlownUnit, tuple[float, float, float]]) -> FleetUnitFlights:
    every = [one for serial in sorted(kept) for one in kept[serial]]
    told: dict[str, NDArray[Any]] = {
        "ins_serial": np.array([one.serial for one in every], dtype=np.str_),
        "aircraft": np.array([one.aircraft for one in every], dtype=np.str_),
        "flight_id": np.array([one.flight_id for one in every], dtype=np.str_),
        "start_utc": np.array(
            [np.datetime64("NaT") if one.start_utc_ns is None else one.start_utc_ns for one in every],
            dtype="datetime64[ns]",
        ),
        "topic": np.array([one.unit.topic for one in every], dtype=np.str_),
        "reason": np.array([_reason(one) for one in every], dtype=np.str_),
        "why_undated": np.array([one.why_undated for one in every], dtype=np.str_),
        "ins_class": np.array([one.unit.ins_class for one in every], dtype=np.str_),
    }
    known = np.array([lines.get(one, (np.nan,) * 3) for one in every], dtype=np.float64).reshape(-1, 3)
    told |= dict(zip(("line_nmiph", "line_low_nmiph", "line_high_nmiph"), known.T, strict=True))
    for part in fields(FleetUnitFlights):
        if part.name not in told:
            told[part.name] = np.array([float(getattr(one.unit, part.name)) for one in every], dtype=np.float64)
    return FleetUnitFlights.of(FigureData(FleetUnitFlights.figure, told, {}))

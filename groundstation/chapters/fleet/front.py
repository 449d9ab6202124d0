"""Top of the fleet report: what the fleet is, what asks for attention, key figures."""

from collections import Counter
from collections.abc import Iterable

import numpy as np

from groundstation.chapters.fleet import slopes
from groundstation.chapters.fleet.chapter import FleetChapter
from groundstation.chapters.fleet.common import aircraft_name, day, figure_of, title_of, verdict_words
from groundstation.chapters.gates import VERDICTS
from groundstation.chapters.parts import Cell, Front, Mark
from groundstation.chapters.wording import ABSENT, number, plural
from groundstation.results.fleet import FleetResults

MOST_NAMES = 6
MOST_CHANGES = 3  # each in a sentence
LONGEST_NAME = 24


def build(fleet: FleetResults, chapters: Iterable[FleetChapter]) -> Front:
    """Put the top of the report together, with the key figures of its chapters."""
    named = [name for name in fleet.aircraft if name]
    title = (
        f"{plural(len(fleet), 'flight')} of {plural(len(named), 'aircraft', 'aircraft')}"
        if len(fleet)
        else "No flights"
    )
    pairs: tuple[tuple[str, Cell], ...] = (
        ("Aircraft", _names(named)),
        ("Span", _span(fleet)),
        ("Verdicts", _verdicts(fleet)),
        *((("Sessions", f"{number(len(fleet.sessions), 0)} of several aircraft"),) if fleet.sessions else ()),
        ("Logs without a flight", _without_flight(fleet)),
    )
    verdict, headline = _attention(fleet)
    return Front(
        title,
        pairs,
        verdict=verdict,
        headline=headline,
        sentences=(*_flights(fleet), *_changes(fleet), _judged(fleet)) if len(fleet) else (),
        figures=tuple(figure for chapter in chapters for figure in chapter.figures(fleet)),
    )


def _names(named: list[str]) -> str:
    shown = [aircraft_name(name, LONGEST_NAME) for name in named[:MOST_NAMES]]
    more = f" and {len(named) - len(shown)} more" if len(named) > len(shown) else ""
    return ", ".join(shown) + more or "none is named in a log"


def _span(fleet: FleetResults) -> str:
    times = fleet.flights["start_utc"]
    known = times[~np.isnat(times)]
    if not len(known):
        return "no absolute time"
    without = len(times) - len(known)
    first, last = day(known.min()), day(known.max())
    span = first if first == last else f"{first} … {last}"
    return f"{span}; {plural(without, 'flight')} without a time" if without else span


def _verdicts(fleet: FleetResults) -> str:
    counts = Counter(verdict_words(verdict) for verdict in fleet.flights["verdict"].tolist())
    order = [*(mark.text.lower() for mark in VERDICTS.values()), "not assessable"]
    return " · ".join(f"{number(counts[word], 0)} {word}" for word in order if counts[word]) or ABSENT


def _without_flight(fleet: FleetResults) -> str:
    counts = Counter(one.kind for one in fleet.not_in_fleet)
    return " · ".join(f"{number(counts[kind], 0)} {kind}" for kind in ("failed", "skipped") if counts[kind]) or "none"


def _attention(fleet: FleetResults) -> tuple[Mark, str]:
    flights = fleet.flights
    outliers = len({one.flight_id for one in fleet.outliers})
    rejected = int(np.sum(flights["verdict"] == "reject"))
    unstable = int(np.nansum(flights["landing_unstable_approaches"]))
    lost, unhealthy = int(np.sum(flights["has_lost_data"])), int(np.sum(flights["health_verdict"] == "fail"))
    off = int(np.sum(flights["units_verdict"] == "off"))
    failed = sum(one.kind == "failed" for one in fleet.not_in_fleet) + int(np.sum(flights["status"] == "failed"))
    counted = (
        (len(fleet.change_points), "change of level", "changes of level"),
        (len(slopes.sloping(fleet)), "slope", "slopes"),
        (off, "flight with an INS off", "flights with an INS off"),
        (rejected, "rejected", "rejected"),
        (unstable, "approach not stabilised", "approaches not stabilised"),
        (unhealthy, "flight with bad health", "flights with bad health"),
        (lost, "flight with lost data", "flights with lost data"),
        *((outliers, "outlier", "outliers"), (failed, "log failed", "logs failed")),
    )
    told = [plural(*one) for one in counted if one[0]]
    if told:
        return Mark("warn", "Look at"), " · ".join(told)
    if not len(fleet):
        return Mark("unknown", "Nothing here"), "No log gave a flight"
    if not np.isfinite(flights["error_deg"]).any():
        return Mark("unknown", "Not assessable"), "No flight has a heading error"
    return Mark("good", "Quiet"), "No outlier, no change of level, no slope, nothing rejected or failed"


def _flights(fleet: FleetResults) -> list[str]:
    """Return the names of flights rejected, with unstable approaches or lost data."""
    flights = fleet.flights
    kinds = (
        ("Rejected", flights["verdict"] == "reject"),
        ("Approach not stabilised", flights["landing_unstable_approaches"] > 0),
        ("Health bad", flights["health_verdict"] == "fail"),
        ("Data lost", flights["has_lost_data"].astype(np.bool_)),
    )
    return [f"{title}: {_some(flights['flight_id'][chosen].tolist())}." for title, chosen in kinds if chosen.any()]


def _some(names: list[str]) -> str:
    shown = [aircraft_name(name) for name in names[:MOST_CHANGES]]
    more = len(names) - len(shown)
    return ", ".join(shown) + (f" and {number(more, 0)} more" if more else "")


def _changes(fleet: FleetResults) -> list[str]:
    told = [
        f"{aircraft_name(one.aircraft)}: {title_of(one.quantity)} {figure_of(one.quantity, one.level_before)} before "
        f"{day(np.datetime64(one.start_utc_ns, 'ns'))}, {figure_of(one.quantity, one.level_after)} since."
        for one in fleet.change_points[:MOST_CHANGES]
    ]
    more, sloping = len(fleet.change_points) - len(told), slopes.sloping(fleet)
    told += [slopes.sentence_of(one, fleet) for one in sloping[:MOST_CHANGES]]
    more += len(sloping[MOST_CHANGES:])
    return [*told, f"{plural(more, 'change')} more in the chapter on the trend."] if more else told


def _judged(fleet: FleetResults) -> str:
    """Return how many aircraft have enough flights for trend and outliers."""
    named = len([name for name in fleet.aircraft if name])
    charted = len(set(fleet.trend.aircraft.tolist()))
    fewest = fleet.stated.get("fewest_flights_for_a_trend")
    if charted == named or fewest is None:
        return ""
    return f"A trend needs {number(fewest, 0)} flights with a time: {charted} of {named} aircraft have them."

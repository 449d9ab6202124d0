"""Top of the fleet report: what the fleet is, what asks for attention, key figures."""

from collections import Counter

import numpy as np

from groundstation.chapters.fleet import skill
from groundstation.chapters.fleet.aircraft import median_rate
from groundstation.chapters.fleet.common import aircraft_name, bounded, day, figure_of, plural, title_of, verdict_words
from groundstation.chapters.parts import Cell, Front, Mark
from groundstation.chapters.verdict import VERDICTS
from groundstation.chapters.wording import ABSENT, number, percent
from groundstation.results.fleet import FleetResults

MOST_NAMES = 6
MOST_CHANGES = 3  # each in a sentence
LONGEST_NAME = 24


def build(fleet: FleetResults) -> Front:
    """Put the top of the report together."""
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
        sentences=(*_changes(fleet), _judged(fleet)) if len(fleet) else (),
        figures=_figures(fleet),
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
    failed = sum(one.kind == "failed" for one in fleet.not_in_fleet) + int(np.sum(flights["status"] == "failed"))
    counted = (
        (len(fleet.change_points), "change of level", "changes of level"),
        *((rejected, "rejected", "rejected"), (outliers, "outlier", "outliers"), (failed, "log failed", "logs failed")),
    )
    told = [plural(*one) for one in counted if one[0]]
    if told:
        return Mark("warn", "Look at"), " · ".join(told)
    if not len(fleet):
        return Mark("unknown", "Nothing here"), "No log gave a flight"
    if not np.isfinite(flights["error_deg"]).any():
        return Mark("unknown", "Not assessable"), "No flight has a heading error"
    return Mark("good", "Quiet"), "No outlier, no change of level, nothing rejected or failed"


def _changes(fleet: FleetResults) -> list[str]:
    told = [
        f"{aircraft_name(one.aircraft)}: {title_of(one.quantity)} {figure_of(one.quantity, one.level_before)} before "
        f"{day(np.datetime64(one.start_utc_ns, 'ns'))}, {figure_of(one.quantity, one.level_after)} since."
        for one in fleet.change_points[:MOST_CHANGES]
    ]
    more = len(fleet.change_points) - len(told)
    return [*told, f"{plural(more, 'change')} more in the chapter on the trend."] if more else told


def _judged(fleet: FleetResults) -> str:
    """Return how many aircraft have enough flights for trend and outliers."""
    named = len([name for name in fleet.aircraft if name])
    charted = len(set(fleet.trend.aircraft.tolist()))
    fewest = fleet.stated.get("fewest_flights_for_a_trend")
    if charted == named or fewest is None:
        return ""
    return f"A trend needs {number(fewest, 0)} flights with a time: {charted} of {named} aircraft have them."


def _figures(fleet: FleetResults) -> tuple[tuple[str, str, str], ...]:
    figures = []
    whole = fleet.by_aircraft[0] if fleet.by_aircraft else None
    if whole is not None and whole.mean_deg is not None:
        rejected = whole.assessed - whole.averaged
        remark = f"mean over {plural(whole.averaged, 'flight')}"
        remark += f"; {number(rejected, 0)} rejected left out" if rejected else ""
        figures.append(("Heading error", bounded(whole.mean_deg, 3, "°", signed=True), remark))
    rate, flights = median_rate(fleet)
    if rate is not None:
        figures.append(("INS drift", bounded(rate, 2, "nmi/h"), f"median of {plural(flights, 'unaided flight')}"))
    if (row := skill.headline(fleet)) is not None:
        remark = f"RMS over {number(row.starts, 0)} starts on {plural(row.flights, 'flight')}"
        figures.append((f"Forecast, {row.horizon_min:g} min", bounded(row.rms_m, 0, "m"), remark))
    if fleet.calibration:
        first = fleet.calibration[0]
        remark = f"inside the stated 95 %: {first.title}"
        figures.append(
            ("Calibration", f"{first.inside} of {first.checks}", f"{remark} ({percent(first.share_inside, 0)})")
        )
    return tuple(figures)

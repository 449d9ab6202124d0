"""Text panels of the recording of a fleet: its aircraft, its flights with links to their recordings, what failed."""

import re
from collections.abc import Mapping

import numpy as np

from groundstation.base.records import Int64Array
from groundstation.base.timescales import utc_ns_to_iso
from groundstation.chapters.cooperative import title_of
from groundstation.chapters.markdown import table
from groundstation.results.fleet import AircraftRow, FleetResults
from groundstation.viewer.fleet_recorder import FleetRecorder
from groundstation.viewer.markdown import markdown_text, number
from groundstation.viewer.names import words
from groundstation.viewer.views import numbers

MOST_ROWS = 500  # of a table: the viewer lays out the whole text again and again
SAFE_PATH = re.compile(r"[A-Za-z0-9_-]+(/[A-Za-z0-9_-]+)*\.rrd")  # what needs no quoting in a link
UNITS = {"error_deg": "deg", "radial_error_rate_50_nmiph": "nmi/h"}
QUANTITIES = {"error_deg": "heading error", "radial_error_rate_50_nmiph": "INS radial error rate"}


def aircraft_text(fleet: FleetResults, entities: Mapping[str, str]) -> str:
    """Table of the aircraft, each a link to its entity, then changes of level, outliers and calibration."""
    header = [
        "aircraft",
        "assessed",
        "in the mean",
        "accepted",
        "mean error, deg",
        "95 %, deg",
        "σ within, deg",
        "σ between, deg",
    ]
    rows = [_aircraft_row(one, entities) for one in fleet.by_aircraft[: MOST_ROWS + 1]]
    parts = ["# Heading error by aircraft", table(header, rows)]
    if fleet.change_points:
        parts += ["# Changes of level", "\n".join(f"- {line}" for line in _changes(fleet))]
    if fleet.outliers:
        lines = [f"- {markdown_text(one.flight_id)}: {markdown_text(one.reason)}" for one in fleet.outliers]
        parts += ["# Flights unlike the others of their aircraft", "\n".join(lines[:MOST_ROWS])]
    if fleet.calibration:
        shown = [
            [
                markdown_text(one.title),
                str(one.checks),
                f"{100.0 * one.share_inside:.0f} % (of {100.0 * one.stated:.0f} %)",
                f"{100.0 * one.confidence95[0]:.0f} to {100.0 * one.confidence95[1]:.0f} %",
            ]
            for one in fleet.calibration
        ]
        parts += ["# Checks of the intervals", table(["against", "checks", "inside", "95 % of the share"], shown)]
    return "\n\n".join(parts)


def _aircraft_row(row: AircraftRow, entities: Mapping[str, str]) -> list[str]:
    name = markdown_text(row.aircraft) or "whole fleet"
    entity = entities.get(row.aircraft, "") if row.aircraft else ""
    interval = row.confidence95_deg
    return [
        f"[{name}](recording://{entity})" if entity.isascii() and entity else name,
        f"{row.assessed} of {row.flights}",
        str(row.averaged),
        str(row.accepted),
        number(row.mean_deg, 3, sign=True),
        "–" if interval is None else f"{interval[0]:+.3f} to {interval[1]:+.3f}",
        number(row.sigma_within_deg),
        number(row.sigma_between_deg),
    ]


def _changes(fleet: FleetResults) -> list[str]:
    return [
        f"{markdown_text(one.aircraft)}, {QUANTITIES[one.quantity]}: "
        f"{one.level_before:+.3f} → {one.level_after:+.3f} {UNITS[one.quantity]} from "
        f"{markdown_text(utc_ns_to_iso(one.start_utc_ns, 0))} ({markdown_text(one.flight_id)}), p = {one.p_value:.2g}"
        for one in fleet.change_points[:MOST_ROWS]
    ]


def flights_text(recorder: FleetRecorder, fleet: FleetResults) -> str:
    """Table of the flights in order, the name of each a link to its recording; those without a time in their own."""
    rows, timed = recorder.order, recorder.timed
    with_time, without = rows[:timed], rows[timed:]
    parts = [
        f"# {len(fleet)} flights",
        "The name of a flight is a link to its recording; it opens in a viewer that was started in the folder of "
        "fleet.rrd (`groundstation view` does that), or that looks at `groundstation serve`.",
    ]
    if len(with_time) > MOST_ROWS:
        parts.append(f"The {MOST_ROWS} latest of {len(with_time)}; all of them stand in index.csv.")
    if len(with_time):
        parts.append(_flights(recorder, fleet, with_time[-MOST_ROWS:]))
    if len(without):
        parts += [f"# {len(without)} without absolute time", "Not on the timeline `utc`, only on `flight_number`."]
        parts.append(_flights(recorder, fleet, without[:MOST_ROWS]))
    if fleet.sessions:
        parts += [f"# {len(fleet.sessions)} sessions of several aircraft", _sessions(fleet)]
    return "\n\n".join(parts)


def _sessions(fleet: FleetResults) -> str:
    lines = [
        [
            _linked(markdown_text(one.session_id), one.recording),
            markdown_text(one.aircraft),
            markdown_text(title_of(one.algorithm)) if one.algorithm else markdown_text(one.reason) or "–",
            number(one.two_sigma_r_m, 1),
            number(one.reckoned_two_sigma_r_m, 1),
            number(one.rms_m, 1),
        ]
        for one in fleet.sessions[:MOST_ROWS]
    ]
    header = ["session", "aircraft", "algorithm to trust", "2σ_r, m", "of the INS alone, m", "RMS error, m"]
    return table(header, lines)


def _linked(name: str, recording: str) -> str:
    return f"[{name}]({recording})" if SAFE_PATH.fullmatch(recording) else name


def _flights(recorder: FleetRecorder, fleet: FleetResults, rows: Int64Array) -> str:
    flights = fleet.flights
    header = ["#", "flight", "aircraft", "start, UTC", "heading error ± 95 %, deg", "verdict", "status"]
    starts = flights["start_utc"].astype("datetime64[ns]")
    errors = numbers(flights, "error_deg")
    halves = 0.5 * (numbers(flights, "confidence95_high_deg") - numbers(flights, "confidence95_low_deg"))
    places = recorder.numbers(flights["flight_id"].astype(np.str_))
    lines = []
    for row in rows:
        name, recording = markdown_text(str(flights["flight_id"][row])), str(flights["recording"][row])
        start = "–" if np.isnat(starts[row]) else markdown_text(utc_ns_to_iso(int(starts[row].astype(np.int64)), 0))
        error = number(float(errors[row]), 3, sign=True)
        lines.append(
            [
                str(int(places[row])),
                _linked(name, recording),
                markdown_text(str(flights["aircraft"][row])) or "–",
                start,
                error if error == "–" else f"{error} ± {number(float(halves[row]))}",
                markdown_text(str(flights["verdict"][row])) or "–",
                markdown_text(str(flights["status"][row])),
            ]
        )
    return table(header, lines)


def forecast_text(fleet: FleetResults) -> str:
    """Table of the skill of every method over all flights."""
    header = [
        "method",
        "horizon, min",
        "flights",
        "starts",
        "RMS, m",
        "median flight, m",
        "worst flight, m",
        "95 % holds",
        "flights with NEES within limits",
    ]
    rows = [
        [
            markdown_text(words(one.method)),
            f"{one.horizon_min:g}",
            str(one.flights),
            str(one.starts),
            number(one.rms_m, 0),
            number(one.median_flight_rms_m, 0),
            number(one.highest_flight_rms_m, 0),
            "–" if one.coverage95 is None else f"{100.0 * one.coverage95:.0f} % of {one.coverage_starts}",
            f"{one.flights_within} of {one.flights_judged}" if one.flights_judged else "–",
        ]
        for one in fleet.skill
    ]
    return "\n\n".join(["# Forecast over all flights", table(header, rows)])


def failed_text(fleet: FleetResults) -> str:
    """Table of the logs that gave no flight, and why."""
    rows = [[one.kind, markdown_text(one.source), markdown_text(one.reason)] for one in fleet.not_in_fleet[:MOST_ROWS]]
    more = len(fleet.not_in_fleet) - len(rows)
    rest = [f"{more} more stand in index.csv."] if more else []
    return "\n\n".join([f"# {len(fleet.not_in_fleet)} logs without a flight", table(["", "log", "why"], rows), *rest])

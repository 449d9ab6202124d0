"""Rows of the answer and findings from a judgement on the stations."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from groundstation.base.angles import FloatArray, wrap_360
from groundstation.base.ecef import ecef_from_n, geodetic_deg_m
from groundstation.base.findings import Finding
from groundstation.base.quantiles import NORMAL_95
from groundstation.systems.cooperative.aircraft import Aircraft
from groundstation.systems.cooperative.events import Prepared, prepare
from groundstation.systems.cooperative.loop_types import POINT
from groundstation.systems.cooperative.settings import CooperativeSettings
from groundstation.systems.cooperative.stations.hypotheses import SHIFT, StationTest
from groundstation.systems.cooperative.stations.judge import StationJudgement, judge_stations, survey_of
from groundstation.systems.cooperative.stations_answer import (
    DatumRow,
    ProtectionRow,
    StationRow,
    StationsAnswer,
    StationVerdict,
    digits_of,
)
from groundstation.tables.session import Session


def with_stations_judged(prepared: Prepared, settings: CooperativeSettings) -> tuple[Prepared, StationsAnswer | None]:
    """Judge the ground stations, and return the session that relies on none in doubt.

    Vehicles on wheels are left as they are: their landmarks are many, and each pass over them costs as much as all
    filters together.
    """
    hears_stations = POINT in prepared.events.kind
    is_of_aircraft = all(isinstance(vehicle, Aircraft) for vehicle in prepared.vehicles)
    if not (settings.judges_stations and hears_stations and is_of_aircraft):
        return prepared, None
    judgement = judge_stations(prepared.session, settings)
    answer = stations_answer(judgement, prepared.session, prepared.session.names)
    if judgement.session is not prepared.session:
        prepared = replace(prepare(judgement.session, settings), findings=prepared.findings)
    return prepared, answer


def stations_answer(judgement: StationJudgement, session: Session, vehicles: Sequence[str]) -> StationsAnswer:
    """Return the answer about the stations; ``session`` is that of the stations file."""
    return StationsAnswer(
        tuple(_row(judgement, session, station, vehicles) for station in range(len(session.points))),
        tuple(ProtectionRow(name, *judgement.protection_m(number)) for number, name in enumerate(vehicles)),
        tuple(
            DatumRow(one.name, one.largest_m, one.statistic, one.is_decidable, one.is_told) for one in judgement.datums
        ),
        judgement.raised,
        judgement.asked.repetition,
    )


def station_findings(answer: StationsAnswer) -> tuple[Finding, ...]:
    """Return findings on stations in doubt."""
    found = []
    told = sorted((row for row in answer.datums if row.is_told), key=lambda row: -row.evidence)
    if told:
        names = " or ".join(row.datum for row in told)
        text = (
            f"stations look to be in {names}, not in WGS-84; the answer takes them as {told[0].datum}: write "
            f'datum = "{told[0].datum}" on top of the stations file if they are'
        )
        found.append(Finding("warn", "cooperative.station_datum", text))
    for row in answer.with_verdict("off"):
        text = f"station {row.station} is not where the stations file has it: {shift_text(row)}; {_unknown((row,))}"
        found.append(_finding(row, text))
    several, late = answer.with_verdict("one of several"), answer.with_verdict("left out")
    if len(several) == 1 and late:
        (row,) = several
        text = (
            f"station {row.station} is not where the stations file has it ({shift_text(row)}), or ranges of station "
            f"{_names(late)} are off by a delay: the session does not tell which; {_unknown(several)}"
        )
        found.append(_finding(row, text))
    elif several:
        each = "; ".join(f"{row.station} alone: {shift_text(row)}" for row in several)
        names = _names(several)
        text = (
            f"stations {names} contradict each other, and the session does not tell which of them is not where the "
            f"stations file has it ({each}); {_unknown(several)}"
        )
        found += [_finding(row, text) for row in several[:1]]
    for row in late:
        low, high = _interval(row.delay_m or 0.0, row.delay_sigma_m or 0.0)
        n = digits_of(row.delay_m)
        text = (
            f"ranges of station {row.station} are off by {row.delay_m:+.{n}f} m (95 %: {low:+.{n}f} to {high:+.{n}f}): "
            "its clock or a delay, no shift of its place explains it; the answer does not use them"
        )
        found.append(_finding(row, text))
    return tuple(found)


def shift_text(row: StationRow) -> str:
    """Return where the ranges put a station."""
    if row.shift_m is None or row.shift_sigma_m is None:
        return "no shift can be seen"
    low, high = _interval(row.shift_m, row.shift_sigma_m)
    n = digits_of(row.shift_m)
    where = f"ranges put it {row.shift_m:.{n}f} m (95 %: {max(low, 0.0):.{n}f} to {high:.{n}f}) towards "
    return where + f"{row.shift_direction_deg:.0f} deg of there"


def _interval(value: float, sigma: float) -> tuple[float, float]:
    return value - NORMAL_95 * sigma, value + NORMAL_95 * sigma


def _names(rows: Sequence[StationRow]) -> str:
    return " and ".join(row.station for row in rows) if len(rows) < 3 else ", ".join(row.station for row in rows)


def _unknown(rows: Sequence[StationRow]) -> str:
    moved = [row for row in rows if row.verdict in ("off", "one of several")]
    if not moved:
        return "the answer takes them as they are"
    sigmas = " and ".join(f"{row.used_sigma_m:.{digits_of(row.used_sigma_m)}f} m" for row in moved)
    return f"the answer takes {'its place' if len(moved) == 1 else 'their places'} as unknown by {sigmas}"


def _finding(row: StationRow, text: str) -> Finding:
    return Finding("warn", "cooperative.station_drift", text, f"link.{row.station}", row.station)


def _row(judgement: StationJudgement, session: Session, station: int, vehicles: Sequence[str]) -> StationRow:
    doubt = next((one for one in judgement.doubts if one.station == station), None)
    tests = {test.kind: test for test in (*judgement.tests, *(doubt.tests if doubt else ())) if test.station == station}
    shift = doubt.place if doubt is not None and doubt.place is not None else tests.get(SHIFT)
    delay = next((test for kind, test in tests.items() if kind != SHIFT), None)
    best, worst = judgement.detectable_m(station)
    moves, whose = judgement.metres_per_metre(station)
    place, sigma = _surveyed(judgement, session, station)
    return StationRow(
        station=session.points[station].name,
        verdict=_verdict(judgement, station),
        ranges=int(judgement.asked.ranges[station]),
        chance=_chance(judgement.tests, station),
        shift_m=shift.size_m if shift else None,
        shift_sigma_m=shift.size_sigma_m if shift else None,
        shift_direction_deg=_direction_deg(shift) if shift else None,
        delay_m=float(delay.error_m[0]) if delay else None,
        delay_sigma_m=delay.size_sigma_m if delay else None,
        detectable_best_m=best if np.isfinite(best) else None,
        detectable_worst_m=worst if np.isfinite(worst) else None,
        metres_per_metre=moves,
        moves_most=vehicles[whose],
        stated_sigma_m=session.points[station].position_sigma_m,
        used_sigma_m=judgement.session.points[station].position_sigma_m,
        survey_north_m=None if place is None else float(place[0]),
        survey_east_m=None if place is None else float(place[1]),
        survey_sigma_north_m=None if sigma is None else float(sigma[0]),
        survey_sigma_east_m=None if sigma is None else float(sigma[1]),
    )


def _surveyed(
    judgement: StationJudgement, session: Session, station: int
) -> tuple[FloatArray, FloatArray] | tuple[None, None]:
    """Return where the answer puts a station, north and east off the file, and the sigmas.

    In another datum its place is another one, be it exact there.
    """
    doubt = next((one for one in judgement.doubts if one.station == station), None)
    if doubt is not None and doubt.left_out:
        return None, None
    at = np.array(session.points[station].position_m)
    by_datum = np.array(judgement.session.points[station].position_m) - at
    survey = survey_of(judgement, station)
    if survey is None and not by_datum.any():
        return None, None
    axes = np.eye(3) if session.frame == "local" else ecef_from_n(*geodetic_deg_m(at)[:2])
    place, sigma = survey if survey is not None else (np.zeros(2), np.zeros(2))
    return (axes.T @ by_datum)[:2] + place, sigma


def _verdict(judgement: StationJudgement, station: int) -> StationVerdict:
    doubt = next((one for one in judgement.doubts if one.station == station), None)
    if doubt is None:
        return "fits" if any(test.station == station for test in judgement.tests) else "not judged"
    if doubt.left_out:
        return "left out"
    return "off" if station in judgement.named() else "one of several"


def _chance(tests: Sequence[StationTest], station: int) -> float:
    mine = [test.chance for test in tests if test.station == station]
    return min(1.0, min(mine, default=1.0) * len(tests))


def _direction_deg(test: StationTest) -> float:
    north, east = (-test.error_m).tolist()  # an error is believed less true
    return float(wrap_360(np.rad2deg(np.arctan2(east, north))))

"""Comparison of one flight with its truth.

It covers the errors, the sigmas claimed for them, and the lever arm and clock of the reference.
"""

from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import TYPE_CHECKING

import numpy as np

from groundstation.base.errors import NotAssessableError
from groundstation.base.signals import kind_of, topics_of_kind
from groundstation.base.units import NS_PER_S
from groundstation.results.roles import ErrorsAlongTheFlight, ForecastOfErrors, HeadingByTrack, StatesAlongTheFlight
from groundstation.systems.analysis import Found
from groundstation.systems.known import Known
from groundstation.systems.reference.answer import ErrorRow, ForecastCheck, Placed, ReferenceResult
from groundstation.systems.reference.answers import forecast_checks, heading_check
from groundstation.systems.reference.errors import FIELDS, Errors, errors_of
from groundstation.systems.reference.figures import checks_figure, errors_figure, track_figure
from groundstation.systems.reference.judging import CheckedClaim, axes_of, checked, error_row, without_mounting
from groundstation.systems.reference.paths import path_rows, relative_rows
from groundstation.systems.reference.placing import gross_offset_s, place
from groundstation.systems.reference.settings import ReferenceSettings
from groundstation.systems.reference.subjects import subjects_of
from groundstation.systems.reference.verdict import Standing, findings_of, standing_of

if TYPE_CHECKING:
    from groundstation.tables.table import Flight, Table

OWN_TRUTH = "the log's own truth"
NAME = "truth.source_name"  # of the flight's metadata: the file that was laid beside the log


def judged(flight: "Flight", known: Known, settings: ReferenceSettings) -> Found[ReferenceResult]:
    """Compare what the log recorded, and the answers, with the topic ``truth``.

    Raises
    ------
    NotAssessableError
        Without a truth, or where the log and it have too few samples together.
    """
    topics = [topic for topic in topics_of_kind("truth", flight.topics()) if flight[topic].has("latitude_deg")]
    topics = topics or [
        topic for topic in topics_of_kind("truth", flight.topics()) if any(map(flight[topic].has, FIELDS))
    ]
    if not topics:
        raise NotAssessableError("reference", "no truth in the log", "", "`--reference FILE` adds one")
    reference = _shifted(flight[topics[0]].unique_times(), settings.clock_offset_s)
    recorded = flight.without("truth")
    subjects = dict(subjects_of(recorded, known))
    as_logged = [
        found
        for name, table in subjects.items()
        if (found := errors_of(name, table, reference, flight.start_ns, settings=settings)) is not None
        and len(found) >= settings.samples_min
    ]
    if not as_logged:
        raise NotAssessableError(
            "reference",
            f"fewer than {settings.samples_min} samples of the log and the reference together",
            next_step="does the reference cover another time, or has it gaps?",
        )
    placed, listed = _placed(as_logged, settings)
    gross_s = _gross_offset_s(subjects, reference, flight.start_ns, settings)
    errors = [error_row(one, axis, settings) for one in listed for axis in axes_of(one, settings)]
    standing = standing_of(listed, errors, gross_s, settings)
    answer, claims = _answer(flight, reference, known, as_logged, listed, errors, standing, settings)
    answer = replace(answer, placed=placed)
    return Found(answer, findings_of(answer, gross_s, _step_s(reference)), claims)


def _shifted(reference: "Table", offset_s: float) -> "Table":
    return replace(reference, time_ns=reference.time_ns + round(offset_s * NS_PER_S)) if offset_s else reference


def _step_s(reference: "Table") -> float:
    return float(np.median(np.diff(reference.time_ns))) / NS_PER_S if len(reference) > 1 else float("nan")


def _placed(as_logged: Sequence[Errors], settings: ReferenceSettings) -> tuple[tuple[Placed, ...], list[Errors]]:
    """Estimate lever arm and clock of the recorded sources, and return the errors without arm.

    Tracks made of an INS stand where the GNSS antenna does.
    """
    placed, listed = [], []
    antenna: Placed | None = None
    for one in as_logged:
        if kind_of(one.subject) in ("gnss", "ins") and np.isfinite(one.position_m[:, :2]).any():
            found, one = place(one, settings, takes_stated=kind_of(one.subject) == "gnss")
            placed.append(found)
            antenna = found if antenna is None and kind_of(one.subject) == "gnss" else antenna
        elif np.isfinite(one.position_m[:, :2]).any() and antenna is not None and antenna.is_arm_taken_out:
            one = one.without_arm(antenna.arm_forward_m or 0.0, antenna.arm_right_m or 0.0)
        listed.append(one)
    return tuple(placed), listed


def _gross_offset_s(
    subjects: "dict[str, Table]", reference: "Table", start_ns: int, settings: ReferenceSettings
) -> float:
    """Return how much later than the reference the subjects move, where that is seconds.

    The first subject with enough samples decides; 0 where the offset is small.
    """
    true_s, true_speed = _speeds(reference, start_ns)
    for table in subjects.values():
        time_s, speed = _speeds(table, start_ns)
        if len(time_s) > settings.samples_min and len(true_s) > settings.samples_min:
            rows = slice(None, None, max(len(time_s) // 2_000, 1))
            return gross_offset_s(time_s[rows], speed[rows], true_s, true_speed, settings.search_s)
    return 0.0


def _speeds(table: "Table", start_ns: int) -> tuple[np.ndarray, np.ndarray]:
    names = ("velocity_north_mps", "velocity_east_mps")
    table = table.take(table.valid(*names)).unique_times()
    return (table.time_ns - start_ns) / NS_PER_S, np.hypot(*(table.values(name) for name in names))


def _answer(
    flight: "Flight",
    reference: "Table",
    known: Known,
    as_logged: Sequence[Errors],
    listed: Sequence[Errors],
    errors: Sequence[ErrorRow],
    standing: Standing,
    settings: ReferenceSettings,
) -> tuple[ReferenceResult, list[CheckedClaim]]:
    estimated = known.answer_meeting(StatesAlongTheFlight)
    of_own_unit = "" if estimated is None else estimated.states_name
    claims = [
        found
        for one in listed
        for axis in axes_of(one, settings)
        if axis.sigma and (found := checked(one, without_mounting(axis) if one.subject == of_own_unit else axis))
    ]
    heading = known.answer_meeting(HeadingByTrack)
    headings = [] if heading is None else [heading_check(heading, one) for one in as_logged]
    figures = (errors_figure(listed), track_figure(listed), checks_figure(claims))
    steps_s = np.diff(reference.time_ns) / NS_PER_S
    covered = float(np.sum(steps_s[steps_s <= max(settings.gap_max_s, 3.0 * _step_s(reference))]))
    answer = ReferenceResult(
        reference=flight.metadata.get(NAME, OWN_TRUTH),
        is_judge=standing.is_judge,
        reason=standing.reason,
        interval_s=_step_s(reference),
        covered_share=min(covered / max(flight.duration_s, 1e-9), 1.0),
        longest_gap_s=float(np.max(steps_s, initial=0.0)),
        placed=(),
        errors=tuple(errors),
        claims=tuple(one.row for one in claims),
        paths=tuple(row for one in listed for row in path_rows(one)),
        relative=tuple(row for one in listed for row in relative_rows(one, settings)),
        headings=tuple(one for one in headings if one is not None),
        forecasts=_forecasts(known, as_logged),
        settings={
            name: ", ".join(f"{part:g}" for part in value) if isinstance(value, tuple) else value
            for name, value in asdict(settings).items()
            if value is not None
        },
        figures=tuple(figure for figure in figures if figure is not None),
    )
    return answer, claims


def _forecasts(known: Known, as_logged: Sequence[Errors]) -> tuple[ForecastCheck, ...]:
    """Return the checks of the forecast that was replayed for one of the INSs."""
    forecast, ins = known.answer_meeting(ForecastOfErrors), known.answer_meeting(ErrorsAlongTheFlight)
    replayed = None if forecast is None else forecast.replayed()
    if replayed is None or ins is None:
        return ()
    return tuple(row for one in as_logged for row in forecast_checks(replayed, ins.ins_topic, one))

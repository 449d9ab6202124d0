"""Autopilot health as an analysis.

Every check of the log's own record, and the flight in a sentence.
"""

from dataclasses import asdict, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from groundstation.base.errors import NotAssessableError
from groundstation.base.findings import Finding
from groundstation.results.answer import Answers, answer_of
from groundstation.systems.analysis import Analysis, Found, Shortfall
from groundstation.systems.health.answer import HEADLINES, LOST, AttitudeLoss, AutopilotHealth, Check, Happening
from groundstation.systems.health.columns import COLUMNS
from groundstation.systems.health.settings import HealthSettings
from groundstation.systems.known import Known

if TYPE_CHECKING:
    from collections.abc import Sequence

    from groundstation.systems.health.checks import Judged
    from groundstation.systems.health.evidence import Event, Evidence, FloatArray, Spans
    from groundstation.systems.health.motors import Motors
    from groundstation.systems.health.parameters import Settings
    from groundstation.tables.table import Flight

CODE = "health"
RED = 2  # grade of a sample


class _Checked(NamedTuple):
    """Result of the checks."""

    autopilot: str
    air: "Spans"
    checks: tuple[Check, ...]
    judged: "tuple[Judged, ...]"
    events: "tuple[Event, ...]"
    stated: "Settings"
    loss: AttitudeLoss | None
    motors: "Motors | None"
    pauses_s: "tuple[FloatArray, FloatArray]"


def _run(flight: "Flight", known: Known, settings: HealthSettings) -> Found[AutopilotHealth]:
    from groundstation.systems.health import messages
    from groundstation.systems.health.checks import verdict_of
    from groundstation.systems.health.evidence import not_flown
    from groundstation.systems.health.figures import lanes_figure, motors_figure, series_figure
    from groundstation.systems.health.sentence_answer import told
    from groundstation.tables.estimator_in_use import estimator_in_use
    from groundstation.tables.vehicle import is_rotorcraft

    found = _checked(flight, known, settings)
    used, grounded = estimator_in_use(flight), not_flown(flight, found.air)
    happenings = _happenings(flight, found.events, found.air)
    listed = _listed(happenings, settings.most_messages)
    answer = AutopilotHealth(
        verdict=verdict_of(found.checks),
        sentence=told(found.checks, found.loss, grounded),
        autopilot=found.autopilot,
        judged_over=found.air.words,
        judged_by=found.air.method,
        judged_s=found.air.seconds,
        not_flown=grounded,
        checks=found.checks,
        happenings=listed,
        happenings_left_out=len(happenings) - len(listed),
        settings_found=found.stated.found,
        parameters_logged=found.stated.logged,
        has_defaults=found.stated.has_defaults,
        differing=found.stated.differing,
        estimator="" if used is None else used.name,
        estimator_source="" if used is None else used.source,
        loss=found.loss,
        cannot_taxi=is_rotorcraft(flight),
        settings=_stated(settings),
        figures=(
            lanes_figure(found.judged, happenings, flight.duration_s, found.pauses_s),
            series_figure(found.judged),
            *(() if found.loss is None or found.motors is None else (motors_figure(flight, found.motors, found.loss),)),
        ),
    )
    return Found(answer, (*(_finding(one) for one in found.checks if one.is_bad), *messages.findings(flight)))


class _Read(NamedTuple):
    """Evidence that a log holds, and when it flew."""

    autopilot: str
    air: "Spans"
    evidence: "tuple[Evidence, ...]"
    events: "tuple[Event, ...]"
    stated: "Settings"


def _read(flight: "Flight", known: Known) -> _Read:
    """Read the evidence of a flight.

    Raises
    ------
    NotAssessableError
        Where the log holds nothing that a check judges.
    """
    from groundstation.systems.health import yaw
    from groundstation.systems.health.autopilots import autopilot_of
    from groundstation.systems.health.ending import ends_in_the_air
    from groundstation.systems.health.evidence import in_the_air
    from groundstation.systems.health.parameters import events as events_of_settings
    from groundstation.systems.health.parameters import settings_of
    from groundstation.systems.health.world_field import against_the_model

    autopilot = autopilot_of(flight)
    if autopilot is None:
        raise NotAssessableError(CODE, "the log is of no autopilot whose messages are known")
    evidence = (*against_the_model(flight, autopilot.evidence(flight)), *yaw.evidence(flight))
    events = autopilot.events(flight)
    if not events and not any(bool(np.isfinite(one.value).any()) for one in evidence):
        raise NotAssessableError(CODE, "the log holds no field that a check of the autopilot judges")
    air, stated = in_the_air(flight, known), settings_of(flight, known)
    every = (*events, *events_of_settings(stated, air), *ends_in_the_air(flight, air))
    return _Read(autopilot.name, air, evidence, every, stated)


def _checked(flight: "Flight", known: Known, settings: HealthSettings) -> _Checked:
    """Judge the flight; raises as :func:`_read`."""
    from groundstation.systems.health.batteries import with_batteries
    from groundstation.systems.health.checks import judge, pauses
    from groundstation.systems.health.limits import thresholds

    found = _read(flight, known)
    checks, judged = judge(flight, found.evidence, found.events, found.air, thresholds(settings.thresholds))
    loss, motors = _loss(flight, judged)
    lost_s = None if loss is None else loss.start_s
    told = []
    for one in checks:
        if one.key == "tracking" and loss is not None and loss.told:
            told.append(replace(one, reason=f"{one.reason}; {loss.told}"))
        else:
            told.append(with_batteries(one, judged, lost_s) if one.key == "battery" else one)
    start_ns, end_ns = pauses(found.evidence)
    quiet = (flight.seconds(start_ns), flight.seconds(end_ns))
    return _Checked(found.autopilot, found.air, tuple(told), judged, found.events, found.stated, loss, motors, quiet)


def _loss(flight: "Flight", judged: "Sequence[Judged]") -> "tuple[AttitudeLoss | None, Motors | None]":
    """Return the first loss of attitude that failed its check, and the motor outputs."""
    from groundstation.systems.health.motors import at_the_loss, motors_of

    lost = [one for one in judged if one.measure.quantity == LOST and one.measure.verdict == "fail"]
    if not lost:
        return None, None
    rows = np.flatnonzero((lost[0].grade >= RED) & lost[0].in_air)
    if not len(rows):
        return None, None
    motors = motors_of(flight)
    return at_the_loss(flight, motors, int(lost[0].evidence.time_ns[rows[0]])), motors


def _examine(flight: "Flight", known: Known, _settings: HealthSettings) -> tuple[Shortfall, ...]:
    """Report the checks that cannot be judged.

    Also that the whole log would be judged, where nothing says that it flew.
    """
    from groundstation.systems.health.checks import CHECKS, logged

    found = _read(flight, known)
    there = logged(found.evidence, found.events, found.air)
    missing = [title for key, title in CHECKS.items() if key not in there]
    told = [] if found.air.is_flown else [Shortfall("nothing says that it flew: judged over the whole log")]
    return (*told, *([Shortfall(f"not logged: {', '.join(missing)}")] if missing else []))


def _happenings(flight: "Flight", events: "Sequence[Event]", air: "Spans") -> tuple[Happening, ...]:
    time_ns = np.array([one.time_ns for one in events], dtype=np.int64)
    rows = zip(events, flight.seconds(time_ns).tolist(), air.hold(time_ns).tolist(), strict=True)
    return tuple(
        Happening(time_s, one.check, one.grade, one.text, one.source, in_the_air) for one, time_s, in_the_air in rows
    )


def _listed(happenings: tuple[Happening, ...], most: int) -> tuple[Happening, ...]:
    """Return the happenings that are listed, warnings and failures before others."""
    if len(happenings) <= most:
        return happenings
    order = sorted(range(len(happenings)), key=lambda row: happenings[row].grade == "info")[:most]
    return tuple(happenings[row] for row in sorted(order))


def _stated(settings: HealthSettings) -> dict[str, object]:
    """Return the settings as an answer keeps them: what the user left out stays out."""
    stated = {
        name: {key: value for key, value in asdict(limit).items() if value is not None}
        for name, limit in settings.thresholds.items()
    }
    return {"thresholds": stated, "most_messages": settings.most_messages}


def _finding(check: Check) -> Finding:
    measure = check.decisive
    place = topic = ""
    if check.first_event_s is not None:
        place = f"at {check.first_event_s:.1f} s"
    elif measure is not None:
        first, against, _ = measure.source.partition(" against ")
        topic = first.partition(",")[0] if against else measure.source.rpartition(".")[0]
        if measure.span_start_s is not None and measure.span_end_s is not None:
            place = f"{measure.span_start_s:.1f} to {measure.span_end_s:.1f} s"
        else:
            place = f"at {measure.worst_at_s:.1f} s"
    return Finding("warn", f"{CODE}.{check.key}", f"{check.title}: {check.verdict}, {check.reason}", topic, place)


def _applies(flight: "Flight", _known: Known) -> bool:
    from groundstation.systems.health.autopilots import autopilot_of

    return autopilot_of(flight) is not None


def _sentence(answers: Answers) -> str:
    answer = answer_of(answers, AutopilotHealth)
    return "" if answer is None else f"autopilot health {HEADLINES[answer.verdict].lower()}: {answer.sentence}"


HEALTH = Analysis(
    name="health",
    title="health of the autopilot: GNSS, filter, vibration, magnetometer, faults, battery, links, control",
    subject="autopilot health",
    page_title="Autopilot health",
    needs="the autopilot's own messages: PX4 ULog, ArduPilot DataFlash or tlog",
    settings=HealthSettings,
    answer=AutopilotHealth,
    builds_on=("latency",),
    run=_run,
    applies=_applies,
    sentence=_sentence,
    columns=COLUMNS,
    compared=("health_verdict", "health_vibration_mps2", "health_hdop", "health_test_ratio"),
    examine=_examine,
)

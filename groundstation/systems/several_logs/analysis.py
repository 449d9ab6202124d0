"""Joining of several logs as an analysis: the MCAP's record, checked on the joined tables."""

import json
from dataclasses import asdict
from typing import TYPE_CHECKING

import numpy as np

from groundstation.base.angles import wrap_180
from groundstation.base.errors import NotAssessableError
from groundstation.base.findings import Finding
from groundstation.base.serial import MismatchError, from_json
from groundstation.results.answer import Answers, answer_of
from groundstation.results.columns import AnswerColumn
from groundstation.results.figures import FigureData
from groundstation.results.roles import StatesAlongTheFlight
from groundstation.systems.analysis import Analysis, Found
from groundstation.systems.known import Known
from groundstation.systems.several_logs.answer import ChosenSource, JoinedLog, Joining, MotionAgreement, Together
from groundstation.systems.several_logs.arrays import JoinedDifference, JoinedMotion
from groundstation.systems.several_logs.channels import UNITS, side_of
from groundstation.systems.several_logs.seen_answer import seen_by_motion
from groundstation.systems.several_logs.settings import TwoClocksSettings
from groundstation.tables.sources import TOGETHER, is_joined, ranked, why_first

if TYPE_CHECKING:
    from groundstation.tables.table import Flight

MOST_POINTS = 4_000
GAP_S = 2.5
SPEED = ("north", "east")
SUFFIX = {"m/s": "mps", "deg": "deg", "deg/s": "dps", "m": "m"}
CHOSEN_KINDS = ("ins", "gnss")
NOT_KNOWN = "how well the clocks agree is not known"


def _run(flight: "Flight", known: Known, settings: TwoClocksSettings) -> Found[Together]:
    try:
        joining = from_json(Joining, json.loads(flight.metadata[TOGETHER]))
    except (ValueError, MismatchError) as error:
        raise NotAssessableError("together", f"the joining kept in the MCAP cannot be read ({error})") from error
    figures: list[FigureData] = []
    agreement = []
    for log in joining.logs:
        shown = _shown(flight, log)
        if shown is not None:
            agreement.append(shown[0])
            figures += shown[1]
    sources = tuple(_chosen(flight, kind) for kind in CHOSEN_KINDS if len(ranked(flight, kind)) > 1)
    answer = Together(joining.logs, sources, tuple(agreement), asdict(settings), tuple(figures))
    findings = [
        Finding("info", "together.source", f"{one.kind.upper()}: {one.topic} is used: {one.why}", one.topic)
        for one in sources
    ]
    if seen_by_motion(joining.logs, known.answer_meeting(StatesAlongTheFlight)) is None:
        findings += [
            Finding("warn", "together.file_time", f"the times of the files alone place {one.source_name}: {NOT_KNOWN}")
            for one in joining.logs
            if one.method == "file_time"
        ]
    return Found(answer, tuple(findings))


def _chosen(flight: "Flight", kind: str) -> ChosenSource:
    order = ranked(flight, kind)
    return ChosenSource(kind, order[0].topic, why_first(kind, order), tuple(one.topic for one in order[1:]))


def _shown(flight: "Flight", log: JoinedLog) -> tuple[MotionAgreement, list[FigureData]] | None:
    """Compare the motion of a joined log with that of the log with the flight's clock.

    Also returns the figures: both motions and their difference.
    """
    topics = log.reference_topic, log.topic
    if not log.signals or any(topic not in flight for topic in topics):
        return None
    is_speed = log.signals[:2] == SPEED
    names = SPEED if is_speed else log.signals[:1]
    reference, other = (side_of(flight, topic, names) for topic in topics)
    if reference is None or other is None:
        return None
    name, unit = ("speed", "m/s") if is_speed else (names[0], UNITS[names[0]])
    shown, seen = (np.hypot(*one.values.T) if is_speed else one.values[:, 0] for one in (reference, other))
    after = np.clip(np.searchsorted(reference.time_s, other.time_s), 1, len(reference.time_s) - 1)
    inside = (other.time_s >= reference.time_s[0]) & (other.time_s <= reference.time_s[-1])
    inside &= reference.time_s[after] - reference.time_s[after - 1] <= GAP_S
    at_other = np.where(inside, np.interp(other.time_s, reference.time_s, shown), np.nan)
    left = seen - at_other
    if name == "heading":
        left = wrap_180(left)
    if name in ("heading", "altitude"):
        left = left - np.median(left[inside]) if inside.any() else left
    if not inside.any():
        return None
    agreement = MotionAgreement(
        log.label,
        name,
        unit,
        int(np.count_nonzero(inside)),
        float(np.std(seen[inside])),
        float(np.sqrt(np.mean(left[inside] ** 2))),
    )
    rows = np.unique(np.linspace(0, len(left) - 1, MOST_POINTS).astype(np.intp))
    return agreement, _figures(log, name, SUFFIX[unit], other.time_s[rows], (at_other[rows], seen[rows], left[rows]))


def _figures(
    log: JoinedLog, name: str, suffix: str, time_s: np.ndarray, values: tuple[np.ndarray, np.ndarray, np.ndarray]
) -> list[FigureData]:
    label = log.label or "a"
    reference, other = (topic.replace(".", "_") for topic in (log.reference_topic, log.topic))
    both = {f"{reference}_{name}_{suffix}": values[0], f"{other}_{name}_{suffix}": values[1]}
    left = {f"{name}_difference_{suffix}": values[2]}
    return [
        JoinedMotion(time_s=time_s, motion=both).of_one(label),
        JoinedDifference(time_s=time_s, difference=left).of_one(label),
    ]


def _sentence(answers: Answers) -> str:
    answer = answer_of(answers, Together)
    if answer is None:
        return ""
    parts = []
    for log in answer.logs:
        known = [one.largest_half_width95_s for one in log.stretches if one.largest_half_width95_s is not None]
        if log.method != "own_clock":
            parts.append(f"{log.source_name} to +- {max(known):.3f} s" if known else f"{log.source_name} by file time")
    return f"{len(answer.logs)} logs on one clock ({', '.join(parts)})"


def _applies(flight: "Flight", _known: Known) -> bool:
    return is_joined(flight)


TOGETHER_ANALYSIS = Analysis(
    name="together",
    title="several logs of one flight on one clock: offset, drift, agreement, sources used",
    subject="joining of logs",
    needs="several logs of one flight, run with --together",
    builds_on=("trajectory",),
    settings=TwoClocksSettings,
    answer=Together,
    run=_run,
    applies=_applies,
    sentence=_sentence,
    columns=(
        AnswerColumn("joined_logs", "number", "logs of the flight", lambda answer: len(answer.logs), is_indexed=False),
    ),
)

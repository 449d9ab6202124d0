"""Chapter on several logs of one flight.

How each was put on the flight's clock, and which sources are used.
"""

from groundstation.base.dataclasses import dataclass
from groundstation.base.quantiles import NORMAL_95
from groundstation.base.words import with_half
from groundstation.chapters.parts import Claim, Facts, Figure, Grid, Head, Mark, Note, Part, Rank, Section
from groundstation.chapters.wording import number, plural, typeset
from groundstation.results.flight import FlightResults
from groundstation.results.roles import StatesAlongTheFlight
from groundstation.systems.several_logs.answer import JoinedLog, JoinedStretch, JoinMethod, Together
from groundstation.systems.several_logs.seen_answer import seen_by_motion

TITLE = "Logs of this flight"
LEAD = "How the clock of each log relates to that of the flight, and which of several sources the analyses use."
METHODS: dict[JoinMethod, str] = {
    "own_clock": "clock of the flight",
    "gnss_time": "GNSS time of both",
    "motion": "motion of both",
    "gnss_time_and_motion": "GNSS time and motion",
    "file_time": "times of the files",
}
GOOD_S = 0.05  # half of an interval that analyses of headings and latencies can live with
LOG_HEADS = (
    *(Head("Log"), Head("Topics"), Head("Read by"), Head("Records", True), Head("Placed by")),
    *(Head("Correlation", True), Head("Basis")),
)
STRETCH_HEADS = (
    *(Head("Log"), Head("From, s", True), Head("To, s", True), Head("Placed by"), Head("Offset, s", True)),
    *(Head("95 %, s", True), Head("95 % at worst, s", True), Head("Drift, ppm", True), Head("95 %, ppm", True)),
)
STRETCH_CAPTION = (
    "Offset: clock of the flight minus that of the log, in the middle of the stretch. Drift: positive where the clock "
    "of the log is fast."
)
SOURCE_HEADS = (Head("Kind"), Head("Used"), Head("Why"), Head("Others"))


def together(results: FlightResults) -> Section | None:
    """Return the chapter; None for a flight of one log."""
    answer = results.answer(Together)
    if answer is None:
        return None
    parts: list[Part] = [Grid("Logs", LOG_HEADS, [_log_row(log) for log in answer.logs])]
    stretches = [(log, one) for log in answer.logs for one in log.stretches]
    if stretches:
        rows = [_stretch_row(log, one) for log, one in stretches]
        parts.append(Grid("Clocks", STRETCH_HEADS, rows, STRETCH_CAPTION))
    parts += [Note(f"{log.source_name}: {typeset(remark)}", "warn") for log in answer.logs for remark in log.remarks]
    if answer.sources:
        rows = [(one.kind.upper(), one.topic, typeset(one.why), ", ".join(one.others)) for one in answer.sources]
        parts.append(Grid("Sources used", SOURCE_HEADS, rows))
    for one in answer.agreement:
        source = next(log for log in answer.logs if log.label == one.label)
        left = f"{number(one.residual_rms, 3, one.unit)} RMS"
        of = f"of {number(one.motion_rms, 2, one.unit)}, {plural(one.samples, 'sample')}"
        parts.append(
            Facts("", [(f"Difference in {one.signal} of {source.topic} and {source.reference_topic}", left, of)])
        )
        parts.append(Figure("together.motion", one.label))
    claim = _claim(answer, seen := _seen_by_motion(results, answer))
    if seen is not None:
        parts.insert(1, Note(seen.sentence, "good"))
    return Section("together", TITLE, LEAD, tuple(parts), claim.headline, claim=claim)


@dataclass(frozen=True)
class _Seen:
    """Distance in time of two logs placed by file time, as their motion shows it."""

    apart: str
    sentence: str


def _seen_by_motion(results: FlightResults, answer: Together) -> _Seen | None:
    """Return how well the clocks agree, by the GNSS latency of a trajectory over both logs.

    None where it is another log, or several, that file time alone places, and where no trajectory shows it.
    """
    seen = seen_by_motion(answer.logs, results.answer_meeting(StatesAlongTheFlight))
    if seen is None:
        return None
    size = typeset(with_half(abs(seen.latency_s), NORMAL_95 * seen.sigma_s, "s"))
    apart = f"{size} {'later' if seen.latency_s > 0.0 else 'earlier'}"
    text = (
        f"By the motion that both show, GNSS times of {seen.gnss.source_name} are {apart} than those of "
        f"{seen.unit.source_name} (95 %), the receiver's delay included: it is the GNSS latency of the "
        "trajectory, which takes it off."
    )
    return _Seen(apart, text)


def _claim(answer: Together, seen: _Seen | None) -> Claim:
    others = [log for log in answer.logs if log.method != "own_clock"]
    widths = [one.largest_half_width95_s for log in others for one in log.stretches]
    known = [width for width in widths if width is not None]
    if len(known) < len(widths):
        mark, headline = Mark("warn", "By file time"), "it is not known how well the clocks agree"
        if seen is not None:
            mark = Mark("good", "Joined")
            headline = f"{len(answer.logs)} logs by file time: GNSS {seen.apart} by the motion, and taken off"
    else:
        worst = max(known, default=0.0)
        mark = Mark("good", "Joined") if worst <= GOOD_S else Mark("warn", "Joined roughly")
        headline = f"{len(answer.logs)} logs on one clock to ± {number(worst, 3, 's')}"
    if any(log.remarks for log in others):
        mark = Mark("warn", mark.text)
    value = number(max(known), 3, "s") if known and len(known) == len(widths) else ""
    remark = "clocks of the logs agree, 95 %" if value else headline
    return Claim(Rank.OTHER, mark, headline, value, remark)


def _log_row(log: JoinedLog) -> tuple[str, ...]:
    return (
        log.source_name,
        f"end in .{log.label}" if log.label else "as named",
        log.reader,
        number(log.rows, 0),
        METHODS[log.method],
        number(log.correlation, 2),
        typeset(log.reason),
    )


def _stretch_row(log: JoinedLog, one: JoinedStretch) -> tuple[str, ...]:
    return (
        log.source_name,
        number(one.start_s, 1),
        number(one.end_s, 1),
        METHODS[one.method],
        number(one.offset_s, 3, signed=True),
        number(one.half_width95_s, 3),
        number(one.largest_half_width95_s, 3),
        number(one.drift_ppm, 1, signed=True),
        number(one.drift_half_width95_ppm, 1),
    )

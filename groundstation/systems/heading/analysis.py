"""System 1 as an analysis: the heading correction.

It uses the user's intervals and the proof of ground contact.
"""

from dataclasses import replace
from typing import TYPE_CHECKING

from groundstation.base.findings import Finding
from groundstation.methods.roles import HeadingOnGround, LimitsOfTaxi
from groundstation.results.answer import Answers, answer_of
from groundstation.results.roles import Delays, StatesAlongTheFlight
from groundstation.results.rules import Rejudged
from groundstation.systems.analysis import Analysis, Found, RejudgeAlso, RestsOn, Rules, Shortfall, main_numbers
from groundstation.systems.heading.answer import HeadingResult
from groundstation.systems.heading.columns import COLUMNS
from groundstation.systems.heading.gates_answer import LIMITS
from groundstation.systems.heading.settings import HeadingRequest, HeadingSettings
from groundstation.systems.heading.wording import left_out_told
from groundstation.systems.known import Known

if TYPE_CHECKING:
    from pathlib import Path

    from groundstation.tables.table import Flight

FIELDS = (
    *("true_heading_deg", "magnetic_heading_deg", "track_deg", "ground_speed_mps"),
    *("velocity_north_mps", "velocity_east_mps"),
)


def _run(flight: "Flight", known: Known, settings: HeadingSettings) -> Found[HeadingResult]:
    from groundstation.systems.heading.estimate import estimate_heading_error
    from groundstation.systems.heading.second import by_states, disagreement
    from groundstation.tables.headings import true_heading
    from groundstation.tables.phases import ground_mask

    if known.intervals_problem:
        raise known.intervals_problem
    found = estimate_heading_error(
        flight,
        on_ground=lambda time_ns: ground_mask(flight, time_ns),
        heading=lambda topic: true_heading(flight, topic),
        settings=settings,
        aircraft=known.aircraft,
        site=known.site,
        request=HeadingRequest(intervals=known.intervals),
        latencies=known.answer_meeting(Delays),
        phases=known.phases,
        weather=known.weather,
    )
    second = by_states(found, known.answer_meeting(StatesAlongTheFlight), settings, known.aircraft)
    found = found if second is None else replace(found, by_states=second)
    told = (_verdict(found), *_steps(found), *_findings_of_what_was_set(flight, found, known), *disagreement(found))
    return Found(found, told)


def _examine(flight: "Flight", known: Known, settings: HeadingSettings) -> tuple[Shortfall, ...]:
    from groundstation.systems.heading.examine import examine_heading

    return examine_heading(flight, known, settings)


def _verdict(result: HeadingResult) -> Finding:
    """The verdict: a rejected one is a warning."""
    text = f"heading correction: {result.verdict}: {result.verdict_reason}"
    return Finding("warn" if result.verdict == "reject" else "info", f"heading.{result.verdict}", text)


def _steps(result: HeadingResult) -> tuple[Finding, ...]:
    """Steps of the INS heading, each by name."""
    text = "INS heading steps by {size:+.2f} deg at {time:.1f} s: the heading error is the one after it"
    return tuple(
        Finding("warn", "heading.step", text.format(size=step.size_deg, time=step.time_s), result.ins_topic)
        for step in result.steps
    )


def _findings_of_what_was_set(flight: "Flight", heading: HeadingResult, known: Known) -> tuple[Finding, ...]:
    """Return findings on the user's references and intervals.

    They tell what contradicts the log, or touches none of its samples.
    """
    from groundstation.methods.taxi.gating import intervals_without_epoch
    from groundstation.systems.heading.references import reference_findings

    lines = reference_findings(heading, flight.metadata, known.site)
    findings = [Finding("warn", "heading.reference", line) for line in lines]
    if known.weather and heading.wind is None:
        text = "no METAR line of the field within the time allowed of the taxi: the ordinary wind is taken"
        if not flight.has_utc:
            text = "the log has no UTC: no METAR line can be placed, the ordinary wind is taken"
        findings.append(Finding("warn", "heading.weather", text))
    for part in intervals_without_epoch(flight.time_s(heading.gnss_topic), known.intervals):
        text = f"interval to {part.use}, {part.start_s:g} to {part.end_s:g} s: no GNSS epoch in it"
        findings.append(Finding("warn", "heading.interval", text))
    return tuple(findings)


def _rests_on(_flight: "Flight", heading: HeadingResult) -> RestsOn | None:
    spans_s = tuple((segment.start_s, segment.end_s) for segment in heading.segments)
    return RestsOn((heading.ins_topic, heading.gnss_topic), FIELDS, spans_s) if spans_s else None


def _sentence(answers: Answers) -> str:
    heading = answer_of(answers, HeadingResult)
    if heading is None:
        return ""
    low, high = heading.confidence95_deg
    text = f"{heading.verdict}: heading error {heading.error_deg:+.3f} deg, 95 % {low:+.3f} to {high:+.3f}"
    if heading.confidence95_measured_deg is not None:
        low, high = heading.confidence95_measured_deg
        text += f" ({low:+.3f} to {high:+.3f} without steady sideslip)"
    why = heading.verdict_reason
    text += f" ({why})" if heading.correction_deg is None else f", enter {heading.correction_deg:+g} deg"
    left = "" if heading.unproven_ground is None else left_out_told(heading.unproven_ground)
    return text if left in why else f"{text}; {left}"


def _on_ground(known: Known) -> HeadingOnGround:
    from groundstation.systems.heading.on_ground import offered

    return offered(known)


def _rejudge(answer: HeadingResult, settings: HeadingSettings) -> tuple[Rejudged, ...]:
    from groundstation.systems.heading.verdict import rejudge

    return rejudge(answer, settings)


def _rejudge_learned(out: "Path") -> RejudgeAlso:
    from groundstation.systems.heading.installation.rejudged import rejudge_learned

    return rejudge_learned(out)


def _limits_of_taxi(known: Known) -> LimitsOfTaxi:
    return LimitsOfTaxi(known.settings_of(HeadingSettings))


HEADING = Analysis(
    name="heading",
    title="INS heading error and correction from GNSS on straight taxi (Markelov et al. 2015)",
    subject="heading correction",
    needs="ins heading (true or magnetic), gnss velocities, proof of ground contact (weight on wheels, a landed "
    "flag or a standstill to start from), straight taxi above 6 m/s",
    settings=HeadingSettings,
    answer=HeadingResult,
    run=_run,
    builds_on=("latency", "trajectory"),
    rests_on=_rests_on,
    sentence=_sentence,
    columns=COLUMNS,
    examine=_examine,
    rules=Rules(LIMITS, _rejudge, _rejudge_learned),
    offers={HeadingOnGround: _on_ground, LimitsOfTaxi: _limits_of_taxi},
    is_main=main_numbers(
        "verdict|error_deg|standard_error_deg|confidence95_(low|high)_deg|precision_deg|correction_deg|samples"
        "|taxi_seconds|drift_deg_per_h|lever_arm_m|parking_heading_deg|reference_residual_arcmin"
    ),
)

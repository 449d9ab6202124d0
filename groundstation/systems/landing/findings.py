"""Findings about the approaches of a flight."""

from collections.abc import Iterator

from groundstation.base.findings import Finding, Severity
from groundstation.systems.landing.answer import Approach, LandingResult
from groundstation.systems.landing.criteria_answer import REVERSED, Criterion
from groundstation.systems.landing.reference import fits
from groundstation.systems.landing.verdict_answer import verdict_words


def findings_of(answer: LandingResult, runways_problem: str = "") -> tuple[Finding, ...]:
    """Findings of all approaches, in their order.

    ``runways_problem``: why the user's own table of runways was not used.
    """
    found = [finding for one in answer.approaches for finding in _of(one)]
    if runways_problem:
        text = f"the shipped table of runways was used: {runways_problem}"
        found.insert(0, Finding("warn", "landing.runway_table", text))
    for left in answer.left_out[:5]:
        found.append(Finding("info", "landing.left_out", f"no approach at {left.time_s:.0f} s: {left.reason}"))
    return tuple(found)


def _limits(one: Criterion) -> str:
    ends = [f"{end:.1f}" for end in (one.at_least, one.at_most) if end is not None]
    return " to ".join(ends)


def _of(one: Approach) -> list[Finding]:
    place = f"{one.start_s:.0f} to {one.end_s:.0f} s"
    name = f"approach {one.number}"
    found: list[Finding] = []
    if failed := [row for row in one.stabilised if row.verdict == "not stabilised"]:
        text = f"{name} not stabilised: {'; '.join(verdict_words(failed))}"
        found.append(Finding("warn", "landing.not_stabilised", text, one.position_topic, place))
    for criterion in one.criteria:
        if criterion.state == "not met" and criterion.value is not None:
            text = f"{name}: {criterion.kind.title} {criterion.value:.1f} {criterion.unit}, limit {_limits(criterion)}"
            found.append(Finding("warn", "landing.criterion_not_met", text, one.position_topic, place))
    if any(REVERSED in gate.reason for row in one.stabilised for gate in row.gates):
        found.append(Finding("info", "landing.gear_reversed", f"{name}: gear {REVERSED}", "configuration", place))
    if one.sensitivity is not None and one.sensitivity.ratio is not None and not fits(one.sensitivity):
        ratio = one.sensitivity.ratio
        what = "another width of the course, or another runway"
        code = "landing.sensitivity"
        if ratio < 0.0:
            what, code = "its sign is reversed, or it is of another runway", "landing.deviation_reversed"
        text = f"{name}: positions move by {ratio:.2f} of what {one.guidance_topic} shows: {what}"
        found.append(Finding("warn", code, text, one.guidance_topic, place))
    found += _of_touchdown(one, name)
    for error in one.position_errors:
        if error.state == "measured" and error.error_m is not None and error.sigma_m is not None:
            text = f"{name}: {error.topic} is {error.error_m:+.0f} m across the course (sigma {error.sigma_m:.0f} m)"
            found.append(Finding("info", "landing.position_error", text, error.topic, place))
    for along in one.along_errors:
        if along.state == "measured" and along.error_m is not None and along.sigma_m is not None:
            text = f"{name}: {along.topic} is {along.error_m:+.0f} m along the course (sigma {along.sigma_m:.0f} m)"
            found.append(Finding("info", "landing.along_error", text, along.topic, place))
    for height in one.height_errors:
        if height.state == "measured" and height.error_m is not None and height.sigma_m is not None:
            text = f"{name}: altitude of {height.topic} is off by {height.error_m:+.1f} m on the runway"
            text = f"{text} (sigma {height.sigma_m:.1f} m)"
            found.append(Finding("info", "landing.height_error", text, height.topic, place))
    return found + [
        Finding(severity, code, f"{name}: {text}", one.position_topic, place) for severity, code, text in _runway(one)
    ]


def _runway(one: Approach) -> Iterator[tuple[Severity, str, str]]:
    """Yield what is to be told of the runway."""
    runway, choice = one.runway, one.runway.choice
    placed = f"course from the positions, threshold {runway.place_reason}"
    if choice is None:
        if not runway.is_surveyed:
            yield "info", "landing.runway_placed", f"no runway of the site file: {placed}"
    elif choice.state == "decided":
        sure = choice.candidates[0].probability
        text = f"runway {runway.name} by the table of runways ({choice.table}), probability {sure:.3f}"
        yield "info", "landing.runway_of_table", text
        if runway.is_closed:
            yield "warn", "landing.runway_closed", f"runway {runway.name} is closed in the table of runways"
    elif choice.state == "not decided":
        likely = ", ".join(f"{row.name} ({row.probability:.2f})" for row in choice.candidates)
        yield "info", "landing.runway_not_decided", f"runway {likely}: {choice.reason}; {placed}"
    else:
        yield "info", "landing.runway_placed", f"no runway of the table: {choice.reason}; {placed}"


def _of_touchdown(one: Approach, name: str) -> list[Finding]:
    """Findings about the time of a touchdown: witnesses that disagree, or none at all."""
    down = one.touchdown
    if down is None:
        return []
    place = f"{down.time_s:.1f} s"
    found = []
    for witness in down.witnesses:
        if witness.state == "disagrees" and witness.time_s is not None and witness.sigma_s is not None:
            off_s = witness.time_s - down.time_s
            text = f"{name}: {witness.name} shows the touchdown {off_s:+.1f} s off the others"
            text = f"{text} (sigma {witness.sigma_s:.1f} s)"
            found.append(Finding("info", "landing.witness_disagrees", text, witness.topic, place))
    if not any(witness.state == "agrees" for witness in down.witnesses):
        text = f"{name}: touchdown by {down.found_by} alone, sigma {down.time_sigma_s:.1f} s: no witness is logged"
        found.append(Finding("info", "landing.touchdown_unwitnessed", text, one.position_topic, place))
    for second in down.second_contacts:
        load = "" if second.load_g is None else f" with {second.load_g:.2f} g"
        later_s = second.time_s - down.time_s
        text = f"{name}: second contact {later_s:.1f} s after the touchdown{load}: bounce or rebound"
        found.append(Finding("info", "landing.second_contact", text, one.position_topic, place))
    return found

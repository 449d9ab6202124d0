"""Verdicts on learned numbers under other limits."""

from dataclasses import replace
from pathlib import Path

from groundstation.base.digits import digits_of
from groundstation.results.gates import judged_gate
from groundstation.results.installations import InstalledFlight, installations_in
from groundstation.results.rules import Rejudged
from groundstation.systems.analysis import RejudgeAlso
from groundstation.systems.heading.installation.outcome import verdict_of
from groundstation.systems.heading.settings import HeadingSettings

LEARNED_GATE = "whole_half_width_learned"
LEARNED_TITLE = "half width of the 95 % interval, the installation learned"


def rejudge_learned(out: Path) -> RejudgeAlso:
    """Return what judges the learned number of each flight of a folder again.

    It goes by the ids of flights with a heading answer that earlier ones taught.
    """
    found = installations_in(out)
    flights = () if found is None else (flight for one in found.installations for flight in one.flights)
    learned = {one.lesson.flight_id: one for one in flights if one.answer is not None and not one.answer.why_not}

    def rejudge(flight_id: str, heading: Rejudged, settings: HeadingSettings) -> tuple[Rejudged, ...]:
        found = learned.get(flight_id)
        return () if found is None else (_learned(found, heading, settings),)

    return rejudge


def _learned(flight: InstalledFlight, heading: Rejudged, settings: HeadingSettings) -> Rejudged:
    """Return the verdict on the learned number under other limits.

    It rests on the gates on the taxi as they were judged again.
    """
    assert flight.answer is not None
    failed = tuple(gate.name for gate in heading.gates_after if gate.required and gate.state != "passed")
    limit_deg = round(settings.whole_half_width_max_deg, digits_of("limit_deg"))  # as it is stored
    lesson = replace(
        flight.lesson,
        verdict=heading.after,
        failed=failed,
        limit_deg=limit_deg if settings.whole_decides else None,
    )
    half_width_deg = flight.answer.half_width_deg
    before, after = (
        judged_gate(
            (None, limit_deg if one.limit_deg is None else one.limit_deg),
            LEARNED_GATE,
            LEARNED_TITLE,
            half_width_deg,
            unit="deg",
            required=one.limit_deg is not None,
        )
        for one in (flight.lesson, lesson)
    )
    verdict = verdict_of(lesson, half_width_deg)
    return Rejudged("heading, installation learned", flight.answer.verdict, verdict, (before,), (after,))

"""Claim of the best trajectory, and what it says of the on-board filter."""

from collections.abc import Mapping

from groundstation.base.words import capitalised, counted, with_half
from groundstation.chapters.parts import Claim, Mark, Rank
from groundstation.chapters.wording import number_with_unit, significant, typeset, with_full_stop
from groundstation.systems.trajectory.answer import BestTrajectory, TrajectoryState
from groundstation.systems.trajectory.checks_answer import OutageRow
from groundstation.systems.trajectory.wording_answer import (
    accuracy_words,
    axes_words,
    change_words,
    error_words,
    opening_change,
    opening_error,
    rounded,
    sentence_of,
    when,
)

MARKS: Mapping[TrajectoryState, Mark] = {
    "accepted": Mark("good", "Accept"),
    "doubtful": Mark("warn", "Doubtful"),
    "ambiguous": Mark("warn", "Ambiguous"),
}
WRONG = Mark("warn", "Filter wrong")
CHANGED = Mark("warn", "Filter changed")
DANGER_DEG = {"heading": 10.0, "roll": 5.0, "pitch": 5.0}  # surely wrong by so much
STARTING_S = 30.0  # a filter that has just begun is still finding its heading
MOST_TOLD = 3


def claim_of(answer: BestTrajectory) -> Claim:
    """Return the claim: a sure error of the on-board filter, else state and accuracy."""
    figures = [*_figures(answer)]
    worst, changed = opening_error(answer), opening_change(answer)
    if changed is not None:
        row, change = changed, changed.changes[0]
        value = typeset(with_half(change.by, change.half95, row.unit))
        sentences = [
            full_sentence(text) for text in (f"best trajectory: {accuracy_words(answer)}", *axes_texts(answer))
        ]
        remark, headline = f"on-board {row.quantity}, changed", _headline(sentence_of(answer))
        return Claim(Rank.ONBOARD_ERROR, CHANGED, headline, value, remark, sentences, figures)
    if worst is not None:
        row, span = worst
        is_danger = (
            abs(span.value) - span.half95 > DANGER_DEG.get(row.quantity, float("inf"))
            and span.end_s - answer.start_s > STARTING_S
        )
        value = typeset(with_half(span.value, span.half95, row.unit))
        remark = f"on-board {row.quantity} wrong {when(answer, span)}"
        others = [text for text in wrong_texts(answer) if text != error_words(answer, row, span)]
        told = (*others, f"best trajectory: {accuracy_words(answer)}", *axes_texts(answer))
        sentences = [full_sentence(text) for text in told]
        headline = _headline(error_words(answer, row, span))
        return Claim(Rank.ONBOARD_ERROR, WRONG, headline, value, remark, sentences, figures, is_danger=is_danger)
    mark, headline = MARKS[answer.state], _headline(sentence_of(answer))
    if answer.state != "accepted":
        return Claim(Rank.TRACK_OPEN, mark, headline, "", "", _reasons_left(answer), figures)
    heading = answer.accuracy_of("heading")
    value = "" if heading is None else f"± {rounded(heading.median_within95)}°"
    sentences = [full_sentence(text) for text in (*axes_texts(answer), *inside_texts(answer))]
    return Claim(Rank.TRACK, mark, headline, value, "heading, 95 %", sentences, figures)


def axes_texts(answer: BestTrajectory) -> list[str]:
    """Return whose attitude it is, where it is not that of the vehicle."""
    return [text] if (text := axes_words(answer)) else []


def _reasons_left(answer: BestTrajectory) -> list[str]:
    """Return the reasons that the headline does not tell."""
    told = answer.reasons[1:] if answer.state == "doubtful" else answer.reasons
    return [full_sentence(one) for one in told]


def _figures(answer: BestTrajectory) -> list[tuple[str, str, str]]:
    found = []
    for quantity, label in (("heading", "Heading"), ("tilt", "Tilt"), ("horizontal position", "Position")):
        row = answer.accuracy_of(quantity)  # type: ignore[arg-type]
        if row is not None and answer.state == "accepted":
            found.append((label, f"± {number_with_unit(rounded(row.median_within95), unit_sign_of(row.unit))}", "95 %"))
    longest = _outage_told(answer)
    if longest is not None and answer.state == "accepted":
        found.append((f"Outage of {longest.length_s:g} s", *_outage_figure(longest)))
    return found


def _outage_figure(row: OutageRow) -> tuple[str, str]:
    """Return the error of outages live and in post-processing, and what it is."""
    smoothed = _metres(row.smoothed_rms_m)
    worst = "" if row.smoothed_worst_m is None else f", worst {_metres(row.smoothed_worst_m)}"
    if row.forward_end_rms_m is None:
        return smoothed, f"in post-processing, RMS of {row.count}{worst}"
    live_worst = "" if row.forward_end_worst_m is None else f", worst {_metres(row.forward_end_worst_m)}"
    remark = f"at its end, RMS of {row.count}{live_worst}; in post-processing {smoothed} RMS of {row.count}{worst}"
    return f"{_metres(row.forward_end_rms_m)} live", remark


def _metres(value: float) -> str:
    return number_with_unit(significant(value, 2), "m")


def _outage_told(answer: BestTrajectory) -> OutageRow | None:
    """Return the replayed outage that stands for all: of a minute, or the longest."""
    rows = [one for one in answer.outages if one.count]
    return next((one for one in rows if one.length_s == 60.0), rows[-1] if rows else None)


def wrong_texts(answer: BestTrajectory) -> list[str]:
    """Return what the on-board filter got wrong beyond 95 %, the worst of each quantity."""
    rows = () if answer.onboard is None or answer.state != "accepted" else answer.onboard.rows
    told = []
    for row in rows:
        if row.spans:
            more = len(row.spans) - 1
            also = f"; {counted(more, 'more span')}" if more else ""
            told.append(error_words(answer, row, row.spans[0]) + also)
        if row.changes:
            told.append(change_words(row))
    worst = opening_error(answer)
    if worst is not None:
        first = error_words(answer, *worst)
        told = [first, *(text for text in told if text != first and not text.startswith(f"{first};"))]
    return told[:MOST_TOLD]


def inside_texts(answer: BestTrajectory) -> list[str]:
    """Return that the on-board filter shows no error beyond 95 %, with what is left."""
    if (
        answer.onboard is None
        or answer.state != "accepted"
        or any(one.spans or one.changes for one in answer.onboard.rows)
    ):
        return []
    left = [
        f"{one.quantity} {significant(one.rms, 2)} {one.unit}"
        for one in answer.onboard.rows
        if one.quantity in ("heading", "roll", "pitch", "horizontal position")
    ]
    return [f"the on-board filter is nowhere wrong beyond 95 % for two seconds; it differs by {', '.join(left)} (RMS)"]


def full_sentence(text: str) -> str:
    """Return text of the answer as a sentence of a page."""
    return with_full_stop(typeset(text))


def _headline(text: str) -> str:
    told = typeset(text)
    return capitalised(told)


def unit_sign_of(unit: str) -> str:
    """Return a unit as a page writes it.

    Examples
    --------
    >>> unit_sign_of("deg"), unit_sign_of("deg/s"), unit_sign_of("m/s")
    ('°', '°/s', 'm/s')
    """
    return unit.replace("deg", "°").replace("sqrt(", "√(")

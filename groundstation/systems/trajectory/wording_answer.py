"""Words for the best trajectory: state, accuracy, errors of the on-board filter."""

import math

from groundstation.base.words import clock_text
from groundstation.systems.trajectory.answer import (
    OPENING_ERROR,
    BestTrajectory,
    OnboardError,
    Quantity,
    WrongSpan,
)

UNTIL_END_S = 15.0  # a span that ends so near the end of the track lasts on
SHORT: tuple[tuple[Quantity, str], ...] = (
    ("heading", "heading"),
    ("tilt", "tilt"),
    ("horizontal position", "position"),
)


def sentence_of(answer: BestTrajectory) -> str:
    """Return one sentence: the doubt, else the filter's error, else the accuracy."""
    if answer.state == "ambiguous":
        first, second = (f"{one.end_heading_deg:.0f}" for one in answer.hypotheses[:2])
        return f"two headings explain the log, {first} or {second} deg at the end: neither is claimed"
    if answer.state == "doubtful":
        return f"sigmas may be too small: {answer.reasons[0]}"
    worst = opening_error(answer)
    return accuracy_words(answer) if worst is None else error_words(answer, *worst)


def accuracy_words(answer: BestTrajectory) -> str:
    """Return the accuracy: "heading to 0.3 deg, tilt to 0.1 deg, position to 0.8 m (95 %)".

    That of a heading that is not known is left out.
    """
    told = []
    for quantity, name in SHORT:
        row = answer.accuracy_of(quantity)
        if row is not None and not (quantity == "heading" and answer.state == "ambiguous"):
            told.append(f"{name} to {rounded(row.median_within95)} {row.unit}")
    return f"{', '.join(told)} (95 %)"


def opening_error(answer: BestTrajectory) -> tuple[OnboardError, WrongSpan] | None:
    """Return the error of the on-board filter that a report opens with.

    It is surely above a limit; of several the one furthest above it. None of a solution that is not accepted.
    """
    if answer.state != "accepted" or answer.onboard is None:
        return None
    found = [
        (sure_size(span) / OPENING_ERROR[row.quantity], row, span) for row in answer.onboard.rows for span in row.spans
    ]
    ratio, row, span = max(found, key=lambda one: one[0], default=(0.0, None, None))
    return None if row is None or span is None or ratio < 1.0 else (row, span)


def sure_size(span: WrongSpan) -> float:
    """Return the size of an error that is sure: its value less half of its interval."""
    return abs(span.value) - span.half95


def error_words(answer: BestTrajectory, row: OnboardError, span: WrongSpan) -> str:
    """Return "on-board heading wrong by 2.1 +- 0.3 deg from 12:03 on (95 %)"."""
    return (
        f"on-board {row.quantity} wrong by {with_half(span.value, span.half95, row.unit)} {when(answer, span)} (95 %)"
    )


def when(answer: BestTrajectory, span: WrongSpan) -> str:
    """Return the time of a span: "12:03 to 14:10", "from 12:03 on", "throughout"."""
    from_start, to_end = span.start_s - answer.start_s < UNTIL_END_S, answer.end_s - span.end_s < UNTIL_END_S
    if from_start and to_end:
        return "throughout"
    if to_end:
        return f"from {clock_text(span.start_s)} on"
    return f"{clock_text(span.start_s)} to {clock_text(span.end_s)}"


def with_half(value: float, half: float, unit: str) -> str:
    """Return a value with half of its interval, rounded by the latter.

    Examples
    --------
    >>> with_half(2.134, 0.31, "deg"), with_half(-18.27, 1.23, "m"), with_half(151.2, 32.0, "m")
    ('2.1 +- 0.3 deg', '-18.3 +- 1.2 m', '151 +- 32 m')
    """
    places = places_of(half)
    return f"{round(value, places) + 0.0:.{places}f} +- {half:.{places}f} {unit}".strip()


def rounded(value: float) -> str:
    """Return a value that is an accuracy itself.

    Examples
    --------
    >>> rounded(0.294), rounded(0.0123), rounded(1.84), rounded(14.2)
    ('0.3', '0.012', '1.8', '14')
    """
    return f"{value:.{places_of(value)}f}"


def places_of(half: float) -> int:
    """Return the decimals with one digit, two where it begins with a one."""
    if not half > 0.0 or not math.isfinite(half):
        return 1
    exponent = math.floor(math.log10(half))
    leading = round(half / 10.0**exponent, 1)
    return min(max(-exponent + (1 if leading < 2.0 else 0), 0), 6)

"""Words for the best trajectory: state, accuracy, errors of the on-board filter."""

from groundstation.base.words import places_of, span_text, with_half
from groundstation.systems.trajectory.answer import TRAVEL, BestTrajectory
from groundstation.systems.trajectory.onboard_answer import OnboardError, WrongSpan
from groundstation.systems.trajectory.quantity_answer import Quantity

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
    worst, changed = opening_error(answer), opening_change(answer)
    if worst is not None:
        return error_words(answer, *worst)
    return accuracy_words(answer) if changed is None else change_words(changed)


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


def line_of(answer: BestTrajectory) -> str:
    """Return the sentence of a line on the terminal.

    Before an accuracy stands whose attitude it is of.
    """
    told = sentence_of(answer)
    is_accuracy = answer.state == "accepted" and told == accuracy_words(answer)
    return f"{whose}: {told}" if is_accuracy and (whose := whose_words(answer)) else told


def whose_words(answer: BestTrajectory) -> str:
    """Return in short whose attitude it is, where it is not that of the vehicle; empty else."""
    mounting = answer.mounting
    if mounting.source == "case":
        return "attitude of the unit's case, not of the vehicle"
    if mounting.off_deg is None or mounting.to_state_deg is None:
        return ""
    return f"attitude of the unit, {mounting.off_deg:.1f} deg off the vehicle's"


def axes_words(answer: BestTrajectory) -> str:
    """Return whose attitude it is, where it is not that of the vehicle; empty else."""
    mounting = answer.mounting
    if mounting.source == "case":
        why = mounting.words.removeprefix("attitude is that of the case").removeprefix(": ")
        return f"heading, roll and pitch are those of the unit's case{': ' * bool(why)}{why}"
    if mounting.off_deg is None or mounting.to_state_deg is None:
        return ""
    yaw, pitch = (answer.parameter(name) for name in TRAVEL)
    seen = "" if yaw is None or pitch is None else f" (yaw {yaw.value:.1f}, pitch {pitch.value:.1f} deg)"
    return (
        f"heading, roll and pitch are those of the unit: it travels {mounting.off_deg:.1f} deg off its forward axis"
        f"{seen}; for those of the vehicle state {stated_words(mounting.to_state_deg)} in the aircraft file"
    )


def stated_words(angles_deg: tuple[float, float, float]) -> str:
    """Return angles as a line of the aircraft file.

    Examples
    --------
    >>> stated_words((180.0, 7.15, -174.84))
    'imu_mounting_deg = [180.0, 7.2, -174.8]'
    """
    return f"imu_mounting_deg = [{', '.join(f'{one:.1f}' for one in angles_deg)}]"


def opening_error(answer: BestTrajectory) -> tuple[OnboardError, WrongSpan] | None:
    """Return the error of the on-board filter that a report opens with.

    It is surely above a limit; of several the one furthest above it. None of a solution that is not accepted.
    """
    if answer.state != "accepted" or answer.onboard is None:
        return None
    found = [(span.over(row.quantity), row, span) for row in answer.onboard.rows for span in row.spans]
    ratio, row, span = max(found, key=lambda one: one[0], default=(0.0, None, None))
    return None if row is None or span is None or ratio < 1.0 else (row, span)


def error_words(answer: BestTrajectory, row: OnboardError, span: WrongSpan) -> str:
    """Return "on-board heading wrong by 2.1 +- 0.3 deg from 12:03 on (95 %)"."""
    return (
        f"on-board {row.quantity} wrong by {with_half(span.value, span.half95, row.unit)} {when(answer, span)} (95 %)"
    )


def change_words(row: OnboardError) -> str:
    """Return "on-board heading changed by 2.1 +- 0.2 deg at 6:36 (95 %): wrong before ..."."""
    return f"on-board {row.quantity} {row.changed}"


def opening_change(answer: BestTrajectory) -> OnboardError | None:
    """Return the row whose change a report opens with, where no error does."""
    if answer.state != "accepted" or answer.onboard is None or opening_error(answer) is not None:
        return None
    found = [(row.changes[0].over(row.quantity), row) for row in answer.onboard.rows if row.changes]
    ratio, row = max(found, key=lambda one: one[0], default=(0.0, None))
    return row if ratio >= 1.0 else None


def when(answer: BestTrajectory, span: WrongSpan) -> str:
    """Return the time of a span: "12:03 to 14:10", "from 12:03 on", "throughout"."""
    return span_text((span.start_s, span.end_s), (answer.start_s, answer.end_s))


def rounded(value: float) -> str:
    """Return a value that is an accuracy itself.

    Examples
    --------
    >>> rounded(0.294), rounded(0.0123), rounded(1.84), rounded(14.2)
    ('0.3', '0.012', '1.8', '14')
    """
    return f"{value:.{places_of(value)}f}"

"""Chapter on the comparison with the reference.

Errors of GNSS, INS and the answers; claimed sigma against seen errors.
"""

from groundstation.base.words import capitalised
from groundstation.chapters.assessed import without_answer
from groundstation.chapters.gates import setting_facts
from groundstation.chapters.parts import Cell, Claim, Facts, Figure, Grid, Head, Mark, Note, Part, Rank, Section, kept
from groundstation.chapters.wording import ABSENT, interval, number, percent, significant, typeset, unit_sign
from groundstation.results.flight import FlightResults
from groundstation.results.forecast_methods import FORECAST_METHODS
from groundstation.systems.reference.answer import (
    ClaimRow,
    ClaimState,
    ErrorRow,
    Placed,
    Quantity,
    ReferenceResult,
    title_of,
)

TITLE = "Against the reference"
LEAD = "Errors of recordings and answers against a reference that none of them used. Error = subject − reference."
PLACES = {"m": 2, "mps": 3, "deg": 3}
STATES: dict[ClaimState, Mark] = {
    "consistent": Mark("good", "consistent"),
    "too_sure": Mark("warn", "too sure"),
    "too_careful": Mark("plain", "too careful"),
    "too_few": Mark("unknown", "too few to judge"),
    "reference_too_coarse": Mark("unknown", "reference too coarse"),
}
ALIGNMENTS = {"none": "as it is", "shift": "shifted", "shift_and_yaw": "shifted and turned"}
WIDE = 10.0  # an interval so many times as long as its figure says nothing
QUANTITIES: tuple[Quantity, ...] = ("position", "velocity", "attitude")
CAPTIONS: dict[Quantity, str] = {
    "position": (
        "95 % intervals from the number of independent samples; a dash where there are too few. Along and cross: "
        "relative to the motion of the reference, right positive; horizontal: length; vertical: up."
    ),
    "velocity": "As for position.",
    "attitude": "Subject − reference; includes the mounting between the two.",
}


def reference(results: FlightResults) -> Section | None:
    """Return the chapter; None where no comparison was asked for."""
    answer = results.answer(ReferenceResult)
    if answer is None:
        return without_answer(results, "reference", TITLE, LEAD)
    told = _claim(answer)
    parts: tuple[Part | None, ...] = (
        None if answer.is_judge else Note(f"This reference judges nothing: {typeset(answer.reason)}.", "warn"),
        _about(answer),
        _claims(answer),
        Figure("reference.claims"),
        *(_errors(answer, quantity) for quantity in QUANTITIES),
        Figure("reference.track"),
        *(Figure("reference.errors", of=f"{subject} {quantity}") for subject, quantity in _figures(answer)),
        _headings(answer),
        _forecasts(answer),
        _placed(answer),
        _paths(answer),
        _relative(answer),
        Note(
            "An error common to subject and reference is not seen: a reference from the same antenna repeats its "
            "multipath, one from the same INS its mounting. Heading errors include the mounting between the two; "
            "height errors include the geoid model where one of the two is above sea level."
        ),
    )
    workings = kept((setting_facts(answer.settings, "reference"),))
    return Section("reference", TITLE, LEAD, kept(parts), told.headline, claim=told, appendix=workings)


def _claim(answer: ReferenceResult) -> Claim:
    if not answer.is_judge:
        headline = f"the reference judges nothing: {typeset(answer.reason)}"
        return Claim(Rank.OTHER, Mark("unknown", "Not judged"), headline, remark="the reference judges nothing")
    rows = [row for row in answer.errors if row.axis in ("horizontal", "heading") and row.quantity != "velocity"]
    figures = tuple((_name(row), _of(row, row.spread.rmse, unit=True), _around(row)) for row in rows)
    sure = [row for row in answer.claims if row.state == "too_sure"]
    judged = [row for row in answer.claims if row.state in ("too_sure", "too_careful", "consistent")]
    mark = Mark("warn", "Too sure") if sure else Mark("good", "Consistent") if judged else Mark("good", "Measured")
    sentences = [
        f"{capitalised(name)}: {percent(row.share_inside95)} of the errors inside the 95 % claimed."
        for row in sure[:2]
        if (name := _name(row))
    ]
    headline = "; ".join(f"{label} {value}" for label, value, _remark in figures[:3]) or "nothing to compare"
    value, remark = (figures[0][1], f"{figures[0][0]}, RMS") if figures else ("", "")
    return Claim(Rank.REFERENCE, mark, headline, value, remark, sentences, figures[:5])


def _about(answer: ReferenceResult) -> Facts:
    step = f"one sample every {significant(answer.interval_s)} s"
    pairs = (
        ("Reference", answer.reference, step),
        (
            "Share of the flight covered",
            percent(answer.covered_share, 1),
            f"longest gap {number(answer.longest_gap_s, 1, 's')}",
        ),
        ("Used by the estimators", "nothing", "their answers are independent of it"),
    )
    return Facts("The reference", pairs)


def _errors(answer: ReferenceResult, quantity: Quantity) -> Grid | None:
    rows = [row for row in answer.errors if row.quantity == quantity]
    if not rows:
        return None
    heads = (
        Head("Error"),
        *(Head(title, True) for title in ("RMS", "95 %", "Mean", "95 %", "σ", "Median", "Least … largest")),
        *(Head("Independent of samples", True), Head("Reference σ", True)),
    )
    coarse = " ○: most of it may be the reference's own error." if any(row.is_coarse for row in rows) else ""
    title = f"Errors of {quantity}, {unit_sign(rows[0].unit)}"
    return Grid(title, heads, [_error(row) for row in rows], CAPTIONS[quantity] + coarse, ("reference_errors",))


def _error(row: ErrorRow) -> tuple[Cell, ...]:
    one, is_length = row.spread, row.axis == "horizontal"
    own = _of(row, row.reference_sigma)
    return (
        f"{title_of(row.subject)}, {row.axis}",
        _of(row, one.rmse),
        _between(one.rmse95, one.rmse, row),
        ABSENT if is_length else number(one.mean, PLACES[row.unit], signed=True),
        ABSENT if is_length else _between(one.mean95, one.std, row),
        _of(row, one.std),
        _of(row, one.median),
        f"{_of(row, one.smallest)} … {_of(row, one.largest)}",
        f"{number(one.effective_samples, 0)} of {number(one.samples, 0)}",
        Mark("unknown", own) if row.is_coarse else own,
    )


def _claims(answer: ReferenceResult) -> Grid | None:
    heads = (
        *(Head("Claim"), Head("Claimed σ", True), Head("Reference σ", True), Head("Seen inside 95 %", True)),
        *(Head("95 % interval", True), Head("Independent of samples", True), Head("Claim is")),
    )
    cells = [
        (
            f"{_name(row)}, {unit_sign(row.unit)}",
            number(row.claimed_sigma, PLACES[row.unit]),
            number(row.reference_sigma, PLACES[row.unit]),
            percent(row.share_inside95, 1),
            " … ".join(percent(bound) for bound in row.confidence95),
            f"{number(row.effective_samples, 1)} of {number(row.samples, 0)}",
            STATES[row.state],
        )
        for row in answer.claims
    ]
    caption = (
        "Share of the errors inside the 95 % that subject and reference claim together. A lasting error counts once, "
        "however long it lasts. σ: RMS over the flight; for a horizontal error, north and east together. A subject "
        "without σ claims nothing and is left out; a reference without σ counts as exact. The attitude of a trajectory "
        "from raw inertial data is judged about its mean: how its unit stands to that of the reference is not known."
    )
    return Grid("Claimed against seen", heads, cells, caption, ("reference_checks",)) if cells else None


def _headings(answer: ReferenceResult) -> Grid | None:
    heads = (
        *(Head("Heading error"), Head("Found", True), Head("95 % claimed", True), Head("By the reference", True)),
        *(Head("95 %", True), Head("Difference", True), Head("Claim")),
    )
    cells = [
        (
            row.ins_topic,
            number(row.claimed_deg, 3, "°", signed=True),
            interval(row.claimed95_deg, 2, "°"),
            number(row.seen_deg, 3, "°", signed=True),
            interval(row.seen95_deg, 3, "°"),
            number(row.difference_deg, 3, "°", signed=True),
            Mark("good", "held") if row.is_inside else Mark("bad", "missed"),
        )
        for row in answer.headings
    ]
    caption = "The error that the heading chapter found, and INS − reference at the samples it used."
    return Grid("Heading error found", heads, cells, caption) if cells else None


def _forecasts(answer: ReferenceResult) -> Grid | None:
    heads = (
        *(Head("After, min", True), Head("Starts", True), Head("Forecast, RMS m", True), Head("Raw INS, RMS m", True)),
        *(Head("Seen inside 95 %", True), Head("95 % interval", True)),
    )
    cells = [
        (
            number(row.horizon_min, 0),
            number(row.starts, 0),
            number(row.rmse_m, 1),
            number(row.raw_rmse_m, 1),
            percent(row.share_inside95),
            ABSENT if row.confidence95 is None else " … ".join(percent(bound) for bound in row.confidence95),
        )
        for row in answer.forecasts
    ]
    method = FORECAST_METHODS.get(answer.forecasts[0].method, "") if answer.forecasts else ""
    caption = (
        f"Replayed outages, method: {method}. Errors against the reference, not against the GNSS that was withheld."
    )
    return Grid("Forecast", heads, cells, caption) if cells else None


def _placed(answer: ReferenceResult) -> Grid | None:
    heads = (
        *(Head("Subject"), Head("Arm forward, m", True), Head("Arm right, m", True), Head("Arm")),
        *(Head("Latency, s", True), Head("95 %", True), Head("RMS before, m", True), Head("RMS judged, m", True)),
        Head("Basis"),
    )
    caption = (
        "Arm: from the point of the reference to that of the subject, in body axes; turns show it. An arm that is not "
        "observable stays in the errors, and so does a latency."
    )
    cells = [
        (
            title_of(row.subject),
            number(row.arm_forward_m, 2, signed=True),
            number(row.arm_right_m, 2, signed=True),
            _arm(row),
            number(row.clock_offset_s, 3, signed=True),
            interval(row.clock_offset95_s, 3, ""),
            number(row.rmse_with_arm_m, 2),
            number(row.rmse_m, 2),
            typeset(row.reason),
        )
        for row in answer.placed
    ]
    return Grid("Place and clock", heads, cells, caption) if cells else None


def _arm(row: Placed) -> Mark:
    if row.arm_state == "not_observable":
        return Mark("unknown", "not observable, not removed")
    within = "" if row.arm_half_width_m is None else f" ± {number(row.arm_half_width_m, 2)} (95 %)"
    where = "removed" if row.is_arm_taken_out else "not removed"
    return Mark("good" if row.is_arm_taken_out else "plain", f"{row.arm_state}{within}, {where}")


def _paths(answer: ReferenceResult) -> Grid | None:
    heads = (Head("Subject"), Head("Alignment"), Head("Horizontal RMS, m", True), Head("Turned by", True))
    cells = [
        (
            title_of(row.subject),
            ALIGNMENTS[row.alignment],
            number(row.rmse_m, 2),
            number(row.yaw_deg, 3, "°", signed=True),
        )
        for row in answer.paths
    ]
    caption = "Absolute trajectory error. A shift removes what is constant: a datum, an arm that does not turn."
    return Grid("Whole path", heads, cells, caption) if cells else None


def _relative(answer: ReferenceResult) -> Grid | None:
    heads = (
        *(Head("Subject"), Head("Over", True), Head("RMS, m", True), Head("95 %", True), Head("Median, m", True)),
        *(Head("Largest, m", True), Head("Of the distance", True), Head("Independent of pairs", True)),
    )
    cells = [
        (
            title_of(row.subject),
            f"{number(row.length, 0)} {row.unit}",
            number(row.rmse_m, 2),
            _between(row.rmse95_m, row.rmse_m),
            number(row.median_m, 2),
            number(row.largest_m, 2),
            percent(row.share_of_way, 2),
            f"{number(row.effective_pairs, 0)} of {number(row.pairs, 0)}",
        )
        for row in answer.relative
    ]
    caption = "Change of the horizontal position error over a time or distance, from each sample on."
    return Grid("Relative error", heads, cells, caption) if cells else None


def _figures(answer: ReferenceResult) -> list[tuple[str, str]]:
    """Return subjects and quantities with a figure of their own, in the order of the errors."""
    found = dict.fromkeys((row.subject, row.quantity) for row in answer.errors)
    return [one for one in found if one[1] == "position" or one[0].partition(".")[0] in ("gnss", "ins", "heading")]


def _name(row: ErrorRow | ClaimRow) -> str:
    what = row.axis if row.quantity == "attitude" else f"{row.quantity} {row.axis}"
    return f"{title_of(row.subject)}, {what}"


def _of(row: ErrorRow, value: float | None, *, unit: bool = False) -> str:
    return number(value, PLACES[row.unit], unit_sign(row.unit) if unit else "")


def _around(row: ErrorRow) -> str:
    bounds = _between(row.spread.rmse95, row.spread.rmse, row)
    return "RMS" if bounds == ABSENT else f"RMS, 95 % {bounds}"


def _between(bounds: tuple[float, float] | None, size: float, row: ErrorRow | None = None) -> str:
    """Return an interval; a dash for one too wide to mean anything."""
    if bounds is None or bounds[1] - bounds[0] > WIDE * size:
        return ABSENT
    places = 2 if row is None else PLACES[row.unit]
    return f"{number(bounds[0], places)} … {number(bounds[1], places)}"

"""Chapter on the best trajectory: doubt first, then its accuracy and what it says of the on-board filter."""

from collections.abc import Mapping

from groundstation.chapters.assessed import without_answer
from groundstation.chapters.gates import gate_grid
from groundstation.chapters.parts import Cell, Claim, Facts, Figure, Grid, Head, Mark, Note, Part, Rank, Section, kept
from groundstation.chapters.wording import (
    ABSENT,
    clock,
    number,
    number_with_unit,
    percent,
    significant,
    typeset,
    with_full_stop,
)
from groundstation.results.flight import FlightResults
from groundstation.systems.trajectory.answer import (
    BestTrajectory,
    HeldOutRow,
    InnovationRow,
    OnboardError,
    OutageRow,
    TrajectoryParameter,
    TrajectoryState,
    UnitMounting,
)
from groundstation.systems.trajectory.wording_answer import (
    accuracy_words,
    error_words,
    opening_error,
    places_of,
    rounded,
    sentence_of,
    when,
    with_half,
)

TITLE = "Best trajectory"
LEAD = "Where the vehicle was, how it stood and where it pointed, by all data before and after, and how sure that is."
MARKS: Mapping[TrajectoryState, Mark] = {
    "accepted": Mark("good", "Accepted"),
    "doubtful": Mark("warn", "Doubtful"),
    "ambiguous": Mark("warn", "Ambiguous"),
}
WRONG = Mark("warn", "Filter wrong")
DANGER_DEG = {"heading": 10.0, "roll": 5.0, "pitch": 5.0}  # surely wrong by so much
STARTING_S = 30.0  # a filter that has just begun is still finding its heading
MOST_TOLD = 3
SOURCES = {
    "stated": "stated in the aircraft file",
    "logged": "logged",
    "found": "found from the log",
    "case": "not known",
}
MOTIONS = {"rolls": "rolls", "flies": "flies", "walks": "walks", "floats": "floats"}


def trajectory(results: FlightResults) -> Section | None:
    """Return the chapter; None when the flight was not assessed and no reason is known."""
    answer = results.answer(BestTrajectory)
    if answer is None:
        return without_answer(results, "trajectory", TITLE, LEAD)
    parts: list[Part | None] = [
        *_doubt(answer),
        _hypotheses(answer),
        *_told_of_filter(answer),
        _accuracy(answer),
        Figure("trajectory.map"),
        Figure("trajectory.onboard_attitude"),
        Figure("trajectory.onboard_motion"),
        _onboard(answer),
        _outages(answer),
        Figure("trajectory.outages"),
        _checks(answer),
        _parameters(answer),
    ]
    appendix: list[Part | None] = [
        _basis(answer),
        gate_grid(answer.gates),
        Figure("trajectory.sigmas"),
        Figure("trajectory.separation"),
        _separation(answer),
        Figure("trajectory.residuals"),
        Figure("trajectory.biases"),
        Figure("trajectory.attitude"),
        _noise(answer),
        _raised(answer),
    ]
    headline = typeset(sentence_of(answer))
    return Section("trajectory", TITLE, LEAD, kept(parts), headline, claim=_claim(answer), appendix=kept(appendix))


# ------------------------------------------------------------------------------------------------------- the claim


def _claim(answer: BestTrajectory) -> Claim:
    figures = [*_figures(answer)]
    worst = opening_error(answer)
    if worst is not None:
        row, span = worst
        is_danger = (
            abs(span.value) - span.half95 > DANGER_DEG.get(row.quantity, float("inf"))
            and span.end_s - answer.start_s > STARTING_S
        )
        value = typeset(with_half(span.value, span.half95, row.unit))
        remark = f"on-board {row.quantity} wrong {when(answer, span)}"
        others = [text for text in _wrong_texts(answer) if text != error_words(answer, row, span)]
        sentences = [_sentence(text) for text in (*others, f"best trajectory: {accuracy_words(answer)}")]
        headline = _headline(error_words(answer, row, span))
        return Claim(Rank.ONBOARD_ERROR, WRONG, headline, value, remark, sentences, figures, is_danger=is_danger)
    mark, headline = MARKS[answer.state], _headline(sentence_of(answer))
    if answer.state != "accepted":
        return Claim(Rank.TRACK_OPEN, mark, headline, "", "", [_sentence(one) for one in answer.reasons], figures)
    heading = answer.accuracy_of("heading")
    value = "" if heading is None else f"± {rounded(heading.median_within95)}°"
    sentences = [_sentence(text) for text in _inside_texts(answer)]
    return Claim(Rank.TRACK, mark, headline, value, "heading, 95 %", sentences, figures)


def _figures(answer: BestTrajectory) -> list[tuple[str, str, str]]:
    found = []
    for quantity, label in (("heading", "Heading"), ("tilt", "Tilt"), ("horizontal position", "Position")):
        row = answer.accuracy_of(quantity)  # type: ignore[arg-type]
        if row is not None and answer.state == "accepted":
            found.append((label, f"± {number_with_unit(rounded(row.median_within95), unit_sign_of(row.unit))}", "95 %"))
    longest = _outage_told(answer)
    if longest is not None:
        remark = f"without GNSS, smoothed, RMS of {longest.count}"
        found.append((f"{longest.length_s:g} s", number(longest.smoothed_rms_m, 1, "m"), remark))
    return found


def _outage_told(answer: BestTrajectory) -> OutageRow | None:
    """Return the replayed outage that stands for all: of a minute, or the longest."""
    rows = [one for one in answer.outages if one.count]
    return next((one for one in rows if one.length_s == 60.0), rows[-1] if rows else None)


# -------------------------------------------------------------------------------------------------- what it means


def _doubt(answer: BestTrajectory) -> list[Note]:
    if answer.state == "accepted":
        return []
    if answer.state == "ambiguous":
        text = (
            "Two headings explain this log nearly as well. The other one would turn every place of an antenna, every "
            "velocity along the nose and every heading here: do not use them. Position and velocity hold."
        )
    else:
        text = "Do not build on the sigmas of this chapter: a check of the log itself does not hold."
    return [Note(text, "warn"), *(Note(_sentence(reason), "warn") for reason in answer.reasons)]


def _hypotheses(answer: BestTrajectory) -> Grid | None:
    if answer.state != "ambiguous" or len(answer.hypotheses) < 2:
        return None
    heads = (
        Head("Hypothesis"),
        Head("Heading at the start", True),
        Head("At the end", True),
        Head("Below the best", True),
    )
    rows = [
        (
            "shown here" if place == 0 else "other",
            number(one.start_heading_deg, 1, "°"),
            number(one.end_heading_deg, 1, "°"),
            number(one.below_best, 1),
        )
        for place, one in enumerate(answer.hypotheses)
    ]
    caption = "Below the best: log-likelihood; a difference above 10 would decide."
    return Grid("Hypotheses of the heading", heads, rows, caption)


def _told_of_filter(answer: BestTrajectory) -> list[Note]:
    if answer.state != "accepted" or answer.onboard is None:
        return []
    wrong = _wrong_texts(answer)
    if wrong:
        return [Note(_sentence(text), "warn") for text in wrong]
    return [Note(_sentence(text), "good") for text in _inside_texts(answer)]


def _wrong_texts(answer: BestTrajectory) -> list[str]:
    """Return what the on-board filter got wrong beyond 95 %, the worst of each quantity."""
    rows = () if answer.onboard is None or answer.state != "accepted" else answer.onboard.rows
    told = []
    for row in rows:
        if row.spans:
            more = len(row.spans) - 1
            also = f"; {more} more span{'s' * (more > 1)}" if more else ""
            told.append(error_words(answer, row, row.spans[0]) + also)
    worst = opening_error(answer)
    if worst is not None:
        first = error_words(answer, *worst)
        told = [first, *(text for text in told if text != first and not text.startswith(f"{first};"))]
    return told[:MOST_TOLD]


def _inside_texts(answer: BestTrajectory) -> list[str]:
    """Return that the on-board filter shows no error beyond 95 %, with what is left."""
    if answer.onboard is None or answer.state != "accepted" or any(one.spans for one in answer.onboard.rows):
        return []
    left = [
        f"{one.quantity} {significant(one.rms, 2)} {one.unit}"
        for one in answer.onboard.rows
        if one.quantity in ("heading", "roll", "pitch", "horizontal position")
    ]
    return [f"the on-board filter shows no error beyond 95 %; it differs by {', '.join(left)} (RMS)"]


# --------------------------------------------------------------------------------------------------------- tables


def _accuracy(answer: BestTrajectory) -> Grid | None:
    rows = [
        (
            _capital(one.quantity),
            _with(one.median_within95, one.unit),
            _with(one.median_sigma, one.unit),
            _with(one.worst_sigma, one.unit),
            clock(one.worst_s),
        )
        for one in answer.accuracy
        if not (one.quantity == "heading" and answer.state == "ambiguous")
    ]
    heads = (
        *(Head("Quantity"), Head("95 % within", True), Head("σ, median", True), Head("σ, worst", True)),
        Head("Worst at", True),
    )
    raised = [one for one in answer.raised if one.factor > 1.0]
    caption = "Smoothed. Horizontal: radius, and the root of the sum of both variances."
    if raised:
        factors = ", ".join(f"{one.name} {one.factor:.2f}" for one in raised)
        caption += f" Sigmas are raised as the log's own checks ask for: {factors}."
    return Grid("Accuracy", heads, rows, caption, ("trajectory_track",)) if rows else None


def _onboard(answer: BestTrajectory) -> Grid | None:
    if answer.onboard is None:
        return None
    is_sure = answer.state == "accepted"
    heads = (
        *(Head("Quantity"), Head("Constant, no error of it", True), Head("Cause")),
        *(Head("RMS of the rest", True), Head("σ of the smoothed solution", True), Head("Wrong beyond 95 %")),
    )
    rows = [_onboard_row(answer, one, is_sure=is_sure) for one in answer.onboard.rows]
    caption = "Output minus smoothed solution. What is constant all through the log is mounting, antenna or datum."
    if answer.onboard.delay_s is not None and answer.onboard.delay_sigma_s is not None:
        delay = with_half(answer.onboard.delay_s, 1.96 * answer.onboard.delay_sigma_s, "s")
        caption += f" Its stamps are later than those of the inertial unit by {typeset(delay)}; that is taken off."
    if not is_sure:
        caption += " Spans are not told: the sigmas are not sure enough to blame the filter."
    return Grid(
        f"Errors of the on-board filter ({answer.onboard.topic})", heads, rows, caption, ("trajectory_onboard",)
    )


def _onboard_row(answer: BestTrajectory, row: OnboardError, *, is_sure: bool) -> tuple[Cell, ...]:
    constant = ABSENT
    if row.offset is not None and row.offset_sigma is not None:
        constant = typeset(with_half(row.offset, 1.96 * row.offset_sigma, row.unit))
    wrong: Cell = Mark("good", "nowhere") if is_sure else ABSENT
    if is_sure and row.spans:
        span = row.spans[0]
        more = f" (+{len(row.spans) - 1})" if len(row.spans) > 1 else ""
        text = f"{with_half(span.value, span.half95, row.unit)} {when(answer, span)}{more}"
        wrong = Mark("warn", typeset(text))
    words = typeset(row.offset_words) if row.offset_cause else ""
    cause = f"{row.offset_cause}: {words}" if words and not words.startswith(row.offset_cause) else words
    return _capital(row.quantity), constant, cause, _with(row.rms, row.unit), _with(row.sigma_rms, row.unit), wrong


def _outages(answer: BestTrajectory) -> Grid | None:
    if not answer.outages:
        return None
    heads = (
        *(Head("Without GNSS, s", True), Head("Outages", True), Head("Smoothed, largest inside, RMS", True)),
        *(Head("Forward filter at the end, RMS", True), Head("Inside 95 %", True), Head("RMS error / σ", True)),
        Head("Replayed, s", True),
    )
    rows = [
        (
            number(one.length_s, 0),
            number(one.count, 0),
            _with(one.smoothed_rms_m, "m"),
            _with(one.forward_end_rms_m, "m"),
            percent(one.inside95_share),
            number(one.rms_over_sigma, 2),
            number(one.seconds, 0),
        )
        for one in answer.outages
    ]
    caption = f"GNSS is withheld from this log; truth is the {answer.outage_truth}. Horizontal."
    if answer.outage_truth == "undisturbed solution":
        caption += " It is the same solution with GNSS: what GNSS itself has wrong is in both."
    return Grid("Outages of GNSS, replayed", heads, rows, caption, ("trajectory_outages",))


def _checks(answer: BestTrajectory) -> Grid | None:
    rows: list[tuple[Cell, ...]] = [*map(_innovation, answer.innovations), *map(_held_out, answer.held_out)]
    if answer.own_track is not None:
        own = answer.own_track
        scatter = "" if own.scatter_100_s_deg is None else f"; medians of 100 s {number(own.scatter_100_s_deg, 2, '°')}"
        found = f"MAD {number(own.mad_deg, 2, '°')}{scatter}"
        rows.append(("Heading minus own track, straights", found, ABSENT, number(own.samples, 0), ABSENT))
    heads = (Head("Check"), Head("Found", True), Head("Expected", True), Head("n", True), Head("State"))
    caption = "Held out: every tenth run of GNSS, kept from the solution. Innovations: mean square over expected."
    return Grid("Checks on the log itself", heads, rows, caption, ("trajectory_residuals",)) if rows else None


def _innovation(row: InnovationRow) -> tuple[Cell, ...]:
    mark = Mark("good", "inside") if row.is_inside else Mark("warn", "outside")
    expected = f"1 ({row.low:g} … {row.high:g})"
    return f"Innovations, {row.sensor}", number(row.ratio, 2), expected, number(row.count, 0), mark


def _held_out(row: HeldOutRow) -> tuple[Cell, ...]:
    share = f"{percent(row.inside95_share)} inside 95 %"
    found = f"RMS {_with(row.error_rms, row.unit)}"
    return f"GNSS held out, {row.quantity}", found, _with(row.sigma_rms, row.unit), number(row.count, 0), share


def _parameters(answer: BestTrajectory) -> Grid | None:
    if not answer.parameters:
        return None
    heads = (
        *(Head("Parameter"), Head("Value, ± 95 %", True), Head("σ at first", True)),
        Head("Observable"),
    )
    caption = "Values at the end of the log, in the axes of the body. What is not observable is as it was assumed."
    return Grid("Parameters found", heads, [_parameter(one) for one in answer.parameters], caption)


def _parameter(row: TrajectoryParameter) -> tuple[Cell, ...]:
    mark = Mark("good", "yes") if row.is_observable else Mark("unknown", "no")
    value = _signed(row.value, 1.96 * row.sigma, row.unit)
    return _capital(row.name), value, _with(row.start_sigma, row.unit), mark


def _noise(answer: BestTrajectory) -> Grid | None:
    if not answer.noise:
        return None
    heads = (Head("Noise"), Head("Of its class", True), Head("Fitted", True), Head("Bound"))
    rows: list[tuple[Cell, ...]] = [
        (
            _capital(one.name),
            _with(one.prior, one.unit, 3),
            _with(one.fitted, one.unit, 3),
            Mark("warn", "at its bound") if one.is_at_bound else "",
        )
        for one in answer.noise
    ]
    return Grid("Noise of the model", heads, rows, "Fitted to this log by likelihood, within the bounds of the class.")


def _raised(answer: BestTrajectory) -> Grid | None:
    if not answer.raised:
        return None
    heads = (Head("Sigma"), Head("Raised by", True), Head("Why"))
    rows = [(_capital(one.name), number(one.factor, 2), typeset(one.reason)) for one in answer.raised]
    return Grid("Sigmas raised", heads, rows, "They are never lowered.")


def _separation(answer: BestTrajectory) -> Grid | None:
    if not answer.separation:
        return None
    heads = (Head("Quantity"), Head("RMS", True), Head("Worst", True), Head("At", True))
    rows = [
        (_capital(one.quantity), _with(one.rms, one.unit), _with(one.worst, one.unit), clock(one.worst_s))
        for one in answer.separation
    ]
    return Grid("Forward filter against smoothed solution", heads, rows, "", ("trajectory_separation",))


def _basis(answer: BestTrajectory) -> Facts:
    kind = "increments" if answer.is_integral else "point samples"
    gaps = len(answer.segments) - 1
    pairs = [
        ("Inertial unit", answer.imu, f"{number(answer.imu_rate_hz, 0, 'Hz')}, {kind}"),
        ("GNSS", answer.gnss, ""),
        ("Vehicle", MOTIONS.get(answer.vehicle, "not known"), ""),
        ("Length", clock(answer.length_s), f"{number(len(answer.segments), 0)} segments" if gaps else "one segment"),
        ("In motion", clock(answer.moving_s), ""),
        ("Mounting", _mounting(answer.mounting), SOURCES[answer.mounting.source]),
    ]
    return Facts("What it rests on", pairs)


def _mounting(mounting: UnitMounting) -> str:
    if mounting.source == "case":
        return f"attitude is that of the case{': ' * bool(mounting.words)}{typeset(mounting.words)}"
    angles = ", ".join(
        f"{name} {number(value, 1, '°')}"
        for name, value in (("roll", mounting.roll_deg), ("pitch", mounting.pitch_deg), ("yaw", mounting.yaw_deg))
    )
    sigma = "" if mounting.sigma_deg is None else f" (σ {number(mounting.sigma_deg, 1, '°')})"
    return f"{angles}{sigma}{'; ' * bool(mounting.words)}{typeset(mounting.words)}"


# ---------------------------------------------------------------------------------------------------------- words


def unit_sign_of(unit: str) -> str:
    """Return a unit as a page writes it.

    Examples
    --------
    >>> unit_sign_of("deg"), unit_sign_of("deg/s"), unit_sign_of("m/s")
    ('°', '°/s', 'm/s')
    """
    return unit.replace("deg", "°").replace("sqrt(", "√(")


def _with(value: float | None, unit: str, digits: int = 2) -> str:
    return number_with_unit(significant(value, digits), unit_sign_of(unit))


def _signed(value: float, half: float, unit: str) -> str:
    places = places_of(half)
    return number_with_unit(
        f"{number(value, places)} ± {number(half, places)}", f" {unit_sign_of(unit)}".rstrip()
    ).strip()


def _sentence(text: str) -> str:
    return with_full_stop(typeset(text))


def _headline(text: str) -> str:
    told = typeset(text)
    return told[:1].upper() + told[1:]


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]

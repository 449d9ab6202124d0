"""Chapter on the best trajectory: doubt first, then the on-board filter and the accuracy."""

from groundstation.base.words import capitalised, with_half
from groundstation.chapters.assessed import without_answer
from groundstation.chapters.gates import gate_grid
from groundstation.chapters.parts import Cell, Facts, Figure, Grid, Head, Mark, Note, Part, Section, kept
from groundstation.chapters.wording import (
    ABSENT,
    clock,
    number,
    percent,
    significant,
    typeset,
)
from groundstation.results.flight import FlightResults
from groundstation.systems.trajectory.answer import BestTrajectory, UnitMounting
from groundstation.systems.trajectory.checks_answer import InnovationRow
from groundstation.systems.trajectory.claim_chapter import (
    axes_texts,
    claim_of,
    full_sentence,
    inside_texts,
    unit_sign_of,
    wrong_texts,
)
from groundstation.systems.trajectory.onboard_answer import OnboardError, OnboardErrors
from groundstation.systems.trajectory.parameters_chapter import (
    noise,
    parameters,
    raised,
    separation,
    with_unit,
)
from groundstation.systems.trajectory.quantity_answer import SURE_DEG, UNITS, Quantity
from groundstation.systems.trajectory.wording_answer import (
    sentence_of,
    when,
)

TITLE = "Best trajectory"
LEAD = "Where the vehicle was, how it stood and where it pointed, by all data before and after, and how sure that is."
MOST_HYPOTHESES = 4
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
        *(Note(full_sentence(text), "warn") for text in axes_texts(answer)),
        _accuracy(answer),
        Figure("trajectory.map"),
        Figure("trajectory.onboard_attitude"),
        Figure("trajectory.onboard_motion"),
        _onboard(answer),
        _every_filter(answer),
        _outages(answer),
        Figure("trajectory.outages"),
        _checks(answer),
        _residuals(answer),
        _aids(answer),
        parameters(answer),
    ]
    appendix: list[Part | None] = [
        _basis(answer),
        gate_grid(answer.gates),
        Figure("trajectory.sigmas"),
        Figure("trajectory.separation"),
        separation(answer),
        Figure("trajectory.residuals"),
        Figure("trajectory.biases"),
        Figure("trajectory.attitude"),
        noise(answer),
        raised(answer),
    ]
    headline = typeset(sentence_of(answer))
    return Section("trajectory", TITLE, LEAD, kept(parts), headline, claim=claim_of(answer), appendix=kept(appendix))


# -------------------------------------------------------------------------------------------------- what it means


def _doubt(answer: BestTrajectory) -> list[Note]:
    if answer.state == "accepted":
        return []
    if answer.state == "ambiguous":
        text = (
            "Two headings explain this log nearly as well: use none. The attitude shown here is by the first of them; "
            "position and velocity rest on GNSS."
        )
    else:
        text = "Do not build on the sigmas of this chapter: a check of the log itself does not hold."
    return [Note(text, "warn"), *(Note(full_sentence(reason), "warn") for reason in answer.reasons)]


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
        for place, one in enumerate(answer.hypotheses[:MOST_HYPOTHESES])
    ]
    caption = "Below the best: log-likelihood; a difference above 10 would decide."
    return Grid("Hypotheses of the heading", heads, rows, caption)


def _told_of_filter(answer: BestTrajectory) -> list[Note]:
    if answer.state != "accepted" or answer.onboard is None:
        return []
    wrong = wrong_texts(answer)
    if wrong:
        return [Note(full_sentence(text), "warn") for text in wrong]
    return [Note(full_sentence(text), "good") for text in inside_texts(answer)]


# --------------------------------------------------------------------------------------------------------- tables


def _accuracy(answer: BestTrajectory) -> Grid | None:
    rows = [
        (
            capitalised(one.quantity),
            with_unit(one.median_within95, one.unit),
            with_unit(one.median_sigma, one.unit),
            with_unit(one.worst_sigma, one.unit),
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
    caption += _judged(answer.onboard)
    if not is_sure:
        caption += " Spans are not told: the sigmas are not sure enough to blame the filter."
    if answer.onboard.flew is not None:
        flew = "It flew the vehicle" if answer.onboard.flew else "It did not fly the vehicle"
        caption += f" {flew} ({typeset(answer.onboard.flew_source)})."
    known = next((one.axes_sigma for one in answer.onboard.rows if one.axes_sigma is not None), None)
    if is_sure and known is not None and any(one.changes or one.spans for one in answer.onboard.rows):
        caption += (
            " Where a constant changes, the part is right that agrees with the axes of the filter, which its turning "
            "shows."
        )
    title = f"Errors of the on-board filter ({answer.onboard.title})"
    return Grid(title, heads, rows, caption, ("trajectory_onboard",))


def _judged(of: OnboardErrors) -> str:
    """Return the share of the time in which ours was sure enough to judge an angle."""
    told = [f"{one.quantity} {percent(one.judged_share)}" for one in of.rows if one.judged_share < 0.995]
    return f" Judged only where ours is known to {SURE_DEG:g}° (σ): {', '.join(told)} of the time." if told else ""


def _every_filter(answer: BestTrajectory) -> Grid | None:
    """Return the filters of the log beside each other; None where there is one."""
    if answer.onboard is None or not answer.other_filters:
        return None
    quantities: tuple[Quantity, ...] = (
        *("heading", "roll", "pitch", "horizontal velocity", "vertical velocity"),
        *("horizontal position", "vertical position"),
    )
    every = (answer.onboard, *answer.other_filters)
    known = [one for one in quantities if any(each.row(one) is not None for each in every)]
    heads = (
        Head("Filter"),
        Head("Flew the vehicle"),
        *(Head(f"{capitalised(one)}, {_unit(one)}", True) for one in known),
    )
    heads = (*heads, Head("Wrong beyond 95 %"))
    rows = [
        (
            typeset(one.title),
            {True: "yes", False: "no", None: ABSENT}[one.flew],
            *(_rms(one.row(quantity)) for quantity in known),
            _places_wrong(one) if answer.state == "accepted" else ABSENT,
        )
        for one in every
    ]
    caption = "RMS of output minus smoothed solution, constants taken off. The first one is told above."
    return Grid("All filters of the log", heads, rows, caption)


def _unit(quantity: Quantity) -> str:
    return unit_sign_of(UNITS[quantity])


def _rms(row: OnboardError | None) -> str:
    return ABSENT if row is None else significant(row.rms, 2)


def _places_wrong(of: OnboardErrors) -> str:
    """Return the quantities in which a filter was wrong somewhere, or changed."""
    wrong = [one.quantity for one in of.rows if one.spans or one.changes]
    return ", ".join(wrong) if wrong else "nowhere"


def _onboard_row(answer: BestTrajectory, row: OnboardError, *, is_sure: bool) -> tuple[Cell, ...]:
    constant = ABSENT
    if row.offset is not None and row.offset_sigma is not None:
        constant = typeset(with_half(row.offset, 1.96 * row.offset_sigma, row.unit))
    wrong: Cell = Mark("good", "nowhere") if is_sure else ABSENT
    if is_sure and row.changes:
        wrong = Mark("warn", typeset(row.changed))
    if is_sure and row.spans:
        span = row.spans[0]
        more = f" (+{len(row.spans) - 1})" if len(row.spans) > 1 else ""
        text = f"{with_half(span.value, span.half95, row.unit)} {when(answer, span)}{more}"
        wrong = Mark("warn", typeset(text))
    words = typeset(row.offset_words) if row.offset_cause else ""
    cause = f"{row.offset_cause}: {words}" if words and not words.startswith(row.offset_cause) else words
    return (
        capitalised(row.quantity),
        constant,
        cause,
        with_unit(row.rms, row.unit),
        with_unit(row.sigma_rms, row.unit),
        wrong,
    )


def _outages(answer: BestTrajectory) -> Grid | None:
    if not answer.outages:
        return None
    heads = (
        *(Head("Without GNSS, s", True), Head("Outages", True), Head("Smoothed, largest inside, RMS", True)),
        *(Head("Forward filter at the end, RMS", True), Head("Inside 95 %", True), Head("RMS error / σ", True)),
        *(Head("Height, largest inside, RMS", True), Head("Inside 95 %", True)),
    )
    rows = [
        (
            number(one.length_s, 0),
            number(one.count, 0),
            _rms_and_worst(one.smoothed_rms_m, one.smoothed_worst_m),
            _rms_and_worst(one.forward_end_rms_m, one.forward_end_worst_m),
            percent(one.inside95_share),
            number(one.rms_over_sigma, 2),
            with_unit(one.vertical_rms_m, "m"),
            ABSENT if one.vertical_inside95_share is None else percent(one.vertical_inside95_share),
        )
        for one in answer.outages
    ]
    caption = (
        "GNSS is withheld from this log. Errors are those against the solution with GNSS, horizontal but for the "
        "height. Smoothed: in post-processing, by the data before and behind. Forward filter: live, by the data before "
        "alone. Other columns are of the smoothed solution."
    )
    caption += _left_out(answer)
    if answer.outage_truth == "RTK":
        caption += " Its GNSS is RTK."
    else:
        caption += " What GNSS itself has wrong is in both."
    return Grid("Outages of GNSS, replayed", heads, rows, caption, ("trajectory_outages",))


def _left_out(answer: BestTrajectory) -> str:
    """Return how many outages were tried and not replayed, and why."""
    counts = (
        (sum(one.standing_count for one in answer.outages), "the vehicle stood"),
        (sum(one.without_gnss_count for one in answer.outages), "GNSS is not there"),
    )
    told = [f"{count} where {why}" for count, why in counts if count]
    return f" Left out: {', '.join(told)}." if told else ""


def _rms_and_worst(rms_m: float | None, worst_m: float | None) -> str:
    worst = "" if worst_m is None else f", worst {with_unit(worst_m, 'm')}"
    return f"{with_unit(rms_m, 'm')}{worst}"


def _checks(answer: BestTrajectory) -> Grid | None:
    rows: list[tuple[Cell, ...]] = [*map(_innovation, answer.innovations)]
    heads = (Head("Check"), Head("Found", True), Head("Expected", True), Head("n", True), Head("State"))
    caption = "Innovations: mean square over expected."
    if answer.own_track is not None:
        own = answer.own_track
        scatter = (
            "" if own.scatter_100_s_deg is None else f", of medians of 100 s {number(own.scatter_100_s_deg, 2, '°')}"
        )
        mad = number(own.mad_deg, 2, "°")
        caption += f" Heading minus own track on straights scatters by {mad} (median absolute){scatter}."
    return Grid("Checks on the log itself", heads, rows, caption) if rows else None


def _aids(answer: BestTrajectory) -> Grid | None:
    if not answer.aids:
        return None
    rows: list[tuple[Cell, ...]] = [
        (
            capitalised(one.name),
            one.topic or ABSENT,
            Mark("good", "yes") if one.is_used else Mark("warn" if one.is_wrong else "unknown", "no"),
            typeset(one.reason),
        )
        for one in answer.aids
    ]
    heads = (Head("Aid"), Head("Topic"), Head("Used"), Head("With what, or why not"))
    return Grid("Aids beside GNSS", heads, rows, "An aid that does not fit is left out: the answer is that without it.")


def _innovation(row: InnovationRow) -> tuple[Cell, ...]:
    mark = Mark("good", "inside") if row.is_inside else Mark("warn", "outside")
    expected = f"1 ({row.low:g} … {row.high:g})"
    return f"Innovations, {row.sensor}", number(row.ratio, 2), expected, number(row.count, 0), mark


def _residuals(answer: BestTrajectory) -> Grid | None:
    """Return GNSS held out of the solution beside the GNSS that it used."""
    heads = (
        *(Head("GNSS minus solution"), Head("Used, RMS", True), Head("n", True), Head("Held out, RMS", True)),
        *(Head("Expected of it", True), Head("n", True), Head("Inside 95 %", True)),
    )
    rows: list[tuple[Cell, ...]] = [
        (
            capitalised(one.quantity),
            with_unit(one.used_rms, one.unit),
            number(one.used_count, 0),
            with_unit(one.error_rms, one.unit),
            with_unit(one.sigma_rms, one.unit),
            number(one.count, 0),
            percent(one.inside95_share),
        )
        for one in answer.held_out
    ]
    caption = "Held out: ten seconds of every hundred, against a solution without them. n: values, each axis by itself."
    return Grid("GNSS used and held out", heads, rows, caption, ("trajectory_residuals",)) if rows else None


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

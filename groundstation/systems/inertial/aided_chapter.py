"""Chapter on an INS that GNSS corrects, or may correct.

INS - GNSS, the innovations that its own filter logged, and its errors where an answer with its own states knows them.
"""

from groundstation.base.words import capitalised
from groundstation.chapters.parts import Claim, Facts, Figure, Grid, Head, Mark, Note, Part, Rank, Section, kept
from groundstation.chapters.wording import ABSENT, any_value, clock, number, percent, significant, typeset, unit_sign
from groundstation.results.answer import Answers
from groundstation.systems.inertial.answer import Departure, Difference, InertialResult, OwnInnovation
from groundstation.systems.inertial.judged_answer import JudgedFilter, judged_filter

OF_EPOCHS = "95 % of the epochs"
TITLE = "INS against GNSS"
HEADLINES = {"gnss_aided": "GNSS corrects this INS", "unknown": "It is not known whether GNSS corrects this INS"}
LEAD = "INS − GNSS shows how closely this INS follows its receiver, not how good either of them is."
PLACES = {"m": 2, "mps": 3}


def aided(answer: InertialResult, answers: Answers) -> Section:
    """Return the chapter of an INS that GNSS corrects, or may correct."""
    judged = judged_filter(answers, answer.ins_topic)
    position = answer.difference("position")
    is_known = answer.kind == "gnss_aided"
    within = f": within {number(position.p95, 1, 'm')} of it (95 %)" if position is not None and is_known else ""
    parts: tuple[Part | None, ...] = (
        _departures(answer),
        _errors(judged),
        _why(answer, is_judged=judged is not None),
        _differences(answer.differences),
        Figure("inertial.differences", of="position"),
        Figure("inertial.differences", of="velocity"),
        _innovations(answer),
        Figure("inertial.own_innovations"),
    )
    left = answer.worst_departure
    headline = f"{HEADLINES[answer.kind]}{within}" if left is None else _left(answer, left)
    if judged is not None:
        headline = f"{headline}; {typeset(judged.sentence)}"
    claim = _claim(answer, headline, judged)
    return Section("inertial", TITLE, LEAD, kept(parts), headline, claim=claim, appendix=(_pair(answer),))


def _claim(answer: InertialResult, headline: str, judged: JudgedFilter | None) -> Claim:
    rows = [row for row in (answer.difference("position"), answer.difference("velocity")) if row is not None]
    figures = tuple(
        (
            f"INS − GNSS, {row.quantity}",
            number(row.p95, PLACES.get(row.unit, 3) - 1, unit_sign(row.unit)),
            OF_EPOCHS,
        )
        for row in rows
    )
    reason = typeset(answer.kind_reason).strip().rstrip(".")
    sentences = (f"{capitalised(reason)}.",) if reason else ()
    value = figures[0][1] if figures else ""
    unseen = "its own drift cannot be seen" if judged is None else f"its errors are judged {judged.by}"
    remark = f"INS − GNSS, {OF_EPOCHS}; {unseen}" if figures else unseen
    left = answer.worst_departure
    if left is not None:
        return _claim_on(answer, left, headline)
    if judged is not None:
        word = "Measured" if judged.worst is None else "Filter wrong"
        mark = Mark("good" if judged.worst is None else "warn", word)
        return Claim(Rank.INERTIAL_OPEN, mark, headline, value, remark, sentences, (*figures, *_sizes_told(judged)))
    word = "Aided" if answer.kind == "gnss_aided" else "Undecided"
    return Claim(Rank.INERTIAL_OPEN, Mark("unknown", word), headline, value, remark, sentences, figures)


def _claim_on(answer: InertialResult, left: Departure, headline: str) -> Claim:
    """Return the claim of an INS that left GNSS: red where it flew the aircraft, or may have."""
    flew = answer.filter_of_ins.use.removeprefix("; ")
    gate = f"It rejected GNSS in {percent(left.share_rejected, 0)} of the time." if left.share_rejected else ""
    sentences = (f"{flew[:1].upper()}{typeset(flew[1:])}." if flew else "", gate)
    usual = answer.difference("position")
    length = f"for {clock(left.end_s - left.start_s)} min:s from {clock(left.start_s)}"
    figures = (
        ("Apart at most", number(left.largest_m, 0, "m"), length),
        ("Velocity, at most", number(left.largest_mps, 1, "m/s"), "INS − GNSS"),
        ("Usually apart", "" if usual is None else number(usual.median, 1, "m"), "INS − GNSS, median over the log"),
    )
    return Claim(
        Rank.INERTIAL_OPEN,
        Mark("warn" if answer.filter_of_ins.flew is False else "bad", "Left GNSS"),
        headline,
        number(left.largest_m, 0, "m"),
        f"INS − GNSS at most, {length}",
        tuple(filter(None, sentences)),
        tuple(one for one in figures if one[1] not in ("", ABSENT)),
        is_danger=True,
    )


def _left(answer: InertialResult, left: Departure) -> str:
    """Return the headline on the worst departure."""
    span = f"{clock(left.start_s)} to {clock(left.end_s)}"
    not_flown = " (it did not fly the aircraft)" if answer.filter_of_ins.flew is False else ""
    return f"{answer.filter_of_ins.title} and GNSS {left.apart}apart, {span}{not_flown}"


def _departures(answer: InertialResult) -> Grid | None:
    """Return the spans in which filter and GNSS were far apart."""
    if not answer.departures:
        return None
    heads = (
        *(Head("From", True), Head("To", True), Head("Position, m", True), Head("Velocity, m/s", True)),
        *(Head("Beyond its gate", True), Head("")),
    )
    rows = [
        (
            *(clock(one.start_s), clock(one.end_s), number(one.largest_m, 1), number(one.largest_mps, 1)),
            ABSENT if one.share_rejected is None else percent(one.share_rejected, 0),
            "the filter had just begun" if one.at_start else Mark("warn", "left GNSS"),
        )
        for one in answer.departures
    ]
    caption = (
        "Spans of at least 5 s in which INS and GNSS were further apart than ten times their median, 10 m or 3 m/s, "
        "or the filter rejected GNSS. Largest horizontal differences. Which of the two was wrong they do not tell."
    )
    return Grid("Departures from GNSS", heads, rows, caption)


def _sizes_told(judged: JudgedFilter) -> tuple[tuple[str, str, str], ...]:
    """Return its errors as figures: root mean square, and the sigma of what judges them."""
    return tuple(
        (
            f"Error, {row.quantity}",
            f"{significant(row.rms, 2)} {unit_sign(row.unit)}",
            f"RMS; σ {significant(row.sigma_rms, 2)}",
        )
        for row in judged.rows
        if row.quantity in ("heading", "horizontal position")
    )


def _errors(judged: JudgedFilter | None) -> Note | None:
    """Return its errors in a sentence.

    The chapter of what judges it has them along the flight.
    """
    if judged is None:
        return None
    constant = f" Constant, and no error of the filter: {'; '.join(judged.constants)}." if judged.constants else ""
    wrong = f"Worst: {judged.wrong}. " if judged.worst else ""
    wrong += "".join(f"{capitalised(one)}. " for one in judged.changes)
    along = "The chapter of what judges it has them along the flight."
    text = f"{wrong}Errors of the INS, judged {judged.by}: {judged.errors}.{constant} {along}"
    return Note(typeset(text), "good" if judged.worst is None and not judged.changes else "warn")


def _why(answer: InertialResult, *, is_judged: bool) -> Note:
    reason = typeset(answer.kind_reason).strip().rstrip(".")
    unseen = "Errors that GNSS removes cannot be seen against GNSS, so nothing is estimated, corrected or forecast."
    if is_judged:
        unseen = "Errors that GNSS removes cannot be seen against GNSS: from these differences nothing is estimated."
    if answer.kind == "gnss_aided":
        return Note(f"GNSS corrects this INS already: {reason}. {unseen}")
    text = f"{HEADLINES[answer.kind]}: {reason}. {unseen} To decide it, state ins_kind in the aircraft file."
    return Note(text, "unknown")


def _differences(rows: tuple[Difference, ...]) -> Grid | None:
    heads = (Head("INS − GNSS"), *(Head(title, True) for title in ("Mean", "Median", "95 %", "Largest", "Epochs")))
    caption = "Mean with its sign; median, 95 % and largest of the magnitude, epoch by epoch."
    cells = [(_title(row), *_sizes(row), _of(row, row.largest), number(row.samples, 0)) for row in rows]
    return Grid("INS − GNSS", heads, cells, caption, ("inertial_differences",)) if cells else None


def _innovations(answer: InertialResult) -> Grid | None:
    rows = answer.own_innovations
    titles = ["Mean", "Median", "95 %"]
    has_sigma = any(row.sigma is not None for row in rows)
    has_gate = any(row.share_rejected is not None for row in rows)
    titles += ["Its σ", "Inside ± 1.96 σ"] if has_sigma else []
    titles += ["Beyond its gate"] if has_gate else []
    cells = []
    for row in rows:
        judged = [_of(row, row.sigma), percent(row.share_inside95, 1)] if has_sigma else []
        judged += [percent(row.share_rejected, 1)] if has_gate else []
        cells.append((_title(row), *_sizes(row), *judged, number(row.samples, 0)))
    heads = (Head("Innovation"), *(Head(title, True) for title in (*titles, "Samples")))
    caption = (
        f"GNSS − what the INS's own filter predicted, from topic {answer.own_filter}. A mean far from zero, or many "
        "samples beyond the gate, show that the filter and its receiver disagree."
    )
    return Grid("Innovations of the INS's own filter", heads, cells, caption) if cells else None


def _title(row: Difference | OwnInnovation) -> str:
    return f"{row.quantity.capitalize()} {row.axis}, {unit_sign(row.unit)}"


def _sizes(row: Difference | OwnInnovation) -> tuple[str, str, str]:
    mean = ABSENT if row.axis == "horizontal" else number(row.mean, PLACES.get(row.unit, 3), signed=True)
    return mean, _of(row, row.median), _of(row, row.p95)


def _of(row: Difference | OwnInnovation, value: float | None) -> str:
    return number(value, PLACES.get(row.unit, 3))


def _pair(answer: InertialResult) -> Facts:
    others = f"not used: {any_value(answer.other_ins)}" if answer.other_ins else ""
    pairs = (
        ("Pair used", f"{answer.ins_topic} against {answer.gnss_topic}", others),
        ("Epochs compared", number(answer.epochs, 0), f"{clock(answer.gnss_seconds)} of the flight with GNSS"),
    )
    return Facts("What was compared", pairs)

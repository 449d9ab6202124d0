"""An acceptance as chapters: limits, INS, flights, configuration, signatures; in the order of its standard's layout."""

from collections.abc import Callable, Sequence

from groundstation.base.timescales import utc_ns_to_iso
from groundstation.chapters.parts import (
    Cell,
    Facts,
    Figure,
    Front,
    Grid,
    Head,
    Mark,
    Note,
    Part,
    Section,
    Signatures,
    kept,
)
from groundstation.chapters.wording import ABSENT, clean, number, number_with_unit, percent, sentence, significant
from groundstation.results.acceptance import (
    ENSEMBLE,
    QUANTITIES,
    Acceptance,
    Bound,
    Decision,
    FlightError,
    InsRow,
    Judgement,
    Limit,
)

MARKS: dict[Decision, Mark] = {
    "pass": Mark("good", "Pass"),
    "fail": Mark("bad", "Fail"),
    "not enough flights": Mark("warn", "Not enough flights"),
    "not flown": Mark("unknown", "Not flown"),
    "no limit": Mark("unknown", "No limit"),
}
CLAIMS = {
    "type": "The claim is on all INS of the kind flown. Flights of one INS are alike: they count by their correlation.",
    "units": "The claim is on all INS of the kind flown. Every INS counts once, however often it flew.",
    "these": "The claim is on the INS flown alone. Each of their flights counts.",
}
ROLES = ("Prepared", "Checked", "Approved")
NOT_MEASURED = "Acceleration, roll, pitch and attitude rate are not judged: nothing in the logs is a reference of them."
ALL = "All"
LONGEST = 32


def front(found: Acceptance) -> Front:
    """What stands on top: the decision, what it rests on, key figures."""
    whole, included = _whole(found), found.included
    aircraft = sorted({flight.aircraft for flight in included if flight.aircraft})
    pairs: tuple[tuple[str, Cell], ...] = (
        ("Flights", f"{number(len(included), 0)} of {number(len(found.flights), 0)}"),
        ("INS", number(len({flight.ins for flight in included}), 0)),
        ("Aircraft", clean(", ".join(aircraft[:4]) + (" …" if len(aircraft) > 4 else "")) or ABSENT),
        ("Hours", number(whole.hours if whole else 0.0, 1)),
        ("Span, UTC", _span(included)),
        ("Standard", f"{found.name}, SHA-256 {found.standard_sha256[:16]}"),
        ("groundstation", found.version),
    )
    judged = [one for one in found.judgements if one.ins == ENSEMBLE]
    told = [_told(found, one) for one in judged]
    return Front(
        found.standard.title,
        pairs,
        verdict=MARKS[found.decision],
        headline=_headline(found),
        sentences=told or ("The standard states no limit: errors are told, nothing is judged.",),
        figures=_figures(found, whole),
    )


def sections(found: Acceptance) -> tuple[Section, ...]:
    """The chapters in the order of the standard's layout, those without parts left out."""
    build = LAYOUTS[found.standard.layout]
    return tuple(section for section in build(found) if section.parts)


def _acceptance(found: Acceptance) -> tuple[Section, ...]:
    lead = "Is the share of flights that the standard asks for within its limits, and how sure is that?"
    return (
        Section("limits", "Limits", lead, kept((_standard(found), _limits(found), *_notes(found)))),
        Section("ins", "By INS", "What each INS shows, and what all show together.", _by_ins(found)),
        Section("errors", "Errors against time", "Radial error, INS minus reference.", _drawings(found)),
        Section("flights", "Flights", "", kept((_included(found), _excluded(found)))),
        Section("configuration", "Configuration", "What the figures were found with.", _configuration(found)),
        Section("signatures", "Signatures", "", (Signatures(ROLES),)),
    )


def _irig261(found: Acceptance) -> tuple[Section, ...]:
    left_out = len(found.flights) - len(found.included)
    functional = (
        f"{number(len(found.included), 0)} flights gave errors of a free INS, {number(left_out, 0)} did not: the table "
        "of flights left out has the reasons."
    )
    judged = kept((_limits(found), *_notes(found)))
    conclusions = (Note(_headline(found) + ".", MARKS[found.decision].tone), *judged)
    return (
        Section("introduction", "Introduction", "", (_standard(found),)),
        Section("article", "Test article description", "", (_articles(found),)),
        Section("objective", "Test objective", "", (Note(_objective(found)),)),
        Section(
            "description", "Test description", "", kept((_included(found), _excluded(found), *_configuration(found)))
        ),
        Section("functional", "System functional results summary", "", (Note(functional),)),
        Section("position", "Position accuracy summary", "", (_rates(found), *_drawings(found))),
        Section("velocity", "Velocity and attitude accuracy summary", "", (_others(found), Note(NOT_MEASURED))),
        Section("conclusions", "Conclusions", "", kept((*conclusions, _limits_by_ins(found)))),
        Section("references", "References", "", (Note(clean(found.standard.source)),)),
        Section("signatures", "Signatures", "", (Signatures(ROLES),)),
    )


LAYOUTS: dict[str, Callable[[Acceptance], tuple[Section, ...]]] = {"acceptance": _acceptance, "irig261": _irig261}


# ------------------------------------------------------------------------------------------------------ the decision


def _headline(found: Acceptance) -> str:
    if not found.included:
        return "No flight can be judged"
    judged = [one for one in found.judgements if one.ins == ENSEMBLE and one.decision != "not flown"]
    if not judged:
        return "Nothing is judged"
    worst = next(one for one in judged if one.decision == found.decision)
    limit, sure = found.limit(worst.limit), percent(found.standard.confidence)
    if worst.decision == "pass":
        return f"{percent(limit.share)} of flights within the limits: shown at {sure} confidence"
    if worst.decision == "fail":
        return f"{clean(limit.title)}: fewer than {percent(limit.share)} of flights within, at {sure} confidence"
    return f"{clean(limit.title)}: {number(worst.more_with_none_over, 0)} more flights needed, none over"


def _told(found: Acceptance, one: Judgement) -> str:
    limit = found.limit(one.limit)
    if one.decision == "not flown":
        return f"{clean(limit.title)}: none flown, nothing is said of them."
    flown = f"{number(one.over, 0)} of {number(one.flights, 0)} flights of {number(one.ins_units, 0)} INS over"
    worth = f" (worth {number(one.effective_flights, 1)} independent flights)" if _is_worth_less(one) else ""
    told = (
        f"{clean(limit.title)}: {flown}, wanted {wanted(limit)} on {percent(limit.share)}. At "
        f"{percent(found.standard.confidence)} confidence at least {percent(one.share_low, 1)} are within{worth}."
    )
    return f"{told} {_missing(one)}".strip()


def _is_worth_less(one: Judgement) -> bool:
    return one.effective_flights < one.flights - 0.05


def _missing(one: Judgement) -> str:
    if one.decision != "not enough flights":
        return ""
    more = f"Missing: {number(one.more_with_none_over, 0)} more independent flights with none over"
    if not one.over:
        return f"{more}."
    at_share = (
        "at the present share none would do"
        if one.more_at_present_share is None
        else f"{number(one.more_at_present_share, 0)} at the present share"
    )
    return f"{more}, {at_share}."


def wanted(limit: Limit) -> str:
    """The bounds of a limit in words.

    Examples
    --------
    >>> wanted(Limit("a", "", (Bound("radial_rate_fit_nmiph", 2.0),)))
    'radial error rate, time-position fit ≤ 2\u202fnmi/h'
    """
    return " and ".join(f"{QUANTITIES[one.quantity].title} ≤ {_of_bound(one, one.at_most)}" for one in limit.bounds)


def _of_bound(bound: Bound, value: float) -> str:
    return number_with_unit(significant(value, 3), QUANTITIES[bound.quantity].unit)


def _limit_bound(limit: Limit, one: Judgement) -> str:
    """What the share stays below, in the unit of the limit where it has one bound."""
    if one.bound95 is None:
        return ABSENT
    if len(limit.bounds) == 1:
        return _of_bound(limit.bounds[0], one.bound95 * limit.bounds[0].at_most)
    return f"{significant(one.bound95, 3)} of the limit"


def _figures(found: Acceptance, whole: InsRow | None) -> tuple[tuple[str, str, str], ...]:
    if whole is None or not whole.flights:
        return ()
    heading = f"95 % over {number(whole.heading_flights, 0)} flights"
    return (
        ("CEP50", number(whole.cep50_rate_nmiph, 2, "nmi/h"), "half of the flights, time-position fit"),
        ("R95", number(whole.r95_rate_nmiph, 2, "nmi/h"), "95 % of the flights, time-position fit"),
        ("Velocity error", number(whole.velocity_rms_mps, 2, "m/s"), "root mean square"),
        ("Heading error", number(whole.heading95_deg, 2, "°"), heading),
    )


# -------------------------------------------------------------------------------------------------------- its tables


def _standard(found: Acceptance) -> Part:
    standard = found.standard
    pairs = [
        ("Standard", clean(standard.title), ""),
        ("Source", clean(standard.source), ""),
        ("How far it was read", clean(standard.read), ""),
        ("Claim", CLAIMS[standard.claim], ""),
        (
            "Confidence",
            percent(standard.confidence),
            "one-sided, exact binomial limits of effective numbers of flights",
        ),
    ]
    return Facts("What is judged", [pair for pair in pairs if pair[1]])


def _objective(found: Acceptance) -> str:
    told = [
        f"{clean(limit.title)}: {wanted(limit)} on {percent(limit.share)} of flights" for limit in found.standard.limits
    ]
    return f"{'; '.join(told)}." if told else "Errors of the INS against GNSS are reported; no limit is set."


LIMIT_HEADS = (
    *(Head("Limit"), Head("Flights", True), Head("Over", True), Head("INS", True), Head("Worth", True)),
    *(Head("Within, at least", True), Head("95 % stay below", True), Head("Reference ratio", True)),
    *(Head("More flights", True), Head("Verdict")),
)


def _limits(found: Acceptance) -> Grid | None:
    rows = []
    for one in found.judgements:
        if one.ins == ENSEMBLE:
            limit = found.limit(one.limit)
            place = f" ({clean(limit.paragraph)})" if limit.paragraph else ""
            rows.append((f"{clean(limit.title)}{place}", *_judged(limit, one)))
    caption = (
        "Worth: independent flights that they count as. Within, at least: lower limit of the share of flights within. "
        "95 % stay below: an order statistic, the largest flight but so many as may be over. Reference ratio: limit "
        "over the error of the reference, both 95 %, the smallest of the flights. More flights: independent ones, none "
        "over; in brackets at the present share."
    )
    return Grid("All flights", LIMIT_HEADS, rows, caption) if rows else None


def _judged(limit: Limit, one: Judgement) -> tuple[Cell, ...]:
    more = number(one.more_with_none_over, 0)
    if one.over and one.more_with_none_over:
        more += f" ({'never' if one.more_at_present_share is None else number(one.more_at_present_share, 0)})"
    return (
        *(number(count, 0) for count in (one.flights, one.over, one.ins_units)),
        number(one.effective_flights, 1),
        percent(one.share_low, 1) if one.flights else ABSENT,
        _limit_bound(limit, one),
        number(one.accuracy_ratio, 0),
        ABSENT if one.decision == "not flown" else more,
        MARKS[one.decision],
    )


def _notes(found: Acceptance) -> tuple[Part, ...]:
    notes = [Note(f"{clean(limit.title)}: {sentence(limit.note)}") for limit in found.standard.limits if limit.note]
    for one in found.judgements:
        if one.ins == ENSEMBLE and one.flights and _is_worth_less(one):
            told = (
                f"{clean(found.limit(one.limit).title)}: {number(one.flights, 0)} flights of "
                f"{number(one.ins_units, 0)} INS count as {number(one.effective_flights, 1)}: the correlation within "
                f"an INS is taken as {number(one.correlation, 2)}. Of these INS alone, every flight counted, at least "
                f"{percent(one.share_low_these, 1)} of flights are within."
            )
            notes.append(Note(told, "unknown"))
    return tuple(notes)


def _by_ins(found: Acceptance) -> tuple[Part, ...]:
    return kept((_rates(found), _others(found), _limits_by_ins(found)))


def _name(row: InsRow) -> str:
    return ALL if row.ins == ENSEMBLE else clean(row.ins)[:LONGEST]


def _articles(found: Acceptance) -> Grid:
    heads = (Head("INS"), Head("Aircraft"), Head("Alignment"), Head("Flights", True), Head("Hours", True))
    rows = [
        (_name(row), clean(row.aircraft) or ABSENT, clean(row.alignment), number(row.flights, 0), number(row.hours, 1))
        for row in found.rows
        if row.ins != ENSEMBLE
    ]
    return Grid("INS flown", heads, rows)


def _rates(found: Acceptance) -> Grid:
    heads = (
        *(Head("INS"), Head("Flights", True), Head("Hours", True), Head("Median", True), Head("Largest", True)),
        *(
            Head("CEP50", True),
            Head("R95", True),
            Head("2drms", True),
            Head("Along 95 %", True),
            Head("Across 95 %", True),
        ),
    )
    rows = [
        (
            *(_name(row), number(row.flights, 0), number(row.hours, 1)),
            *(number(value, 2) for value in (row.fit_median_nmiph, row.fit_largest_nmiph)),
            *(number(value, 2) for value in (row.cep50_rate_nmiph, row.r95_rate_nmiph, row.two_drms_rate_nmiph)),
            *(number(value, 2) for value in (row.along95_nmi, row.cross95_nmi)),
        )
        for row in found.rows
    ]
    caption = (
        "Median, largest: radial error rate of a flight, nmi/h, the slope through the origin of its error over time. "
        "CEP50, R95, 2drms: the same slope of what half and 95 % of the flights stay within at a time, and of twice "
        "their root mean square; three flights at least. Along, across: 95 % of the flights' largest errors, nmi."
    )
    return Grid("Position", heads, rows, caption)


def _others(found: Acceptance) -> Grid:
    heads = (
        *(Head("INS"), Head("Aircraft"), Head("Alignment"), Head("Velocity RMS, m/s", True)),
        *(Head("Flights with heading", True), Head("Heading 95 %, °", True), Head("Heading largest, °", True)),
    )
    rows = [
        (
            *(_name(row), clean(row.aircraft) if row.ins != ENSEMBLE else "", clean(row.alignment) or ABSENT),
            number(row.velocity_rms_mps, 2),
            number(row.heading_flights, 0),
            *(number(value, 2) for value in (row.heading95_deg, row.heading_largest_deg)),
        )
        for row in found.rows
    ]
    caption = (
        "Velocity: INS minus GNSS over all epochs. Heading: magnitude of the error on taxi, rejected ones left out."
    )
    return Grid("Velocity, heading, alignment", heads, rows, caption)


def _limits_by_ins(found: Acceptance) -> Grid | None:
    rows = []
    for one in found.judgements:
        if one.ins != ENSEMBLE:
            limit = found.limit(one.limit)
            rows.append((f"{clean(one.ins)[:LONGEST]}: {clean(limit.title)}", *_judged(limit, one)))
    caption = "Each INS for itself, its flights taken as independent."
    return Grid("Limits by INS", (Head("INS: limit"), *LIMIT_HEADS[1:]), rows, caption) if rows else None


def _drawings(found: Acceptance) -> tuple[Part, ...]:
    return (Figure("acceptance.growth"), Figure("acceptance.rates")) if found.included else ()


def _included(found: Acceptance) -> Grid | None:
    heads = (
        *(Head("Flight"), Head("INS"), Head("Log"), Head("SHA-256"), Head("Hours", True)),
        *(Head("Rate, nmi/h", True), Head("At the end, nmi/h", True), Head("Largest, nmi", True)),
        *(Head("Velocity, m/s", True), Head("Heading, °", True)),
    )
    rows = [
        (
            *(flight.flight_id, clean(flight.ins)[:LONGEST], clean(flight.source), flight.sha256[:12]),
            number(flight.hours, 2),
            *(
                number(flight.values.get(name), 2)
                for name in ("radial_rate_fit_nmiph", "radial_rate_final_nmiph", "radial_largest_nmi")
            ),
            number(flight.values.get("velocity_error_rms_mps"), 2),
            number(flight.values.get("heading_error_deg"), 2, signed=True),
        )
        for flight in found.included
    ]
    return Grid("Flights that count", heads, rows, "Rate: time-position fit.") if rows else None


def _excluded(found: Acceptance) -> Grid | None:
    heads = (Head("Flight"), Head("INS"), Head("Log"), Head("Why it does not count"))
    rows = [
        (flight.flight_id, clean(flight.ins)[:LONGEST], clean(flight.source), clean(flight.reason))
        for flight in found.flights
        if not flight.is_included
    ]
    return Grid("Flights left out", heads, rows) if rows else None


def _configuration(found: Acceptance) -> tuple[Part, ...]:
    versions = ", ".join(sorted({flight.made_by for flight in found.included if flight.made_by}))
    pairs = [
        ("Report made by", f"groundstation {found.version}", ""),
        ("Flights analysed by", f"groundstation {versions}" if versions else ABSENT, ""),
        ("Standard", found.name, f"SHA-256 {found.standard_sha256}"),
        ("Shortest flight that counts", number(found.standard.minutes_min, 0, "min"), "of navigation compared"),
        ("Accuracy ratio wanted", number(found.standard.accuracy_ratio_min, 1), "limit over error of the reference"),
    ]
    settings = [(name, clean(", ".join(values)), "") for name, values in found.settings.items()]
    caption = "Settings of the INS analysis in force; several values where flights differ."
    return kept((Facts("Versions", pairs), Facts("Settings", settings, caption, compact=True) if settings else None))


# ------------------------------------------------------------------------------------------------------------- words


def _whole(found: Acceptance) -> InsRow | None:
    return next((row for row in found.rows if row.ins == ENSEMBLE), None)


def _span(flights: Sequence[FlightError]) -> str:
    known = [flight.start_utc_ns for flight in flights if flight.start_utc_ns is not None]
    if not known:
        return ABSENT
    first, last = (utc_ns_to_iso(time)[:10] for time in (min(known), max(known)))
    return first if first == last else f"{first} … {last}"

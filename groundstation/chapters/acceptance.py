"""Chapters of an acceptance, in the order that its standard lays down.

Limits, INS, flights, configuration, signatures.
"""

from collections.abc import Callable

from groundstation.chapters.acceptance_front import MARKS, at_least, bound_text, headline, is_worth_less, stated, wanted
from groundstation.chapters.parts import Cell, Facts, Figure, Grid, Head, Note, Part, Section, Signatures, kept
from groundstation.chapters.wording import ABSENT, clean, number, plural, sentence
from groundstation.results.acceptance import ENSEMBLE, Acceptance, AcceptanceLimit, InsRow, Judgement

CLAIMS = {
    "type": (
        "The claim is on all INS of the kind flown. Flights of one INS are correlated: they count as fewer "
        "independent flights."
    ),
    "units": "The claim is on all INS of the kind flown. Each INS counts at most once, however often it flew.",
    "these": "The claim is on the INS flown alone. Each of their flights counts; as many are needed as for a kind.",
}
ROLES = ("Prepared", "Checked", "Approved")
NOT_MEASURED = "Acceleration, roll, pitch and attitude rate are not judged: the logs hold no reference for them."
ALL = "All"
LONGEST = 32


def sections(found: Acceptance) -> tuple[Section, ...]:
    """Return the chapters in the order of the standard's layout, those without parts left out."""
    build = LAYOUTS[found.standard.layout]
    return tuple(section for section in build(found) if section.parts)


def _acceptance(found: Acceptance) -> tuple[Section, ...]:
    lead = "Does the share of flights that the standard requires stay within its limits, and with what confidence?"
    return (
        Section("limits", "Limits", lead, kept((_standard(found), _limits(found), *_notes(found)))),
        Section("ins", "By INS", "Results of each INS, and of all together.", _by_ins(found)),
        Section("errors", "Errors against time", "Radial error, INS minus reference.", _drawings(found)),
        Section("flights", "Flights", "", kept((_included(found), _excluded(found)))),
        Section("configuration", "Configuration", "Versions and settings behind the figures.", _configuration(found)),
        Section("signatures", "Signatures", "", (Signatures(ROLES),)),
    )


def _irig261(found: Acceptance) -> tuple[Section, ...]:
    left_out = len(found.flights) - len(found.included)
    functional = f"{plural(len(found.included), 'flight')} gave errors of a free INS"
    if left_out:
        functional += f", {number(left_out, 0)} did not (reasons: table of flights left out)"
    judged = kept((_limits(found), *_notes(found)))
    conclusions = (Note(headline(found) + ".", MARKS[found.decision].tone), *judged)
    return (
        Section("introduction", "Introduction", "", (_standard(found),)),
        Section("article", "Test article description", "", (_articles(found),)),
        Section("objective", "Test objective", "", (Note(_objective(found)),)),
        Section(
            "description", "Test description", "", kept((_included(found), _excluded(found), *_configuration(found)))
        ),
        Section("functional", "System functional results summary", "", (Note(f"{functional}."),)),
        Section("position", "Position accuracy summary", "", (_rates(found), *_drawings(found))),
        Section("velocity", "Velocity and attitude accuracy summary", "", (_others(found), Note(NOT_MEASURED))),
        Section("conclusions", "Conclusions", "", kept((*conclusions, _limits_by_ins(found)))),
        Section("references", "References", "", (Note(clean(found.standard.source)),)),
        Section("signatures", "Signatures", "", (Signatures(ROLES),)),
    )


LAYOUTS: dict[str, Callable[[Acceptance], tuple[Section, ...]]] = {"acceptance": _acceptance, "irig261": _irig261}


# -------------------------------------------------------------------------------------------------------- its tables


def _standard(found: Acceptance) -> Part:
    standard = found.standard
    pairs = [
        ("Standard", clean(standard.title), ""),
        ("Source", clean(standard.source), ""),
        ("What was read of it", clean(standard.read), ""),
        ("Claim", CLAIMS[standard.claim], ""),
        (
            "Confidence",
            stated(standard.confidence),
            "one-sided; exact binomial limits with the effective number of flights",
        ),
    ]
    return Facts("What is judged", [pair for pair in pairs if pair[1]])


def _objective(found: Acceptance) -> str:
    told = [
        f"{clean(limit.title)}: {wanted(limit)} on {stated(limit.share)} of flights" for limit in found.standard.limits
    ]
    return f"{'; '.join(told)}." if told else "Errors of the INS against GNSS are reported; no limit is set."


LIMIT_HEADS = (
    *(Head("Limit"), Head("Flights", True), Head("Over", True), Head("INS", True), Head("Worth", True)),
    *(Head("Within, at least", True), Head("Share stays below", True), Head("Reference ratio", True)),
    *(Head("Needed", True), Head("Short by", True), Head("Verdict")),
)


def _limits(found: Acceptance) -> Grid | None:
    rows = []
    for one in found.judgements:
        if one.ins == ENSEMBLE:
            limit = found.limit(one.limit)
            place = f" ({clean(limit.paragraph)})" if limit.paragraph else ""
            rows.append((f"{clean(limit.title)}{place}", *_judged(limit, one)))
    caption = (
        "Worth: number of independent flights that they count as. Within, at least: lower limit of the share of "
        "flights within. Share stays below: order statistic, the largest error without the flights that may be over. "
        "Reference ratio: limit over the error of the reference, both 95 %, smallest of the flights. Needed: "
        "independent flights that the claim takes, with those over now. Short by: how many of them are still to fly, "
        "none over; in brackets, at the present share."
    )
    return Grid("All flights", LIMIT_HEADS, rows, caption) if rows else None


def _judged(limit: AcceptanceLimit, one: Judgement) -> tuple[Cell, ...]:
    more = number(one.more_with_none_over, 0)
    if one.over and one.more_with_none_over:
        more += f" ({'never' if one.more_at_present_share is None else number(one.more_at_present_share, 0)})"
    return (
        *(number(count, 0) for count in (one.flights, one.over, one.ins_units)),
        number(one.effective_flights, 1),
        at_least(one.share_low) if one.flights else ABSENT,
        bound_text(limit, one),
        number(one.accuracy_ratio, 0),
        number(one.flights_needed, 0),
        ABSENT if one.decision == "not flown" else more,
        MARKS[one.decision],
    )


def _notes(found: Acceptance) -> tuple[Part, ...]:
    notes = [Note(f"{clean(limit.title)}: {sentence(limit.note)}") for limit in found.standard.limits if limit.note]
    for one in found.judgements:
        if one.ins == ENSEMBLE and one.flights and is_worth_less(one):
            told = (
                f"{clean(found.limit(one.limit).title)}: {plural(one.flights, 'flight')} of "
                f"{number(one.ins_units, 0)} INS count as {number(one.effective_flights, 1)}: the correlation within "
                f"an INS is assumed to be {number(one.correlation, 2)}. For these INS alone, every flight counts: at "
                f"least {at_least(one.share_low_these)} of flights are within."
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
        "CEP50, R95, 2drms: the same slope for the error that half and 95 % of the flights stay within at each time, "
        "and for twice their root mean square; at least three flights. Along, across: 95 % of the flights' largest "
        "errors, nmi."
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
        "Velocity: INS minus GNSS over all epochs. Heading: magnitude of the error on taxi, without rejected ones."
    )
    return Grid("Velocity, heading, alignment", heads, rows, caption)


def _limits_by_ins(found: Acceptance) -> Grid | None:
    rows = []
    for one in found.judgements:
        if one.ins != ENSEMBLE:
            limit = found.limit(one.limit)
            rows.append((f"{clean(one.ins)[:LONGEST]}: {clean(limit.title)}", *_judged(limit, one)))
    caption = "Each INS alone; its flights count as independent."
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
    caption = "Settings of the INS analysis; several values where flights differ."
    return kept((Facts("Versions", pairs), Facts("Settings", settings, caption, compact=True) if settings else None))

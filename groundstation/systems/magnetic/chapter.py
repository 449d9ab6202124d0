"""Chapter on magnetic deviation.

Verdict, coefficients, steer card, and the error left by each correction.
"""

from groundstation.chapters.agreement import agreement_note
from groundstation.chapters.assessed import reason_of
from groundstation.chapters.chapter import Remedies
from groundstation.chapters.gates import failed_to_inform, gate_grid, setting_facts
from groundstation.chapters.parts import (
    Cell,
    Claim,
    Facts,
    Figure,
    Grid,
    Head,
    Mark,
    Note,
    Part,
    Rank,
    Section,
    Tone,
    kept,
)
from groundstation.chapters.wording import ABSENT, clock, is_number, number, sentence, significant, typeset
from groundstation.results.flight import FlightResults
from groundstation.results.roles import LETTERS
from groundstation.systems.magnetic.agreement_answer import deviation_agreement
from groundstation.systems.magnetic.answer import (
    ADVISORY,
    DEVIATION_CSV,
    METHOD_TITLES,
    STEER_CARD,
    Alignment,
    ConditionName,
    MagneticResult,
    Method,
    PoissonParameters,
    Vector,
)
from groundstation.systems.magnetic.flux_chapter import (
    FLUX_LEAD,
    FLUX_TITLE,
    flux_claim,
    flux_parts,
    flux_workings,
)
from groundstation.systems.magnetic.ground_chapter import LEAD as GROUND_LEAD
from groundstation.systems.magnetic.ground_chapter import TITLE as GROUND_TITLE
from groundstation.systems.magnetic.ground_chapter import ground_claim, ground_runs, ground_workings

SOURCES = (("RU 2550774", "2015, prior art of the Russian patent on the deviation of magnetometric sensors in flight"),)
TITLE = "Magnetic deviation"
LEAD = "Opposite turns of equal bank show what to add to the magnetic heading, east positive."
HOW = (
    "How computed: field levelled by roll and pitch of the INS; magnetic minus INS true heading averaged in bins of "
    "1° on each branch, then over both; A to E by least squares. Hard and soft iron are fitted with the attitude, and "
    "from the constancy of the field's modulus. Level flight outside the figures, which no fit used, judges all "
    "three. error(c) = A + B sin c + C cos c + D sin 2c + E cos 2c, c the uncorrected magnetic heading."
)
TONES: dict[str, Tone] = {"accept": "good", "reject": "bad", "undecided": "unknown"}
MEANING = {
    "A": "constant: mounting; also INS heading and declination",
    "B": "semicircular, sin: iron fore and aft",
    "C": "semicircular, cos: iron athwart",
    "D": "quadrantal, sin: soft iron",
    "E": "quadrantal, cos: oblique soft iron",
}
MOST_TURNS = 24
CONDITIONS: dict[ConditionName, str] = {
    "pitch": "1° more pitch",
    "ground": "On the ground",
    "gain": "Drift of the gains",
}
REMEDIES: Remedies = (
    ("no turn of steady bank", ("Fly", "a full circle to either side at equal bank")),
    ("trusts_aided_heading", ("Check", "where the INS heading comes from (setting trusts_aided_heading)")),
)


def magnetic(results: FlightResults) -> Section | None:
    """Return the chapter; None when the flight was not assessed and no reason is known."""
    answer = results.answer(MagneticResult)
    if answer is None:
        return _without_turns(results)
    told = _claim(answer)
    parts: tuple[Part | None, ...] = (
        *_conclusions(answer),
        agreement_note(deviation_agreement(results.answers)),
        _coefficients(answer),
        _card(answer),
        _other_conditions(answer),
        Note("Card to print, and every degree for programs:", files=(STEER_CARD, DEVIATION_CSV)),
        Figure("magnetic.deviation"),
        gate_grid(answer.gates),
        _methods(answer),
        *(Figure(f"magnetic.{name}") for name in ("held_out", "track")),
        _swings(answer),
        *(Note(sentence(remark)) for remark in answer.remarks),
        *flux_parts(results),
        *ground_runs(results),
    )
    workings: tuple[Part | None, ...] = (
        *(Figure(f"magnetic.{name}") for name in ("branches", "modulus")),
        *(_turns(answer), _basis(answer), _iron(answer.poisson), Note(HOW), setting_facts(answer.settings, "magnetic")),
        *flux_workings(results),
        *ground_workings(results),
    )
    headline = f"{TITLE}: {answer.verdict}"
    return Section("magnetic", TITLE, LEAD, kept(parts), headline, claim=told, appendix=kept(workings))


def _without_turns(results: FlightResults) -> Section | None:
    """Return the chapter of a flight without opposite turns.

    Its compass in flight, its ground runs, and why there is no deviation.
    """
    in_flight = flux_claim(results)
    if in_flight is not None:
        agreement = agreement_note(deviation_agreement(results.answers))
        parts = kept((*flux_parts(results), agreement, *ground_runs(results)))
        workings = (*flux_workings(results), *ground_workings(results))
        return Section("magnetic", FLUX_TITLE, FLUX_LEAD, parts, in_flight.headline, claim=in_flight, appendix=workings)
    reason, runs = reason_of(results, "magnetic"), ground_runs(results)
    if not runs and not reason:
        return None
    if not runs:
        note = Note(f"Not assessable: {typeset(reason)}", "unknown")
        return Section("magnetic", TITLE, LEAD, (note,), f"{TITLE} not assessed")
    told = ground_claim(results)
    headline = "" if told is None else told.headline
    workings = ground_workings(results)
    return Section("magnetic", GROUND_TITLE, GROUND_LEAD, runs, headline, claim=told, appendix=workings)


def _claim(answer: MagneticResult) -> Claim:
    residual = answer.residual_rms_deg
    left = None if residual is None else residual.after
    before = None if residual is None else residual.before
    remark = f"RMS left of {number(before, 2, '°')}, on level flight that no fit used"
    has_figure = is_number(left)
    return Claim(
        Rank.MAGNETIC if answer.verdict in ("accept", "reject") else Rank.MAGNETIC_OPEN,
        Mark(TONES[answer.verdict], answer.verdict.capitalize()),
        f"Magnetic deviation: {number(left, 2, '°')} {remark}" if has_figure else "Magnetic deviation found in turns",
        value=number(left, 2, "°") if has_figure else "",
        remark=remark if has_figure else "",
        sentences=tuple(
            filter(None, (sentence(answer.verdict_reason), failed_to_inform(answer.gates), sentence(ADVISORY)))
        ),
        figures=(("Magnetic heading", number(left, 2, "°"), remark),) if has_figure else (),
    )


def _conclusions(answer: MagneticResult) -> list[Note]:
    residual = answer.residual_rms_deg
    left = (
        f" On level flight that no fit used the heading error was {number(residual.before, 2, '°')} RMS; "
        f"{number(residual.after, 2, '°')} is left after correction."
        if residual
        else ""
    )
    text = f"{answer.verdict.capitalize()}: {sentence(answer.verdict_reason)}{left} {ADVISORY}"
    advice = f"Correct by the {METHOD_TITLES[answer.recommended_method]}: {sentence(answer.recommendation)}"
    return [Note(text, TONES[answer.verdict]), Note(advice)]


def _coefficients(answer: MagneticResult) -> Grid:
    methods = [row for row in answer.methods if row.coefficients_deg]
    rows = []
    for letter in LETTERS:
        cells = [MEANING[letter]]
        for row in methods:
            value, sigma = row.coefficients_deg.get(letter), number(row.coefficients_sigma_deg.get(letter), 3)
            cells.append(f"{number(value, 3, signed=True)} ± {sigma}" if is_number(value) else "not observable")
        rows.append((letter, *cells))
    heads = (Head(""), Head("Meaning"), *(Head(f"{METHOD_TITLES[row.name]}, °", True) for row in methods))
    parts = "; ".join(f"{part.name} {number(part.sigma_deg, 3, '°')}" for part in answer.a_parts)
    caption = (
        "Coefficients of the error in level flight, declination removed, ± standard deviation. The deviation to add "
        f"has the opposite signs. σ of A by the table is the quadrature of: {parts}."
    )
    if is_number(answer.attitude_wander_deg):
        wander = number(answer.attitude_wander_deg, 3, "°")
        caption += f" Roll and pitch of the INS are assumed to err by {wander} in the mean of the figure: "
        caption += "this covers all other changes over minutes."
    return Grid("Coefficients", heads, rows, caption)


def _card(answer: MagneticResult) -> Grid | None:
    cells = [
        (
            number(row.magnetic_heading_deg, 0, "°"),
            number(row.steer_deg, 1, "°"),
            number(row.deviation_deg, 1, "°", signed=True),
            f"± {number(row.sigma_deg, 1, '°')}" + (" *" if row.is_interpolated else ""),
        )
        for row in answer.card
    ]
    half = -(-len(cells) // 2)
    empty = ("",) * 4
    rows = [(*cells[row], *(cells[row + half] if row + half < len(cells) else empty)) for row in range(half)]
    heads = tuple(Head(title, True) for title in ("For magnetic", "Steer", "Add", "σ")) * 2
    starred = " * no reading there: interpolated." if any(row[3].endswith("*") for row in cells) else ""
    caption = (
        f"By the {METHOD_TITLES[answer.recommended_method]}. Steer: the uncorrected reading that gives the magnetic "
        f"heading; add: the deviation, added to that reading.{starred} {ADVISORY}"
    )
    return Grid("Steer card", heads, rows, caption) if rows else None


def _other_conditions(answer: MagneticResult) -> Grid | None:
    """Return the conditions that the figure did not have, with their effect."""
    rows = [
        (
            CONDITIONS[row.name],
            f"{number(row.size_deg, 3)} ± {number(row.sigma_deg, 3)}",
            number(row.largest_deg, 2),
            sentence(row.told),
        )
        for row in answer.other_conditions
    ]
    heads = (Head("Condition"), Head("RMS, °", True), Head("Most, °", True), Head("In words"))
    caption = "By how much the deviation is another than in the table above; nothing of it is corrected or in its σ."
    return Grid("Where the table does not hold", heads, rows, caption) if rows else None


def _methods(answer: MagneticResult) -> Grid:
    titles = ("Before, °", "After, °", "Mean after, °", "Condition", "Fit, nT")
    heads = (
        Head("Method"),
        Head("State"),
        *(Head(title, True) for title in titles),
        Head("Reason, or what is missing"),
    )
    held = answer.held_out
    flown = (
        f"{number(held.seconds, 0, 's')} of level flight on {number(held.heading_sectors, 0)} of 12 sectors of heading"
        if held
        else "no level flight left to hold out"
    )
    caption = (
        f"Before, after: RMS error of the magnetic heading on the part that no fit used ({flown}). Condition: "
        "condition number of the scaled normal problem; large means hardly observable. Fit: RMS of the residual "
        "field, per axis."
    )
    rows = [_method(row, row.name == answer.recommended_method) for row in answer.methods]
    return Grid("Methods side by side", heads, rows, caption)


def _method(row: Method, is_recommended: bool) -> tuple[Cell, ...]:
    mean, sigma = number(row.held_out_mean_deg, 2, signed=True), number(row.held_out_mean_sigma_deg, 2)
    return (
        f"{METHOD_TITLES[row.name]}{' (recommended)' if is_recommended else ''}",
        Mark("good", "fitted") if row.state == "fitted" else Mark("unknown", "refused"),
        number(row.held_out_before_deg, 2),
        number(row.held_out_after_deg, 2),
        ABSENT if ABSENT in (mean, sigma) else f"{mean} ± {sigma}",
        significant(row.condition_number),
        number(row.fit_rms_nt, 0),
        sentence(row.reason) if row.reason else "",
    )


def _turns(answer: MagneticResult) -> Grid | None:
    longest = sorted(answer.turns, key=lambda turn: (turn.state != "used", -abs(turn.turned_deg)))
    rows: list[tuple[Cell, ...]] = [
        (
            Mark("good", "used") if turn.state == "used" else Mark("unknown", "not used"),
            f"{clock(turn.start_s)} – {clock(turn.end_s)}",
            f"{number(turn.bank_deg, 1, signed=True)} ± {number(turn.bank_sd_deg, 1)}",
            number(turn.turned_deg, 0, signed=True),
            number(turn.altitude_m, 0),
            typeset(turn.reason),
        )
        for turn in sorted(longest[:MOST_TURNS], key=lambda turn: turn.start_s)
    ]
    titles = ("Bank, °", "Turned, °", "Altitude, m")
    heads = (Head("State"), Head("Flight time"), *(Head(title, True) for title in titles), Head("Reason"))
    more = len(answer.turns) - MOST_TURNS
    left_out = f" {more} shorter turns are left out." if more > 0 else ""
    return Grid("Turns of steady bank", heads, rows, f"Right positive.{left_out}") if rows else None


def _swings(answer: MagneticResult) -> Grid | None:
    """Return repeated figures beside each other: equipment on and off, load, repeatability."""
    if len(answer.swings) < 2:
        return None
    rows = [
        (
            f"{number(swing.number, 0)}: {clock(swing.start_s)} – {clock(swing.end_s)}",
            *(number(swing.coefficients_deg.get(letter), 2, signed=True) for letter in LETTERS),
            f"{number(swing.difference_rms_deg, 2)} ± {number(swing.difference_sigma_deg, 2)}",
        )
        for swing in answer.swings
    ]
    heads = (Head("Figure"), *(Head(f"{letter}, °", True) for letter in LETTERS), Head("From the others, °", True))
    caption = "Each figure by its own table; from the others: RMS of the difference of the curves over the circle."
    return Grid("Each figure alone", heads, rows, caption)


def _basis(answer: MagneticResult) -> Facts:
    """Return the facts that the deviation rests on."""
    alignment, declination, coverage = answer.alignment, answer.declination, answer.coverage
    bias = ", ".join(
        f"{number(row.rms_deg, 2, '°')} at {number(row.bank_deg, 0, '°')}" + (" (flown)" if row.is_flown else "")
        for row in answer.bank_bias
    )
    horizontal, down = (number(value, 0, "nT") for value in (declination.horizontal_nt, declination.down_nt))
    pairs = (
        (
            "INS heading error removed",
            _with_sigma(alignment.error_deg, alignment.sigma_deg),
            sentence(alignment.origin),
        ),
        *_gyros(alignment),
        (
            "Declination removed",
            _with_sigma(declination.value_deg, declination.sigma_deg),
            f"{declination.model}; field {horizontal} horizontal, {down} down",
        ),
        (
            "Circle covered by both branches",
            number(100.0 * coverage.share, 1, "%"),
            f"{number(coverage.interpolated_bins, 0)} of 360 bins interpolated, widest gap "
            f"{number(coverage.widest_gap_deg, 0, '°')}",
        ),
        ("Forecast bank bias of the table", bias or ABSENT, "average of opposite banks minus level flight, RMS"),
        ("Sensors", f"{answer.magnetometer_topic} against {answer.ins_topic}", _attitude_of(alignment)),
    )
    return Facts("Basis", pairs)


def _attitude_of(alignment: Alignment) -> str:
    """Return which reference gave attitude and heading, where there was a choice."""
    states = alignment.source("states")
    if states is None:
        return ""
    known = f"best trajectory, heading σ {number(states.sigma_deg, 2, '°')}"
    return f"attitude and heading by the {known}" if states.is_used else f"{known}: {states.reason}"


def _gyros(alignment: Alignment) -> tuple[tuple[str, str, str], ...]:
    """Return the drift of the three gyros before flight, where it was logged."""
    values, sigmas = alignment.gyro_drift_deg_per_h, alignment.gyro_drift_sigma_deg_per_h
    if values is None or sigmas is None:
        return ()
    told = ", ".join(
        f"{number(value, 2, signed=True)} ± {number(sigma, 2)}" for value, sigma in zip(values, sigmas, strict=True)
    )
    return (("Gyro drift at standstill", f"{told} °/h", "forward, right, down; earth rotation removed"),)


def _with_sigma(value: float, sigma: float) -> str:
    return f"{number(value, 2, '°', signed=True)} ± {number(sigma, 2, '°')}"


def _iron(iron: PoissonParameters | None) -> Grid | None:
    if iron is None:
        return None
    hard = _with_sigmas(iron.hard_iron_nt, iron.hard_iron_sigma_nt, 0)
    current = _with_sigmas(iron.current_effect_nt_per_a, iron.current_effect_sigma_nt_per_a, 2)
    rows = [
        (axis, hard[place], *(number(value, 4) for value in iron.soft_iron[place]), current[place])
        for place, axis in enumerate(("Forward", "Right", "Down"))
    ]
    titles = ("Hard iron, nT", "Soft iron: forward", "right", "down", "Current, nT/A")
    reference = iron.current_reference_a
    at = f"; current counted from {number(reference, 1, 'A')}, the mean of the figures" if is_number(reference) else ""
    caption = f"Reading = soft iron × field + hard iron + current effect, ± standard deviation{at}."
    return Grid("Iron of the aircraft", (Head("Axis"), *(Head(title, True) for title in titles)), rows, caption)


def _with_sigmas(values: Vector | None, sigmas: Vector | None, places: int) -> tuple[str, ...]:
    """Return the three axes of a vector, each with its sigma; em dashes for unknown sigmas."""
    if values is None or sigmas is None:
        return (ABSENT,) * 3
    return tuple(
        f"{number(value, places, signed=True)} ± {number(sigma, places)}"
        for value, sigma in zip(values, sigmas, strict=True)
    )

"""Parts of the chapter on magnetic deviation: heading alone, in flight."""

from groundstation.chapters.gates import gate_grid, setting_facts
from groundstation.chapters.parts import Cell, Claim, Facts, Figure, Grid, Head, Mark, Note, Part, Rank, Tone, kept
from groundstation.chapters.wording import ABSENT, clock, is_number, number, plural, sentence, typeset
from groundstation.results.flight import FlightResults
from groundstation.systems.magnetic.answer import ADVISORY, DEVIATION_CSV, STEER_CARD, MagneticResult
from groundstation.systems.magnetic.flux_answer import FLUX_TITLES, REFERENCE_TITLES, FluxDeviation, FluxLeg
from groundstation.systems.magnetic.ground_answer import GroundCoefficient

MOST_LEGS = 40
FLUX_TITLE = "Magnetic deviation of a flux valve"
FLUX_LEAD = "Straight legs on several headings show what to add to the reading of a compass that gives heading alone."
HOW = (
    "How computed: reading + declination − true heading on each straight leg, settled after a turn; A to E with an "
    "error of its own for each leg integrated out. Turns show by which share of the bank the sensor leans and how "
    "slowly the display follows; the legs are corrected for both. Opposite turns are averaged beside that, and refused "
    "where bank and lag leave too much. error(c) = A + B sin c + C cos c + D sin 2c + E cos 2c, c the reading."
)
MEANING = {
    "A": "constant: mounting; also true heading and declination",
    "B": "semicircular, sin: iron fore and aft",
    "C": "semicircular, cos: iron athwart",
    "D": "quadrantal, sin: soft iron",
    "E": "quadrantal, cos: oblique soft iron",
}
TONES: dict[str, Tone] = {"accept": "good", "reject": "bad", "undecided": "unknown"}


def flux_parts(results: FlightResults) -> tuple[Part, ...]:
    """Return what the compass shows in flight; empty without such an answer."""
    answer = results.answer(FluxDeviation)
    if answer is None:
        return ()
    has_files = results.answer(MagneticResult) is None
    return kept(
        (
            _conclusion(answer),
            _coefficients(answer),
            _card(answer),
            Note("Card to print, and every degree for programs:", files=(STEER_CARD, DEVIATION_CSV))
            if has_files
            else None,
            Figure("magnetic.flux_legs"),
            Figure("magnetic.flux_turns"),
            gate_grid(answer.gates),
            _methods(answer),
            *(Note(sentence(remark)) for remark in answer.remarks),
        )
    )


def flux_workings(results: FlightResults) -> tuple[Part, ...]:
    """Return the parts for the appendix of a report; empty without such an answer."""
    answer = results.answer(FluxDeviation)
    if answer is None:
        return ()
    settings = setting_facts(answer.settings, "magnetic_flux")
    return kept((_legs(answer), _basis(answer), Note(HOW), settings))


def flux_claim(results: FlightResults) -> Claim | None:
    """Return the claim of the compass in flight; None without such an answer."""
    answer = results.answer(FluxDeviation)
    if answer is None:
        return None
    residual = answer.residual_rms_deg
    value = number(residual.after, 2, "°") if residual else ""
    before = f"RMS left of {number(residual.before, 2, '°')}, {_judged_by(answer)}" if residual else ""
    found = "Deviation of the compass found on straight legs"
    return Claim(
        Rank.MAGNETIC if answer.verdict in ("accept", "reject") else Rank.MAGNETIC_OPEN,
        Mark(TONES[answer.verdict], answer.verdict.capitalize()),
        f"Deviation of the compass: {value} {before}" if residual else found,
        value=value,
        remark=before,
        sentences=(sentence(answer.verdict_reason), sentence(ADVISORY)),
        figures=(("Magnetic heading", value, before),) if residual else (),
    )


def _judged_by(answer: FluxDeviation) -> str:
    turns = answer.recommended_method == "opposite_turns"
    return "on straight legs" if turns else "each direction by the others"


def _conclusion(answer: FluxDeviation) -> Note:
    residual = answer.residual_rms_deg
    left = (
        f" The error of straight legs was {number(residual.before, 2, '°')} RMS; {number(residual.after, 2, '°')} is "
        f"left after correction, {_judged_by(answer)}."
        if residual
        else ""
    )
    by = f" By {FLUX_TITLES[answer.recommended_method]} against {REFERENCE_TITLES[answer.reference.name]}."
    text = f"{answer.verdict.capitalize()}: {sentence(answer.verdict_reason)}{by}{left} {ADVISORY}"
    return Note(text, TONES[answer.verdict])


def _with_sigma(value: float | None, sigma: float | None, places: int = 2) -> str:
    return f"{number(value, places, signed=True)} ± {number(sigma, places)}" if is_number(value) else ABSENT


def _coefficients(answer: FluxDeviation) -> Grid:
    rows: list[tuple[Cell, ...]] = [_coefficient(row) for row in answer.coefficients]
    parts = "; ".join(f"{part.name} {number(part.sigma_deg, 2, '°')}" for part in answer.a_parts)
    caption = (
        "Coefficients of the error, declination removed, ± standard deviation. The deviation to add has the opposite "
        f"signs. σ of A is the quadrature of: {parts}."
    )
    heads = (Head(""), Head("Meaning"), Head("Value, °", True), Head("What is not observable"))
    return Grid("Coefficients of the compass", heads, rows, caption)


def _coefficient(row: GroundCoefficient) -> tuple[Cell, ...]:
    if is_number(row.value_deg):
        return row.letter, MEANING[row.letter], _with_sigma(row.value_deg, row.sigma_deg), ""
    told = f"{sentence(row.reason)} Unknown within ± {number(row.sigma_deg, 1, '°')}."
    return row.letter, MEANING[row.letter], "not observable", told


def _card(answer: FluxDeviation) -> Grid | None:
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
    rows: list[tuple[Cell, ...]] = [
        (*cells[row], *(cells[row + half] if row + half < len(cells) else ("",) * 4)) for row in range(half)
    ]
    heads = tuple(Head(title, True) for title in ("For magnetic", "Steer", "Add", "σ")) * 2
    starred = " * no leg near it: interpolated." if any(row[3].endswith("*") for row in cells) else ""
    caption = (
        "Steer: the reading that gives the magnetic heading; add: the deviation, added to that reading. In level "
        f"flight, settled after a turn.{starred} {ADVISORY}"
    )
    return Grid("Steer card of the compass", heads, rows, caption) if rows else None


def _methods(answer: FluxDeviation) -> Grid:
    rows: list[tuple[Cell, ...]] = [
        (
            f"{FLUX_TITLES[row.name].capitalize()}{' (recommended)' if row.name == answer.recommended_method else ''}",
            Mark("good", "fitted") if row.state == "fitted" else Mark("unknown", "refused"),
            *(_with_sigma(row.coefficients_deg.get(x), row.coefficients_sigma_deg.get(x)) for x in "ABCDE"),
            sentence(row.reason) if row.reason else "",
        )
        for row in answer.methods
    ]
    heads = (Head("Method"), Head("State"), *(Head(f"{x}, °", True) for x in "ABCDE"), Head("Reason"))
    return Grid("Legs and turns side by side", heads, rows, "")


def _legs(answer: FluxDeviation) -> Grid:
    titles = ("V, m/s", "Altitude, m", "Reading, °", "True, °", "Error, °", "Noise, °")
    heads = (Head("State"), Head("Flight time"), *(Head(title, True) for title in titles), Head("Reason"))
    left = f" {len(answer.legs) - MOST_LEGS} later legs are left out." if len(answer.legs) > MOST_LEGS else ""
    caption = f"Noise is σ of the reading alone; ± includes the true heading and the declination.{left}"
    return Grid("Straight legs", heads, [_leg(one) for one in answer.legs[:MOST_LEGS]], caption)


def _leg(one: FluxLeg) -> tuple[Cell, ...]:
    return (
        Mark("good", "used") if one.state == "used" else Mark("unknown", "not used"),
        f"{clock(one.start_s)} – {clock(one.end_s)}",
        number(one.speed_mps, 1),
        number(one.altitude_m, 0),
        number(one.magnetic_heading_deg, 1),
        number(one.true_heading_deg, 1),
        _with_sigma(one.error_deg, one.sigma_deg),
        number(one.noise_sigma_deg, 2),
        typeset(one.reason),
    )


def _basis(answer: FluxDeviation) -> Facts:
    declination, bank, wind = answer.declination, answer.bank_error, answer.wind
    pairs = [
        ("Compass", answer.ins_topic, ""),
        *(
            (
                f"True heading by {REFERENCE_TITLES[one.name]}",
                f"σ {number(one.sigma_deg, 2, '°')}" if one.is_used else "not used",
                sentence(one.reason) if one.reason else "",
            )
            for one in answer.references
        ),
        (
            "Declination removed",
            f"{_with_sigma(declination.value_deg, declination.sigma_deg)}°",
            f"{declination.model}; dip {number(answer.dip_deg, 0, '°')}",
        ),
        ("Widest gap between headings", number(answer.widest_gap_deg, 0, "°"), ""),
        (
            "Own error of a leg",
            number(answer.place_sigma_deg, 2, "°"),
            "standard deviation beyond noise, prior included",
        ),
    ]
    if bank.state == "found":
        pairs += [
            (
                "Lean in turns",
                number(bank.lean, 2),
                f"of the bank, 95 %: {_ends(bank.lean95, 1)}; {plural(bank.turns, 'turn')}",
            ),
            ("Lag of the display", number(bank.lag_s, 0, "s"), f"95 %: {_ends(bank.lag95_s, 0)} s"),
        ]
    else:
        pairs.append(("Lean in turns", "not observable", sentence(bank.reason)))
    if wind is not None:
        told = f"{number(wind.north_mps, 1, signed=True)} north, {number(wind.east_mps, 1, signed=True)} east"
        scale = f"{number(wind.airspeed_scale, 3)} ± {number(wind.airspeed_scale_sigma, 3)}"
        pairs += [
            ("Wind solved", f"{told} m/s", f"changes of about {number(wind.changes_mps, 1, 'm/s')}"),
            ("True over logged airspeed", scale, ""),
        ]
    return Facts("Basis of the compass", tuple(pairs))


def _ends(pair: tuple[float, float] | None, places: int) -> str:
    return ABSENT if pair is None else f"{number(pair[0], places)} to {number(pair[1], places)}"

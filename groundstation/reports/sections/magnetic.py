"""Chapter: magnetic deviation (system 3): verdict, coefficients, steer card, and what each correction leaves."""

from collections.abc import Mapping
from typing import Any

from groundstation.chapters.parts import Cell, Facts, Grid, Head, Mark, Note, Part, Section, Tone
from groundstation.chapters.wording import ABSENT, clock, is_number, number, significant, typeset
from groundstation.reports.figures import magnetic as magnetic_figures
from groundstation.reports.sections import magnetic_ground
from groundstation.reports.sections.heading import gate_grid, setting_facts
from groundstation.reports.sections.saved import mapping, not_assessable_reason, objects
from groundstation.results.deviation import DEVIATION_CSV, STEER_CARD
from groundstation.results.files import SavedFlight
from groundstation.results.magnetic import ADVISORY, LETTERS

TITLE = "Magnetic deviation"
LEAD = (
    "Opposite turns of equal bank show the deviation of the magnetic heading against the aligned INS. Error = magnetic "
    "heading − true magnetic heading; the deviation is its negative, to be added to the reading, east positive."
)
HOW = (
    "How computed: field levelled by roll and pitch of the INS; magnetic minus INS true heading averaged in bins of 1° "
    "on each branch, then over both; A to E by least squares. Hard and soft iron are fitted with the attitude, and "
    "from the constancy of the field's modulus. Level flight outside the figures, which no fit has seen, judges all "
    "three. error(c) = A + B sin c + C cos c + D sin 2c + E cos 2c, c the uncorrected magnetic heading. Source: "
    "Russian patent on the deviation of magnetometric sensors determined in flight; prior art RU 2550774."
)
TONES: dict[str, Tone] = {"accept": "good", "reject": "bad", "undecided": "unknown"}
MEANING = {
    "A": "constant: mounting, INS heading and declination besides",
    "B": "semicircular, sin: iron fore and aft",
    "C": "semicircular, cos: iron athwart",
    "D": "quadrantal, sin: soft iron",
    "E": "quadrantal, cos: soft iron askew",
}
MOST_TURNS = 24


def build(saved: SavedFlight) -> Section | None:
    """Build the chapter; None when the flight was not assessed and no reason is known."""
    magnetic = mapping(saved.summary, "results", "magnetic")
    if not magnetic:
        reason = not_assessable_reason(saved, "magnetic")
        notes = (Note(f"Not assessable: {typeset(reason)}", "unknown"),) if reason else ()
        instead = (*notes, *magnetic_ground.parts(saved))
        return Section("magnetic", TITLE, LEAD, instead) if instead else None
    parts: tuple[Part | None, ...] = (
        *_conclusions(magnetic),
        _coefficients(magnetic),
        _card(magnetic),
        _files(saved),
        magnetic_figures.deviation(saved),
        gate_grid(magnetic),
        _methods(magnetic),
        magnetic_figures.held_out(saved),
        magnetic_figures.track(saved),
        magnetic_figures.branches(saved),
        magnetic_figures.modulus(saved),
        _turns(magnetic),
        _swings(magnetic),
        _basis(magnetic),
        _iron(magnetic),
        *(Note(_sentence(remark)) for remark in magnetic.get("remarks") or ()),
        Note(HOW),
        setting_facts(magnetic),
        *magnetic_ground.parts(saved),
    )
    return Section("magnetic", TITLE, LEAD, tuple(part for part in parts if part is not None))


def _sentence(text: Any) -> str:
    told = typeset(str(text)).strip().rstrip(".")
    return f"{told[:1].upper()}{told[1:]}."


def _name(method: Any) -> str:
    return magnetic_figures.METHODS.get(str(method), str(method or ABSENT))


def _conclusions(magnetic: Mapping[str, Any]) -> list[Note]:
    verdict, residual = str(magnetic.get("verdict") or ABSENT), mapping(magnetic, "residual_rms_deg")
    left = (
        f" On level flight that no fit has seen the heading error was {number(residual.get('before'), 2, '°')} RMS; "
        f"{number(residual.get('after'), 2, '°')} is left after correction."
        if residual
        else ""
    )
    text = f"{verdict.capitalize()}: {_sentence(magnetic.get('verdict_reason'))}{left} {ADVISORY}"
    advice = f"Correct by the {_name(magnetic.get('recommended_method'))}: {_sentence(magnetic.get('recommendation'))}"
    return [Note(text, TONES.get(verdict, "unknown")), Note(advice)]


def _coefficients(magnetic: Mapping[str, Any]) -> Grid:
    methods = [row for row in objects(magnetic, "methods") if row.get("coefficients_deg")]
    rows = []
    for letter in LETTERS:
        cells = [MEANING[letter]]
        for row in methods:
            value = mapping(row, "coefficients_deg").get(letter)
            sigma = number(mapping(row, "coefficients_sigma_deg").get(letter), 3)
            cells.append(f"{number(value, 3, signed=True)} ± {sigma}" if is_number(value) else "not seen")
        rows.append((letter, *cells))
    heads = (Head(""), Head("Meaning"), *(Head(f"{_name(row.get('name'))}, °", True) for row in methods))
    parts = "; ".join(
        f"{part.get('name')} {number(part.get('sigma_deg'), 3, '°')}" for part in objects(magnetic, "a_parts")
    )
    caption = (
        "Of the error in level flight, declination removed, ± standard deviation. The deviation to add has the "
        f"opposite signs. σ of A by the table is the quadrature of: {parts}."
    )
    return Grid("Coefficients", heads, rows, caption)


def _card(magnetic: Mapping[str, Any]) -> Grid | None:
    cells = [
        (
            number(row.get("magnetic_heading_deg"), 0, "°"),
            number(row.get("steer_deg"), 1, "°"),
            number(row.get("deviation_deg"), 1, "°", signed=True),
            f"± {number(row.get('sigma_deg'), 1, '°')}" + (" *" if row.get("is_interpolated") else ""),
        )
        for row in objects(magnetic, "card")
    ]
    half = -(-len(cells) // 2)
    empty = ("",) * 4
    rows = [(*cells[row], *(cells[row + half] if row + half < len(cells) else empty)) for row in range(half)]
    heads = tuple(Head(title, True) for title in ("For magnetic", "Steer", "Add", "σ")) * 2
    starred = " * no reading there: interpolated." if any(row[3].endswith("*") for row in cells) else ""
    caption = (
        f"By the {_name(magnetic.get('recommended_method'))}. Steer: the uncorrected reading that gives the magnetic "
        f"heading; add: the deviation, added to that reading.{starred} {ADVISORY}"
    )
    return Grid("Steer card", heads, rows, caption) if rows else None


def _files(saved: SavedFlight) -> Note | None:
    """The table and the card beside the report, those that were written."""
    names = [name for name in (STEER_CARD, DEVIATION_CSV) if (saved.folder / name).is_file()]
    return Note("To print, and for programs, every degree:", files=names) if names else None


def _methods(magnetic: Mapping[str, Any]) -> Grid:
    rows: list[tuple[Cell, ...]] = []
    for row in objects(magnetic, "methods"):
        state = Mark("good", "fitted") if row.get("state") == "fitted" else Mark("unknown", "refused")
        mean, sigma = (number(row.get(f"held_out_mean{end}_deg"), 2, signed=not end) for end in ("", "_sigma"))
        chosen = " (recommended)" if row.get("name") == magnetic.get("recommended_method") else ""
        rows.append(
            (
                f"{_name(row.get('name'))}{chosen}",
                state,
                number(row.get("held_out_before_deg"), 2),
                number(row.get("held_out_after_deg"), 2),
                ABSENT if ABSENT in (mean, sigma) else f"{mean} ± {sigma}",
                significant(row.get("condition_number")),
                number(row.get("fit_rms_nt"), 0),
                _sentence(row.get("reason")) if row.get("reason") else "",
            )
        )
    titles = ("Before, °", "After, °", "Mean after, °", "Condition", "Fit, nT")
    heads = (Head("Method"), Head("State"), *(Head(title, True) for title in titles), Head("Why, or what it lacks"))
    held = mapping(magnetic, "held_out")
    flown = (
        f"{number(held.get('seconds'), 0, 's')} of level flight on {number(held.get('heading_sectors'), 0)} of 12 "
        "sectors of heading"
        if held
        else "nothing was left to hold out"
    )
    caption = (
        f"Before, after: RMS error of the magnetic heading on the part no fit has seen ({flown}). Condition: number of "
        "the scaled normal problem; large means hardly observable. Fit: RMS of the field left, per axis."
    )
    return Grid("Methods side by side", heads, rows, caption)


def _turns(magnetic: Mapping[str, Any]) -> Grid | None:
    turns = objects(magnetic, "turns")
    longest = sorted(turns, key=lambda turn: (turn.get("state") != "used", -abs(turn.get("turned_deg") or 0.0)))
    rows: list[tuple[Cell, ...]] = [
        (
            Mark("good", "used") if turn.get("state") == "used" else Mark("unknown", "not used"),
            f"{clock(turn.get('start_s'))} – {clock(turn.get('end_s'))}",
            f"{number(turn.get('bank_deg'), 1, signed=True)} ± {number(turn.get('bank_sd_deg'), 1)}",
            number(turn.get("turned_deg"), 0, signed=True),
            number(turn.get("altitude_m"), 0),
            typeset(str(turn.get("reason") or "")),
        )
        for turn in sorted(longest[:MOST_TURNS], key=lambda turn: turn.get("start_s") or 0.0)
    ]
    titles = ("Bank, °", "Turned, °", "Altitude, m")
    heads = (Head("State"), Head("Flight time"), *(Head(title, True) for title in titles), Head("Reason"))
    left_out = f" {len(turns) - MOST_TURNS} shorter turns are left out." if len(turns) > MOST_TURNS else ""
    return Grid("Turns of steady bank", heads, rows, f"Right positive.{left_out}") if rows else None


def _swings(magnetic: Mapping[str, Any]) -> Grid | None:
    """Repeated figures beside each other: equipment on and off, load, repeatability."""
    swings = objects(magnetic, "swings")
    if len(swings) < 2:
        return None
    rows = [
        (
            f"{number(swing.get('number'), 0)}: {clock(swing.get('start_s'))} – {clock(swing.get('end_s'))}",
            *(number(mapping(swing, "coefficients_deg").get(letter), 2, signed=True) for letter in LETTERS),
            f"{number(swing.get('difference_rms_deg'), 2)} ± {number(swing.get('difference_sigma_deg'), 2)}",
        )
        for swing in swings
    ]
    heads = (Head("Figure"), *(Head(f"{letter}, °", True) for letter in LETTERS), Head("From the others, °", True))
    caption = "Each figure by its own table; from the others: RMS of the difference of the curves over the circle."
    return Grid("Figures apart", heads, rows, caption)


def _basis(magnetic: Mapping[str, Any]) -> Facts:
    """What the deviation rests on."""
    alignment, declination = mapping(magnetic, "alignment"), mapping(magnetic, "declination")
    coverage = mapping(magnetic, "coverage")
    bias = ", ".join(
        f"{number(row.get('rms_deg'), 2, '°')} at {number(row.get('bank_deg'), 0, '°')}"
        + (" (flown)" if row.get("is_flown") else "")
        for row in objects(magnetic, "bank_bias")
    )
    share = coverage.get("share")
    strengths = [number(declination.get(f"{part}_nt"), 0, "nT") for part in ("horizontal", "down")]
    pairs = (
        (
            "INS heading error taken off",
            _with_sigma(alignment.get("error_deg"), alignment.get("sigma_deg")),
            _sentence(alignment.get("origin")),
        ),
        *_gyros(alignment),
        (
            "Declination taken off",
            _with_sigma(declination.get("value_deg"), declination.get("sigma_deg")),
            f"{declination.get('model')}; field {strengths[0]} horizontal, {strengths[1]} down",
        ),
        (
            "Circle covered by both branches",
            number(100.0 * share, 1, "%") if is_number(share) else ABSENT,
            f"{number(coverage.get('interpolated_bins'), 0)} of 360 bins interpolated, widest gap "
            f"{number(coverage.get('widest_gap_deg'), 0, '°')}",
        ),
        ("Forecast bank bias of the table", bias or ABSENT, "average of opposite banks minus level flight, RMS"),
        ("Sensors", f"{magnetic.get('magnetometer_topic')} against {magnetic.get('ins_topic')}", ""),
    )
    return Facts("What it rests on", pairs)


def _gyros(alignment: Mapping[str, Any]) -> tuple[tuple[str, str, str], ...]:
    """Drift of the three gyros before flight, where it was logged."""
    values, sigmas = alignment.get("gyro_drift_deg_per_h"), alignment.get("gyro_drift_sigma_deg_per_h")
    if not isinstance(values, list) or not isinstance(sigmas, list):
        return ()
    told = ", ".join(
        f"{number(value, 2, signed=True)} ± {number(sigma, 2)}" for value, sigma in zip(values, sigmas, strict=False)
    )
    return (("Gyro drift at standstill", f"{told} °/h", "forward, right, down; beyond the rotation of the earth"),)


def _with_sigma(value: Any, sigma: Any) -> str:
    return f"{number(value, 2, '°', signed=True)} ± {number(sigma, 2, '°')}"


def _iron(magnetic: Mapping[str, Any]) -> Grid | None:
    iron = mapping(magnetic, "poisson")
    if not iron:
        return None
    rows = []
    for place, axis in enumerate(("Forward", "Right", "Down")):
        hard = _cells(iron, "hard_iron_nt", "hard_iron_sigma_nt", place)
        current = _cells(iron, "current_effect_nt_per_a", "current_effect_sigma_nt_per_a", place)
        soft = (iron.get("soft_iron") or [])[place : place + 1] or [[]]
        rows.append((axis, hard, *(number(value, 4) for value in [*soft[0], None, None, None][:3]), current))
    titles = ("Hard iron, nT", "Soft iron: forward", "right", "down", "Current, nT/A")
    reference = iron.get("current_reference_a")
    at = f"; current counted from {number(reference, 1, 'A')}, the mean of the figures" if is_number(reference) else ""
    caption = f"Reading = soft iron × field + hard iron + current effect, ± standard deviation{at}."
    return Grid("Iron of the aircraft", (Head("Axis"), *(Head(title, True) for title in titles)), rows, caption)


def _cells(iron: Mapping[str, Any], name: str, sigma_name: str, place: int) -> str:
    values, sigmas = iron.get(name), iron.get(sigma_name)
    if not isinstance(values, list) or not isinstance(sigmas, list) or place >= min(len(values), len(sigmas)):
        return ABSENT
    places = 0 if name == "hard_iron_nt" else 2
    return f"{number(values[place], places, signed=True)} ± {number(sigmas[place], places)}"

"""Steer card for the cockpit, a page of A6 beside a flight's report."""

from collections.abc import Sequence
from pathlib import Path

from groundstation.base.dataclasses import dataclass
from groundstation.base.timescales import utc_ns_to_iso
from groundstation.chapters.parts import Mark, Paper
from groundstation.chapters.wording import ABSENT, is_number, number, typeset
from groundstation.results.flight import FlightResults
from groundstation.systems.magnetic.answer import ADVISORY, DEVIATION_CSV, CardRow, MagneticResult
from groundstation.systems.magnetic.deviation_answer import TITLES
from groundstation.systems.magnetic.flux_answer import REFERENCE_TITLES, FluxDeviation

TEMPLATE = Path(__file__).parent / "steer_card.typ"
MOST_ROWS = 36  # of a page of A6: every 10 deg
MOST_LETTERS, MOST_OF_A_REASON = 40, 150


@dataclass(frozen=True)
class CardLine:
    """Line of a steer card: magnetic heading, reading to steer, deviation to add, its sigma.

    To fly the heading, steer the reading.
    """

    heading: str
    steer: str
    deviation: str
    sigma: str
    is_interpolated: bool


@dataclass(frozen=True)
class SteerCard:
    """Steer card as printed.

    Parameters
    ----------
    pairs : sequence of (str, str)
        Label and value: flight, date, sensors.
    state : Mark
        The verdict in a word or two; ``reason`` says why.
    lines : sequence of CardLine
    remarks : sequence of str
        Under the table.
    """

    aircraft: str
    pairs: Sequence[tuple[str, str]]
    state: Mark
    reason: str
    lines: Sequence[CardLine]
    remarks: Sequence[str]
    advisory: str = ADVISORY


def steer_card_page(results: FlightResults) -> Paper | None:
    """Return the card of a flight that has a deviation; None of any other."""
    answer = results.answer(MagneticResult) or results.answer(FluxDeviation)
    return None if answer is None else Paper(steer_card(results, answer), TEMPLATE)


def steer_card(results: FlightResults, answer: MagneticResult | FluxDeviation) -> SteerCard:
    """Build the card of a flight from its deviation."""
    start_ns = results.start_utc_ns
    pairs = (
        ("Flight", _shorter(results.flight_id, 2 * MOST_LETTERS)),
        ("Date", "not known" if start_ns is None else utc_ns_to_iso(start_ns)[:10]),
        *_sensors(answer),
    )
    state, reason = _state(answer)
    rows = answer.card[:: max(1, -(-len(answer.card) // MOST_ROWS))]  # every k-th, so that they fit on the page
    return SteerCard(
        _shorter(results.metadata.get("aircraft") or "aircraft not named"),
        pairs,
        state,
        reason,
        tuple(_line(row) for row in rows),
        _remarks(answer, rows),
    )


def _sensors(answer: MagneticResult | FluxDeviation) -> tuple[tuple[str, str], ...]:
    if isinstance(answer, FluxDeviation):
        return ("Compass", _shorter(answer.ins_topic)), ("Swung against", REFERENCE_TITLES[answer.reference.name])
    return ("Magnetometer", _shorter(answer.magnetometer_topic)), ("Swung against", _shorter(answer.ins_topic))


def _state(answer: MagneticResult | FluxDeviation) -> tuple[Mark, str]:
    """Return the verdict; any but accept is printed large."""
    reason = _shorter(typeset(answer.verdict_reason), MOST_OF_A_REASON)
    if answer.verdict == "accept":
        return Mark("good", "Accept"), reason
    return Mark("bad", "NOT ACCEPTED"), reason if answer.verdict == "reject" else f"{answer.verdict}: {reason}"


def _line(row: CardRow) -> CardLine:
    return CardLine(
        _three_digits(row.magnetic_heading_deg),
        _three_digits(row.steer_deg),
        number(row.deviation_deg, 1, signed=True),
        number(row.sigma_deg, 1),
        row.is_interpolated,
    )


def _three_digits(heading_deg: float) -> str:
    """Return a heading in whole degrees as it is spoken: 000 to 359."""
    return f"{round(heading_deg) % 360:03d}" if is_number(heading_deg) else ABSENT


def _remarks(answer: MagneticResult | FluxDeviation, rows: Sequence[CardRow]) -> tuple[str, ...]:
    residual = answer.residual_rms_deg
    is_heading = isinstance(answer, FluxDeviation)
    where = "on straight legs" if is_heading else "in level flight"
    missing = "no leg near it" if is_heading else "no reading of both turns near it"
    left = (
        f"RMS error {where} {number(residual.before, 2, '°')} before, {number(residual.after, 2, '°')} after."
        if residual
        else "RMS error after: not measured."
    )
    told = [f"By the {TITLES[answer.recommended_method]}. {left}"]
    told.append("Steer: the uncorrected reading. Add: its deviation ± σ, east positive.")
    if any(row.is_interpolated for row in rows):
        told.append(f"* {missing}: interpolated.")
    if len(rows) < len(answer.card):
        told.append(f"Every degree: {DEVIATION_CSV}.")
    return tuple(told)


def _shorter(text: str, most: int = MOST_LETTERS) -> str:
    told = text or ABSENT
    return told if len(told) <= most else told[: most - 1] + "…"

"""What a flight leaves beside its report for the cockpit: the deviation as a table and as a steer card on A6 paper."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from groundstation.chapters.parts import Mark
from groundstation.chapters.wording import ABSENT, is_number, number, typeset
from groundstation.reports.page import TEMPLATES
from groundstation.reports.pdf import PdfError, write_pdf
from groundstation.reports.sections.saved import mapping, objects
from groundstation.results.deviation import DEVIATION_CSV, STEER_CARD, deviation_csv
from groundstation.results.files import SavedFlight, write_text
from groundstation.results.magnetic import ADVISORY, METHOD_TITLES

TEMPLATE = TEMPLATES / "steer_card.typ"
MOST_ROWS = 36  # of a page of A6: every 10 deg
MOST_LETTERS, MOST_OF_A_REASON = 40, 150


@dataclass(frozen=True)
class CardLine:
    """To fly a magnetic heading, steer that reading; the deviation to add with its sigma."""

    heading: str
    steer: str
    deviation: str
    sigma: str
    is_interpolated: bool


@dataclass(frozen=True)
class SteerCard:
    """The card as it is printed.

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


def write_exports(saved: SavedFlight, *, with_pdf: bool) -> tuple[tuple[Path, ...], str]:
    """Write deviation.csv and steer_card.pdf of a flight that has a magnetic deviation; others lose an old one.

    Returns
    -------
    tuple of Path, str
        What was written, and why one of them was not.
    """
    table, card = saved.folder / DEVIATION_CSV, saved.folder / STEER_CARD
    for path in (table, card):
        path.unlink(missing_ok=True)
    if not mapping(saved.summary, "results", "magnetic"):
        return (), ""
    paths, problems = [], []
    text = deviation_csv(saved)
    if text is None:
        problems.append(f"{DEVIATION_CSV}: not written, its arrays are missing in results.parquet: run the log again")
    else:
        write_text(table, text)
        paths.append(table)
    if with_pdf:
        try:
            write_pdf(steer_card(saved), card, TEMPLATE)
            paths.append(card)
        except PdfError as error:
            problems.append(str(error))
    return tuple(paths), "; ".join(problems)


def steer_card(saved: SavedFlight) -> SteerCard:
    """Build the card of a flight from what it saved, whatever is missing there."""
    magnetic, flight = mapping(saved.summary, "results", "magnetic"), mapping(saved.summary, "flight")
    start = flight.get("start_utc")
    pairs = (
        ("Flight", _shorter(flight.get("id"), 2 * MOST_LETTERS)),
        ("Date", str(start)[:10] if start else "not known"),
        ("Magnetometer", _shorter(magnetic.get("magnetometer_topic"))),
        ("Swung against", _shorter(magnetic.get("ins_topic"))),
    )
    state, reason = _state(magnetic)
    rows = _thinned(objects(magnetic, "card"))
    return SteerCard(
        _shorter(flight.get("aircraft") or "aircraft not named"),
        pairs,
        state,
        reason,
        tuple(_line(row) for row in rows),
        _remarks(magnetic, rows),
    )


def _state(magnetic: Mapping[str, Any]) -> tuple[Mark, str]:
    """The verdict; anything but accept is told largely."""
    verdict = str(magnetic.get("verdict") or ABSENT)
    reason = _shorter(typeset(str(magnetic.get("verdict_reason") or "")), MOST_OF_A_REASON)
    if verdict == "accept":
        return Mark("good", "Accepted"), reason
    return Mark("bad", "NOT ACCEPTED"), reason if verdict == "reject" else f"{verdict}: {reason}"


def _thinned(rows: list[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """Every k-th row, so that they fit on the page."""
    return rows[:: max(1, -(-len(rows) // MOST_ROWS))]


def _line(row: Mapping[str, Any]) -> CardLine:
    return CardLine(
        _three_digits(row.get("magnetic_heading_deg")),
        _three_digits(row.get("steer_deg")),
        number(row.get("deviation_deg"), 1, signed=True),
        number(row.get("sigma_deg"), 1),
        bool(row.get("is_interpolated")),
    )


def _three_digits(heading_deg: Any) -> str:
    """A heading in whole degrees as it is spoken: 000 to 359."""
    return f"{round(heading_deg) % 360:03d}" if is_number(heading_deg) else ABSENT


def _remarks(magnetic: Mapping[str, Any], rows: Sequence[Mapping[str, Any]]) -> tuple[str, ...]:
    method = str(magnetic.get("recommended_method") or ABSENT)
    residual = mapping(magnetic, "residual_rms_deg")
    left = (
        f"RMS error in level flight {number(residual.get('before'), 2, '°')} before, "
        f"{number(residual.get('after'), 2, '°')} after."
        if residual
        else "RMS error after: not measured."
    )
    told = [f"By the {METHOD_TITLES.get(method, method)}. {left}"]  # type: ignore[call-overload]
    told.append("Steer: the uncorrected reading. Add: its deviation ± σ, east positive.")
    if any(row.get("is_interpolated") for row in rows):
        told.append("* no reading of both turns near it: interpolated.")
    if len(rows) < len(objects(magnetic, "card")):
        told.append(f"Every degree: {DEVIATION_CSV}.")
    return tuple(told)


def _shorter(text: Any, most: int = MOST_LETTERS) -> str:
    told = str(text or ABSENT)
    return told if len(told) <= most else told[: most - 1] + "…"

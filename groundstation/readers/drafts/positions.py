"""Positions of a table: in one column or two, in which unit, in degrees."""

import re
from dataclasses import replace

import numpy as np

from groundstation.base import arrow_values as arrow
from groundstation.base.angles import FloatArray
from groundstation.base.units import CONVERSIONS
from groundstation.readers import cells
from groundstation.readers.drafts.column import ColumnGuess
from groundstation.readers.drafts.sample import TableSample
from groundstation.readers.drafts.words import words_of

_PLACES = frozenset(("position", "location", "coordinates", "coordinate", "coord", "coords", "latlon", "latlng", "gps"))
_PAIR = re.compile(r"\s*(-?\d{1,2}\.\d+)\s*[ ,;]\s*(-?\d{1,3}\.\d+)\s*")
_RUN_TOGETHER = re.compile(r"-?\d{3,5}\.\d+")  # degrees and minutes
_SIDES = {"latitude_deg": ("N", "S"), "longitude_deg": ("E", "W")}


def is_pair(sample: TableSample, at: int) -> bool:
    """Tell whether the cells of a column are latitude and longitude."""
    if _PLACES.isdisjoint(words_of(sample.names[at])):
        return False
    found = [_PAIR.fullmatch(cell) for cell in sample.filled(at)]
    return bool(found) and all(one and abs(float(one[1])) <= 90.0 and abs(float(one[2])) <= 180.0 for one in found)


def pair_of(sample: TableSample, at: int) -> tuple[FloatArray, FloatArray]:
    """Return latitude and longitude of a column that has both, degrees, shape (n,)."""
    found = [_PAIR.fullmatch(cell) for cell in sample.columns[at]]
    north, east = (np.array([float(one[part]) if one else np.nan for one in found]) for part in (1, 2))
    return north, east


def degrees_of(sample: TableSample, guess: ColumnGuess) -> FloatArray:
    """Return a latitude or longitude in degrees, NaN where it cannot be read, shape (n,)."""
    if guess.unit in ("dms", "ddmm"):
        text = cells.trimmed(arrow.texts(sample.columns[guess.at]))
        read = cells.degrees(text) if guess.unit == "dms" else cells.degrees_and_minutes(text)
        return np.where(read.column.mask, read.column.values, np.nan) * guess.sign
    factor = CONVERSIONS[guess.unit][1] if guess.unit in CONVERSIONS else np.nan
    return sample.numbers(guess.at) * factor * guess.scale * guess.sign


def in_unit(sample: TableSample, guess: ColumnGuess, other: ColumnGuess | None) -> ColumnGuess:
    """Return a latitude or longitude in the unit that its values and the other's show."""
    if guess.is_pair or (guess.unit and guess.unit != "deg"):
        return guess
    most = 90.0 if "latitude" in guess.target else 180.0
    largest = _largest(sample, guess)
    if largest <= most:
        is_told = guess.unit or re.search("[.,]", "".join(sample.filled(guess.at)[:20]))
        return replace(guess, unit="deg", doubt="" if is_told else "degrees assumed")
    if largest > 1e5 and largest <= most * 1e7:
        return replace(guess, unit="deg1e7")
    both = [one for one in (guess, other) if one is not None]
    if all(_is_run_together(sample, one) for one in both):
        doubt = "looks like degrees and minutes run together (ddmm.mmmm)"
        return _with_side(sample, replace(guess, unit="ddmm", doubt=doubt))
    if largest <= most * 60.0 and all(_largest(sample, one) <= 180.0 * 60.0 for one in both):
        return replace(guess, unit="arcmin", doubt="looks like minutes of arc: check the sign of east and west")
    return replace(guess, unit="deg", doubt=f"values beyond {most:g}: not degrees")


def _largest(sample: TableSample, guess: ColumnGuess) -> float:
    values = np.abs(sample.numbers(guess.at))
    known = values[np.isfinite(values)]
    return float(np.percentile(known, 99)) if len(known) else 0.0


def _is_run_together(sample: TableSample, guess: ColumnGuess) -> bool:
    values = np.abs(sample.numbers(guess.at))
    known = values[np.isfinite(values)]
    return len(known) > 0 and float(known.max()) <= 18_060.0 and float(np.max(known % 100.0)) < 60.0


def _with_side(sample: TableSample, guess: ColumnGuess) -> ColumnGuess:
    """Return a guess with the sign that a column of letters gives all rows."""
    plus, minus = _SIDES[guess.target.rpartition(".")[2]]
    for at, name in enumerate(sample.names):
        letters = {cell.upper() for cell in sample.filled(at)}
        if letters and letters <= {plus, minus}:
            if len(letters) > 1:
                return replace(
                    guess, doubt=f"{guess.doubt}; {name!r} has both {plus} and {minus}: no sign fits all rows"
                )
            sign = -1 if letters == {minus} else 1
            return replace(guess, sign=sign, doubt=f"{guess.doubt}; all rows have {letters.pop()} in {name!r}")
    return guess

"""Positions of a table: in one column or two, in which unit, in degrees."""

import re
from dataclasses import replace

import numpy as np

from groundstation.base import arrow_values as arrow
from groundstation.base.angles import FloatArray
from groundstation.base.units import CONVERSIONS
from groundstation.readers import cells
from groundstation.readers.drafts.column import ColumnGuess, both
from groundstation.readers.drafts.sample import TableSample
from groundstation.readers.drafts.words import words_of

_PLACES = frozenset(("position", "location", "coordinates", "coordinate", "coord", "coords", "latlon", "latlng", "gps"))
_PAIR = re.compile(r"\s*(-?\d{1,2}\.\d+)\s*[ ,;]\s*(-?\d{1,3}\.\d+)\s*")
_PADDED = re.compile(r"[+-]?\d{4,5}[.,]\d+")  # degrees and minutes: degrees alone have three digits at most
_WORDS = {"N": "NORTH", "S": "SOUTH", "E": "EAST", "W": "WEST"}
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
        values = np.where(read.column.mask, read.column.values, np.nan) * guess.sign
    else:
        factor = CONVERSIONS[guess.unit][1] if guess.unit in CONVERSIONS else np.nan
        values = (sample.numbers(guess.at) * guess.scale * guess.sign + guess.offset) * factor
    if not guess.side:
        return values
    minus = _SIDES[guess.target.rpartition(".")[2]][1]
    is_minus = [cell[:1].upper() == minus for cell in sample.columns[sample.names.index(guess.side)]]
    return np.where(is_minus, -np.abs(values), values)


def in_unit(
    sample: TableSample, guess: ColumnGuess, other: ColumnGuess | None, *, are_radians: bool = False
) -> ColumnGuess:
    """Return a latitude or longitude in the unit that its values and the other's show."""
    if guess.is_pair:
        return guess
    return _with_side(sample, _in_unit(sample, guess, other, are_radians))


def _in_unit(sample: TableSample, guess: ColumnGuess, other: ColumnGuess | None, are_radians: bool) -> ColumnGuess:
    if guess.unit and guess.unit != "deg":
        return guess
    most = 90.0 if "latitude" in guess.target else 180.0
    largest = _largest(sample, guess)
    is_padded = all(map(_PADDED.fullmatch, sample.filled(guess.at)))
    if largest <= most and not is_padded:
        is_told = guess.unit or re.search("[.,]", "".join(sample.filled(guess.at)[:20]))
        if not guess.unit and _may_be_radians(sample, guess, other):
            if are_radians:
                return replace(guess, unit="rad", doubt="radians, as the angles")
            return replace(guess, unit="deg", doubt="degrees assumed: they may be radians")
        return replace(guess, unit="deg", doubt="" if is_told else "degrees assumed")
    if most == 180.0 and largest <= 360.0 and other is not None and _largest(sample, other) <= 90.0:
        values = sample.numbers(guess.at)
        if np.nanmin(values) > 180.0:
            return replace(guess, unit="deg", offset=-360.0, why="counts from 0 to 360")
        return replace(guess, unit="deg", doubt="counts from 0 to 360: beyond 180 it is none that is read")
    if largest > 1e5 and largest <= most * 1e7:
        return replace(guess, unit="deg1e7")
    both = [one for one in (guess, other) if one is not None]
    if all(_is_run_together(sample, one) for one in both):
        doubt = "looks like degrees and minutes run together (ddmm.mmmm)"
        return replace(guess, unit="ddmm", doubt=doubt)
    if largest <= most * 60.0 and all(_largest(sample, one) <= 180.0 * 60.0 for one in both):
        return replace(guess, unit="arcmin", doubt="looks like minutes of arc: check the sign of east and west")
    return replace(guess, unit="deg", doubt=f"values beyond {most:g}: not degrees")


def _largest(sample: TableSample, guess: ColumnGuess) -> float:
    values = np.abs(sample.numbers(guess.at))
    known = values[np.isfinite(values)]
    return float(np.percentile(known, 99)) if len(known) else 0.0


def _may_be_radians(sample: TableSample, guess: ColumnGuess, other: ColumnGuess | None) -> bool:
    """Tell whether a latitude and a longitude are within half a turn of radians."""
    limits = {"latitude_deg": np.pi / 2.0, "longitude_deg": np.pi}
    both = [one for one in (guess, other) if one is not None]
    sizes = [_largest(sample, one) / limits[one.target.rpartition(".")[2]] for one in both]
    return len(both) == 2 and max(sizes) <= 1.0 and min(sizes) > 0.0


def _is_run_together(sample: TableSample, guess: ColumnGuess) -> bool:
    values = np.abs(sample.numbers(guess.at))
    known = values[np.isfinite(values)]
    return len(known) > 0 and float(known.max()) <= 18_060.0 and float(np.max(known % 100.0)) < 60.0


def _with_side(sample: TableSample, guess: ColumnGuess) -> ColumnGuess:
    """Return a guess with the column of letters that gives its sign."""
    letters = _SIDES[guess.target.rpartition(".")[2]]
    sides = [at for at in range(len(sample.names)) if at != guess.at and _is_of_letters(sample, at, letters)]
    if not sides:
        return guess
    at = min(sides, key=lambda one: (abs(one - guess.at), one < guess.at))  # the letter stands behind as a rule
    name = sample.names[at]
    if name and sample.names.index(name) == at:
        return replace(guess, side=name)
    found = {cell[0].upper() for cell in sample.filled(at)}
    if len(found) > 1:
        doubt = f"column {at + 1} has both {' and '.join(letters)}, and no name of its own: no sign fits all rows"
        return replace(guess, doubt=both(guess.doubt, doubt))
    doubt = f"all rows have {letters[len(found & {letters[1]})]} in column {at + 1}"
    return replace(guess, sign=-1 if letters[1] in found else 1, doubt=both(guess.doubt, doubt))


def _is_of_letters(sample: TableSample, at: int, letters: tuple[str, str]) -> bool:
    filled = {cell.upper() for cell in sample.filled(at)}
    words = {*letters, *(_WORDS[letter] for letter in letters)}
    return bool(filled) and filled <= words

"""Guesses of the columns of a table: by their names, then by their values.

What the values show wins over what is assumed, and what the header tells over both.
"""

import re
from dataclasses import replace
from functools import cached_property

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.signals import Field, field_of
from groundstation.base.units import CONVERSIONS, MPS2_PER_G
from groundstation.readers.drafts.axes import turned
from groundstation.readers.drafts.causes import are_angles, are_run_together, cause_of_numbers
from groundstation.readers.drafts.column import ColumnGuess, both
from groundstation.readers.drafts.motion import Motion, motion_of
from groundstation.readers.drafts.positions import degrees_of, in_unit, is_pair, pair_of
from groundstation.readers.drafts.sample import TableSample
from groundstation.readers.drafts.time_guess import TimeGuess
from groundstation.readers.drafts.words import words_of

_FLAGS = frozenset(("0", "1", "true", "false"))
_FULL_FIELD_NT = 47_000.0  # the field of the Earth is 25 000 to 65 000 nT
_DIRECTIONS = ("true_heading_deg", "magnetic_heading_deg", "track_deg")
_FROM_EAST_DEG = 45.0
_UPRIGHT = 0.7  # share of gravity that an axis has which is called vertical
_LEAST_TURN_DPS = 2.0  # slower turns show no unit of a gyro
_ANGLES = ("roll_deg", "pitch_deg", *_DIRECTIONS)


class Guesses:
    """Guesses of all columns of a table."""

    def __init__(self, sample: TableSample, time: TimeGuess) -> None:
        self._sample, self._time = sample, time
        self._by_target: dict[str, ColumnGuess] = {}

    def columns(self) -> tuple[ColumnGuess, ...]:
        """Return the guess of every column but those of the time."""
        sample, seen = self._sample, set[str]()
        found: dict[int, ColumnGuess] = {}
        for at, name in enumerate(sample.names):
            if not name or at in self._time.columns:
                continue
            guess = self._by_name(at) if name not in seen else ColumnGuess(at, name, why="a name that occurs twice")
            seen.add(name)
            found[at] = guess
            if guess.target:
                other = self._by_target.get(guess.target)
                if other is not None:
                    found[other.at] = replace(ColumnGuess(other.at, other.name), why=f"also {guess.target}")
                self._by_target[guess.target] = guess
        self._drop_parts(found)
        moved = self._motion()
        found |= {one.at: one for one in self._by_target.values()}
        for at, guess in found.items():
            found[at] = self._in_unit(guess, moved) if guess.target else guess
        return tuple(
            replace(
                one,
                values=one.values or self._values(one.at),
                missing=tuple(map(_toml_number, self._sample.number_signs(one.at))),
            )
            for one in found.values()
        )

    def _by_name(self, at: int) -> ColumnGuess:
        sample = self._sample
        name, meaning = sample.names[at], sample.meanings[at]
        left = ColumnGuess(at, name)
        if not any(sample.columns[at]):
            return replace(left, why="empty")
        if "gnss.latitude_deg" not in self._by_target and is_pair(sample, at):
            return replace(left, target="gnss.latitude_deg", unit="deg", is_pair=True)
        if meaning is None or not meaning.field:
            return left
        known = field_of(meaning.topic, meaning.field)
        assert known is not None
        other = self._by_target.get(meaning.target)
        if other is not None and not _is_plainer(name, other.name):
            return replace(left, why=f"also {meaning.target}, which {other.name!r} feeds")
        if known.kind == "bool":
            is_flag = {cell.lower() for cell in sample.filled(at)} <= _FLAGS
            return replace(left, target=meaning.target) if is_flag else left
        if known.unit == "deg" and are_run_together(sample.filled(at)):
            return replace(left, target=meaning.target, sign=meaning.sign, unit="ddmm")
        if known.unit == "deg" and are_angles(sample.filled(at)):
            return replace(left, target=meaning.target, sign=meaning.sign, unit="dms")
        if not sample.is_of_numbers(at):
            cause = cause_of_numbers(sample.filled(at), sample.delimiter) or "cells that are no numbers"
            return replace(left, doubt=f"looks like {meaning.target}, but has {cause}")
        return replace(
            left,
            target=meaning.target,
            sign=meaning.sign,
            unit=meaning.unit,
            scale=meaning.scale,
            is_variance=meaning.is_variance,
        )

    def _drop_parts(self, found: dict[int, ColumnGuess]) -> None:
        """Drop axes of a sensor that lacks others, and a latitude or longitude alone."""
        groups = [
            tuple(f"imu.{kind}_{axis}_{unit}" for axis in "xyz") for kind, unit in (("rate", "dps"), ("accel", "mps2"))
        ]
        groups += [tuple(f"magnetometer.field_{axis}_nt" for axis in ("forward", "right", "down"))]
        groups += [tuple(f"{topic}.{name}_deg" for name in ("latitude", "longitude")) for topic in ("gnss", "ins")]
        for group in groups:
            there = [self._by_target[target] for target in group if target in self._by_target]
            there = [] if any(one.is_pair for one in there) else there
            if 0 < len(there) < len(group):
                for one in there:
                    found[one.at] = ColumnGuess(one.at, one.name, why=f"{one.target} without the others of its kind")
                    del self._by_target[one.target]

    def _motion(self) -> Motion | None:
        """Return the motion of the positions, None where there are none."""
        sizes = [len(block) for block in self._sample.blocks]
        for topic in ("gnss", "ins"):
            north, east = (self._by_target.get(f"{topic}.{name}_deg") for name in ("latitude", "longitude"))
            if north is not None and north.is_pair:
                return motion_of(*pair_of(self._sample, north.at), self._time.seconds, sizes)
            if north is not None and east is not None:
                both = (self._place(north, east), self._place(east, north))
                degrees = [degrees_of(self._sample, one) for one in both]
                moved = motion_of(degrees[0], degrees[1], self._time.seconds, sizes)
                mirrored = motion_of(degrees[0], -degrees[1], self._time.seconds, sizes)
                if both[1].unit != "arcmin" or not self._is_followed(mirrored):
                    return moved
                doubt = "minutes of arc, positive to the west by the heading"
                self._by_target[east.target] = replace(both[1], sign=-1, doubt=doubt)
                return mirrored
        return None

    def _place(self, guess: ColumnGuess, other: ColumnGuess | None) -> ColumnGuess:
        return in_unit(self._sample, guess, other, are_radians=self._are_radians())

    def _is_followed(self, moved: Motion) -> bool:
        """Tell whether a direction that is told in degrees is that of a motion."""
        found = [self._by_target.get(f"{topic}.{name}") for topic in ("gnss", "ins") for name in _DIRECTIONS]
        return any(one is not None and moved.is_followed(self._sample.numbers(one.at)) for one in found)

    def _in_unit(self, guess: ColumnGuess, moved: Motion | None) -> ColumnGuess:
        """Return a guess with its unit: told by the header, shown by the values, or assumed."""
        topic, _, name = guess.target.rpartition(".")
        known = field_of(topic, name)
        assert known is not None
        if known.kind != "double" or not known.unit:
            return guess
        if name in ("latitude_deg", "longitude_deg"):
            other = "latitude_deg" if name == "longitude_deg" else "longitude_deg"
            return self._place(guess, self._by_target.get(f"{topic}.{other}"))
        values = self._sample.numbers(guess.at) * guess.scale
        if name == "ground_speed_mps":
            return self._speed(guess, values, moved)
        if name in _ANGLES:
            return self._angle(guess, values, moved)
        if guess.unit:
            return turned(guess, self._up)
        turn_dps = None if moved is None else moved.turn_dps(self._time.seconds)
        found = _by_turn(guess, self._size(guess), turn_dps) if known.unit == "dps" else None
        found = found or _by_values(guess, known, self._size(guess), self._are_radians())
        return turned(found, self._up)

    def _size(self, guess: ColumnGuess) -> FloatArray:
        """Return the length of the vector whose axis a column is; else the column's own."""
        axes = [
            one
            for target, one in self._by_target.items()
            if target.rpartition("_")[2] == guess.target.rpartition("_")[2]
            and target.partition(".")[0] == guess.target.partition(".")[0]
            and _family(target) == _family(guess.target)
        ]
        if len(axes) < 3:
            return np.abs(self._sample.numbers(guess.at))
        return np.sqrt(sum(self._sample.numbers(one.at) ** 2 for one in axes))

    def _are_radians(self) -> bool:
        """Tell whether the angles are radians: a heading turns and stays within 6.3."""
        for target in (f"{topic}.{name}" for topic in ("ins", "gnss") for name in _DIRECTIONS):
            one = self._by_target.get(target)
            if one is not None:
                if one.unit:
                    return one.unit == "rad"
                values = self._sample.numbers(one.at)
                return bool(np.nanmax(np.abs(values)) <= 6.3 and np.nanmax(values) - np.nanmin(values) > 1.0)
        return False

    def _angle(self, guess: ColumnGuess, values: FloatArray, moved: Motion | None) -> ColumnGuess:
        name = guess.target.rpartition(".")[2]
        if not guess.unit:
            is_rad, largest = self._are_radians(), float(np.nanmax(np.abs(values)))
            if is_rad and largest <= 6.3:
                guess = replace(guess, unit="rad", doubt="radians by their range")
            elif (name in _DIRECTIONS and largest > 6.3) or largest > 3.2:
                guess = replace(guess, unit="deg")
            else:
                guess = replace(guess, unit="deg", doubt="degrees assumed")
        factor = CONVERSIONS[guess.unit][1]
        if name == "true_heading_deg" and moved is not None and moved.is_followed(values * factor):
            doubt = "follows the motion: perhaps a track, gnss.track_deg"
            return replace(guess, doubt="; ".join(filter(None, (guess.doubt, doubt))))
        offset = None if moved is None or name != "true_heading_deg" else moved.against(values * factor)
        if offset is not None:
            is_from_east, is_from_north = abs(offset - 90.0) < _FROM_EAST_DEG, abs(offset) < _FROM_EAST_DEG
            told = "from east" if is_from_east else "from north" if is_from_north else f"from {-offset:.0f} deg"
            doubt = f"turns against the motion: counted anticlockwise {told}"
            return replace(
                guess, sign=-1, offset=90.0 / factor if is_from_east else 0.0, doubt=both(guess.doubt, doubt)
            )
        if name == "true_heading_deg" and "true" not in words_of(guess.name):
            guess = replace(guess, doubt=both(guess.doubt, "true north assumed"))
        has_variation = any(one is not None and one.role == "variation" for one in self._sample.meanings)
        meaning = self._sample.meanings[guess.at]
        if name == "track_deg" and meaning is not None and meaning.is_magnetic:
            return replace(guess, north="magnetic", why=guess.why or "from magnetic north by its header")
        if name == "magnetic_heading_deg" and has_variation and "ins.true_heading_deg" not in self._by_target:
            return replace(guess, target="ins.true_heading_deg", north="magnetic")
        return guess

    def _speed(self, guess: ColumnGuess, values: FloatArray, moved: Motion | None) -> ColumnGuess:
        """Return a speed in the unit that its header tells, else that the positions show."""
        shown = None if moved is None else moved.unit_of_speed(values / guess.scale)
        if shown is None and not guess.unit and "sog" in words_of(guess.name):
            return replace(guess, unit="kt", doubt="knots assumed, as in all that is called SOG")
        if shown is None:
            return guess if guess.unit else replace(guess, unit="mps", doubt="m/s assumed")
        unit, off = shown
        why = f"by the motion of the positions ({off:+.1%})"
        told = "mph" if guess.scale == 0.44704 else guess.unit
        if told and told != unit:
            return replace(guess, doubt=f"its name says {told}, the motion of the positions {unit}")
        if unit == "mph":
            return replace(guess, unit="mps", scale=0.44704, why=f"mph {why}")
        return replace(guess, unit=unit, why=why)

    @cached_property
    def _up(self) -> str | None:
        """Axis along which an accelerometer reads gravity, with its sign; None if none does."""
        axes = {axis: self._by_target.get(f"imu.accel_{axis}_mps2") for axis in "xyz"}
        if None in axes.values():
            return None
        values = {axis: self._sample.numbers(one.at) for axis, one in axes.items() if one is not None}
        size = np.sqrt(sum(one**2 for one in values.values()))
        with np.errstate(invalid="ignore", divide="ignore"):
            shares = {axis: float(np.nanmedian(one / size)) for axis, one in values.items()}
        axis = max(shares, key=lambda one: abs(shares[one]))
        return f"{'+' if shares[axis] > 0 else '-'}{axis}" if abs(shares[axis]) > _UPRIGHT else None

    def _values(self, at: int) -> str:
        sample = self._sample
        if sample.is_of_numbers(at):
            values = sample.numbers(at)
            low, high = f"{np.nanmin(values):.7g}", f"{np.nanmax(values):.7g}"
            return low if low == high else f"{low} to {high}"
        kinds = list(dict.fromkeys(sample.filled(at)))
        shown = ", ".join(_shortened(one) for one in kinds[:3])
        return f"text: {shown}{', ...' if len(kinds) > 3 else ''}" if kinds else ""


def _toml_number(text: str) -> str:
    """Return a number as TOML has it.

    Examples
    --------
    >>> _toml_number("-9999"), _toml_number("9999."), _toml_number("-999,0")
    ('-9999', '9999', '-999')
    """
    return f"{float(text.replace(',', '.')):.12g}"


def _is_plainer(name: str, other: str) -> bool:
    """Tell whether a name says altitude where the other says height."""
    words, others = words_of(name), words_of(other)
    return "height" in others and "altitude" in words + ["altitude"] * ("alt" in words)


def _shortened(text: str) -> str:
    """Return a text of at most 24 characters."""
    plain = " ".join(text.split())
    return plain if len(plain) <= 24 else f"{plain[:21]}..."


def _family(target: str) -> str:
    """Return the quantity of an axis without the axis."""
    return re.sub(r"_(x|y|z|forward|right|down|north|east)_", "_", target)


def _by_turn(guess: ColumnGuess, size: FloatArray, turn_dps: float | None) -> ColumnGuess | None:
    """Return rates in the unit that the turns of the motion show; None where they show none."""
    finite = size[np.isfinite(size)]
    middle = float(np.median(finite)) if len(finite) else 0.0
    if turn_dps is None or turn_dps < _LEAST_TURN_DPS or not middle > 0.0:
        return None
    ratios = {unit: middle * CONVERSIONS[unit][1] / turn_dps for unit in ("dps", "radps")}
    best = min(ratios, key=lambda unit: abs(np.log(ratios[unit])))
    return replace(guess, unit=best, why="by the turns of the motion") if 0.5 < ratios[best] < 3.0 else None


def _by_values(guess: ColumnGuess, known: Field, size: FloatArray, are_radians: bool) -> ColumnGuess:
    """Return a guess whose unit nothing tells, by the size of its values."""
    finite = size[np.isfinite(size)]
    middle = float(np.median(finite)) if len(finite) else 0.0
    if known.unit == "mps2" and "force" in words_of(guess.name):
        return replace(guess, unit="g", why="a force in g by its name")
    if known.unit == "mps2" and middle > 0.0:
        choices = {"mps2": (MPS2_PER_G, 1.0), "g": (1.0, 1.0), "mg": (1000.0, 0.001)}
        best = min(choices, key=lambda one: abs(np.log(middle / choices[one][0])))
        if abs(np.log(middle / choices[best][0])) < 0.3:
            return replace(
                guess, unit="g" if best == "mg" else best, scale=choices[best][1], why="by the size of gravity"
            )
    if known.unit == "nt" and middle > 0.0:
        factors = {"nt": 1.0, "ut": 1e3, "gauss": 1e5, "mgauss": 100.0}
        best = min(factors, key=lambda one: abs(np.log(middle * factors[one] / _FULL_FIELD_NT)))
        if abs(np.log(middle * factors[best] / _FULL_FIELD_NT)) < 0.7:
            return replace(guess, unit=best, why="by the size of the Earth's field")
    if known.unit == "dps":
        unit = "radps" if are_radians or (len(finite) and float(np.percentile(finite, 99)) < 6.0) else "dps"
        return replace(guess, unit=unit, doubt=f"{'rad/s' if unit == 'radps' else 'degrees per second'} assumed")
    return replace(guess, unit=known.unit, doubt=f"{known.unit.replace('mps', 'm/s')} assumed")

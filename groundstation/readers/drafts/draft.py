"""Draft of a profile for a table, by its names, units and values.

What the values show wins over what is assumed, and what the header tells over both. Whatever is assumed carries a
question mark in the draft.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.signals import Field, field_of
from groundstation.base.toml_text import quoted
from groundstation.base.units import CONVERSIONS, MPS2_PER_G
from groundstation.readers.drafts.causes import are_angles, cause_of_numbers
from groundstation.readers.drafts.motion import Motion, motion_of
from groundstation.readers.drafts.sample import TableSample, sample_of
from groundstation.readers.drafts.times import TimeGuess, time_of
from groundstation.readers.drafts.words import words_of
from groundstation.readers.source import Source

MOST_LEFT = 100  # columns left over that the draft lists one by one
_MOST_REQUIRED = 2  # besides the time: another name of any other column is told with the nearest ones
_FLAGS = frozenset(("0", "1", "true", "false"))
_FULL_FIELD_NT = 47_000.0  # the field of the Earth is 25 000 to 65 000 nT
_DIRECTIONS = ("true_heading_deg", "magnetic_heading_deg", "track_deg")
_FROM_EAST_DEG = 45.0
_UPRIGHT = 0.7  # share of gravity that an axis has which is called vertical
# Up axis -> of each axis: the axis forward (x), right (y) or down (z) that it is along, and its sign.
_TURNED: Mapping[str, Mapping[str, tuple[str, int]]] = {
    "+z": {"x": ("x", 1), "y": ("y", -1), "z": ("z", -1)},
    "-z": {"x": ("x", 1), "y": ("y", 1), "z": ("z", 1)},
    "+y": {"z": ("x", -1), "x": ("y", 1), "y": ("z", -1)},
    "-y": {"z": ("x", 1), "x": ("y", 1), "y": ("z", 1)},
    "+x": {"z": ("x", 1), "y": ("y", 1), "x": ("z", -1)},
    "-x": {"y": ("x", 1), "z": ("y", 1), "x": ("z", 1)},
}
_BODY_AXES = {"forward": "x", "right": "y", "down": "z"}
_AXES_TOLD = {
    up: ", ".join(
        f"{'-' * (sign < 0)}{axis}" for _to, sign, axis in sorted((to, sign, axis) for axis, (to, sign) in axes.items())
    )
    for up, axes in _TURNED.items()
}
_ANGLES = ("roll_deg", "pitch_deg", *_DIRECTIONS)


@dataclass(frozen=True)
class ColumnGuess:
    """One column: what it becomes, and why.

    ``target`` is empty where it is left; ``doubt`` is what the user has to look at.
    """

    at: int
    name: str
    target: str = ""
    unit: str = ""
    scale: float = 1.0
    sign: int = 1
    values: str = ""
    why: str = ""
    doubt: str = ""
    north: str = ""
    offset: float = 0.0

    @property
    def line(self) -> str:
        """The line of the draft."""
        scale = f", scale = {self.scale:g}" * (self.scale != 1.0)
        sign = ", sign = -1" * (self.sign < 0)
        unit = f", unit = {quoted(self.unit)}" * bool(self.unit)
        offset = f", offset = {self.offset:.9g}" * bool(self.offset)
        north = f", north = {quoted(self.north)}" * bool(self.north)
        entry = f"{quoted(self.name)} = {{ field = {quoted(self.target)}{unit}{scale}{sign}{offset}{north} }}"
        notes = "; ".join(filter(None, (self.values, self.why, f"? {self.doubt}" if self.doubt else "")))
        return f"{entry}  # {notes}" if notes else entry


@dataclass(frozen=True)
class Draft:
    """Draft of a profile for a table: its text, and what was understood.

    Parameters
    ----------
    text : str
        TOML.
    header : int
        Line of the header row; 0 of a table without one.
    delimiter : str
    time : TimeGuess
    time_names : tuple of str
    columns : tuple of ColumnGuess
        In the order of the file, without those of the time.
    """

    text: str
    header: int
    delimiter: str
    time: TimeGuess
    time_names: tuple[str, ...]
    columns: tuple[ColumnGuess, ...]

    @property
    def understood(self) -> tuple[ColumnGuess, ...]:
        """Columns that become fields."""
        return tuple(one for one in self.columns if one.target)

    @property
    def doubts(self) -> tuple[str, ...]:
        """Lines that tell what the user has to look at."""
        told = [f"time: {self.time.doubt}"] if self.time.doubt else []
        return (*told, *(f"{one.name}: {one.doubt}" for one in self.columns if one.doubt))


def draft_of(source: Source) -> Draft:
    """Return the draft of a profile for a table.

    Raises
    ------
    UnreadableLogError
        When the file is no table, or has no time that can be read; the cause is named.
    """
    sample = sample_of(source)
    time = time_of(sample)
    guesses = _Guesses(sample, time).columns()
    return Draft(
        _text(sample, time, guesses),
        0 if sample.header is None else sample.header.number,
        sample.delimiter,
        time,
        tuple(sample.names[at] for at in time.columns),
        guesses,
    )


class _Guesses:
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
        for at, guess in found.items():
            found[at] = self._in_unit(guess, moved) if guess.target else guess
        return tuple(replace(one, values=one.values or self._values(one.at)) for one in found.values())

    def _by_name(self, at: int) -> ColumnGuess:
        sample = self._sample
        name, meaning = sample.names[at], sample.meanings[at]
        left = ColumnGuess(at, name)
        if not any(sample.columns[at]):
            return replace(left, why="empty")
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
        if known.unit == "deg" and are_angles(sample.filled(at)):
            return replace(left, target=meaning.target, sign=meaning.sign, unit="dms")
        if not sample.is_of_numbers(at):
            cause = cause_of_numbers(sample.filled(at), sample.delimiter)
            return replace(left, doubt=f"looks like {meaning.target}, but has {cause}" if cause else "")
        return replace(left, target=meaning.target, sign=meaning.sign, unit=meaning.unit, scale=meaning.scale)

    def _drop_parts(self, found: dict[int, ColumnGuess]) -> None:
        """Drop axes of a sensor that lacks others, and a latitude or longitude alone."""
        groups = [
            tuple(f"imu.{kind}_{axis}_{unit}" for axis in "xyz") for kind, unit in (("rate", "dps"), ("accel", "mps2"))
        ]
        groups += [tuple(f"magnetometer.field_{axis}_nt" for axis in ("forward", "right", "down"))]
        groups += [tuple(f"{topic}.{name}_deg" for name in ("latitude", "longitude")) for topic in ("gnss", "ins")]
        for group in groups:
            there = [self._by_target[target] for target in group if target in self._by_target]
            if 0 < len(there) < len(group):
                for one in there:
                    found[one.at] = ColumnGuess(one.at, one.name, why=f"{one.target} without the others of its kind")
                    del self._by_target[one.target]

    def _motion(self) -> Motion | None:
        """Return the motion of the positions in degrees, None where there are none."""
        for topic in ("gnss", "ins"):
            pair = [self._by_target.get(f"{topic}.{name}_deg") for name in ("latitude", "longitude")]
            if pair[0] is not None and pair[1] is not None:
                latitude, longitude = (self._sample.numbers(one.at) * self._to_degrees(one) for one in pair if one)
                sizes = [len(block) for block in self._sample.blocks]
                return motion_of(latitude, longitude, self._time.seconds, sizes)
        return None

    def _to_degrees(self, guess: ColumnGuess) -> float:
        unit = self._unit_of_position(guess)[0]
        return CONVERSIONS[unit][1] * guess.scale if unit in CONVERSIONS else np.nan

    def _unit_of_position(self, guess: ColumnGuess) -> tuple[str, str]:
        """Return the unit of a latitude or longitude, and a doubt."""
        if guess.unit and guess.unit != "deg":
            return guess.unit, ""
        most = 90.0 if "latitude" in guess.target else 180.0
        values = self._sample.numbers(guess.at)
        largest = float(np.nanpercentile(np.abs(values), 99))
        if largest <= most:
            if guess.unit or re.search("[.,]", "".join(self._sample.filled(guess.at)[:20])):
                return "deg", ""
            return "deg", "degrees assumed"
        if largest > 1e5 and largest <= most * 1e7:
            return "deg1e7", ""
        if largest <= most * 100 + 60 and float(np.nanmax(np.abs(values) % 100)) < 60.0:
            return "deg", "looks like degrees and minutes run together (ddmm.mmmm): convert it to degrees"
        return "deg", f"values beyond {most:g}: not degrees"

    def _in_unit(self, guess: ColumnGuess, moved: Motion | None) -> ColumnGuess:
        """Return a guess with its unit: told by the header, shown by the values, or assumed."""
        topic, _, name = guess.target.rpartition(".")
        known = field_of(topic, name)
        assert known is not None
        if known.kind != "double" or not known.unit:
            return guess
        values = self._sample.numbers(guess.at) * guess.scale
        if name in ("latitude_deg", "longitude_deg"):
            unit, doubt = self._unit_of_position(guess)
            return replace(guess, unit=unit, doubt=doubt)
        if name == "ground_speed_mps":
            return self._speed(guess, values, moved)
        if name in _ANGLES:
            return self._angle(guess, values, moved)
        if guess.unit:
            return self._turned(guess)
        return self._turned(_by_values(guess, known, self._size(guess), self._are_radians()))

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
            return replace(guess, sign=-1, offset=90.0 / factor if is_from_east else 0.0, doubt=_both(guess, doubt))
        if name == "true_heading_deg" and "true" not in words_of(guess.name):
            guess = replace(guess, doubt=_both(guess, "true north assumed"))
        has_variation = any(one is not None and one.role == "variation" for one in self._sample.meanings)
        if name == "magnetic_heading_deg" and has_variation and "ins.true_heading_deg" not in self._by_target:
            return replace(guess, target="ins.true_heading_deg", north="magnetic")
        return guess

    def _speed(self, guess: ColumnGuess, values: FloatArray, moved: Motion | None) -> ColumnGuess:
        """Return a speed in the unit that its header tells, else that the positions show."""
        shown = None if moved is None else moved.unit_of_speed(values / guess.scale)
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

    def _turned(self, guess: ColumnGuess) -> ColumnGuess:
        """Return an axis of an inertial unit as forward, right or down, by what reads gravity."""
        match = re.fullmatch(r"(imu\.rate|imu\.accel|magnetometer\.field)_([a-z]+)_(\w+)", guess.target)
        if not match:
            return guess
        is_field, up = match[1] == "magnetometer.field", self._up
        if up is None:
            return replace(guess, doubt=_both(guess, "axes forward, right, down assumed"))
        field, sign = _TURNED[up][_BODY_AXES.get(match[2], match[2])]
        names = {axis: name for name, axis in _BODY_AXES.items()}
        target = f"{match[1]}_{names[field] if is_field else field}_{match[3]}"
        reads = f"{up[1]} reads {up[0]}1 g: {_AXES_TOLD[up]} assumed to be forward, right, down"
        return replace(guess, target=target, sign=sign, doubt=_both(guess, reads))

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
        shown = ", ".join(_short(one) for one in kinds[:3])
        return f"text: {shown}{', ...' if len(kinds) > 3 else ''}" if kinds else ""


def _both(guess: ColumnGuess, doubt: str) -> str:
    return f"{guess.doubt}; {doubt}" if guess.doubt else doubt


def _is_plainer(name: str, other: str) -> bool:
    """Tell whether a name says altitude where the other says height."""
    words, others = words_of(name), words_of(other)
    return "height" in others and "altitude" in words + ["altitude"] * ("alt" in words)


def _short(text: str) -> str:
    plain = " ".join(text.split())
    return plain if len(plain) <= 24 else f"{plain[:21]}..."


def _family(target: str) -> str:
    """Return the quantity of an axis without the axis."""
    return re.sub(r"_(x|y|z|forward|right|down|north|east)_", "_", target)


def _by_values(guess: ColumnGuess, known: Field, size: FloatArray, are_radians: bool) -> ColumnGuess:
    """Return a guess whose unit nothing tells, by the size of its values."""
    finite = size[np.isfinite(size)]
    middle = float(np.median(finite)) if len(finite) else 0.0
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


def _text(sample: TableSample, time: TimeGuess, columns: Sequence[ColumnGuess]) -> str:
    """Return the draft as TOML."""
    used = [one for one in columns if one.target]
    left = [one for one in columns if not one.target]
    return "\n".join(
        (
            f"# Draft by `groundstation profile new` for {_comment(sample.name)}.",
            "# Look at each line with a question mark.",
            "# docs/profiles.md has every key; `groundstation profile check` shows what each column becomes.",
            f"name = {quoted(_name_of(sample.name))}",
            *_signs(sample, used),
            "",
            *_recognise(sample, time, used),
            "",
            *(f"# ? {time.doubt}" for _ in range(bool(time.doubt))),
            f"[time]  # {_comment(time.why)}",
            *time.lines,
            *_key(sample),
            *_variation(sample, used),
            "",
            "[columns]",
            *(_comment_line(one.line) for one in used),
            *_derived(used),
            *_rest(left),
            "",
        )
    )


def _recognise(sample: TableSample, time: TimeGuess, used: Sequence[ColumnGuess]) -> Iterator[str]:
    yield "[recognise]"
    if sample.header is None:
        yield "# ? the table names no columns: put the right names here, and below"
        yield f"names = [{', '.join(map(quoted, sample.names))}]"
        return
    places = [one.name for one in used if one.target.endswith(("latitude_deg", "longitude_deg"))]
    needed = (places or [one.name for one in used])[:_MOST_REQUIRED]
    names = [*(sample.names[at] for at in time.columns[:2]), *needed]
    yield f"columns = [{', '.join(map(quoted, dict.fromkeys(names)))}]"
    if sample.is_spaced:
        yield 'delimiter = "blanks"'
    if sample.behind:
        yield f"rows_after_header = {len(sample.behind)}"
    if sample.header.text.startswith("#"):
        yield "header_tells = true"


def _key(sample: TableSample) -> Iterator[str]:
    """Yield the column that tells several vehicles apart."""
    for at, meaning in enumerate(sample.meanings):
        if meaning is not None and meaning.role == "key" and len(set(sample.filled(at))) > 1:
            yield from (
                "",
                "[key]  # ? several vehicles, each a flight of its own",
                f"column = {quoted(sample.names[at])}",
            )
            return


def _signs(sample: TableSample, used: Sequence[ColumnGuess]) -> Iterator[str]:
    """Yield the signs for missing values in the columns that become fields."""
    found = sorted({sign for one in used for sign in sample.signs(one.at)})
    if found:
        yield f"missing = [{', '.join(map(quoted, found))}]"


def _variation(sample: TableSample, used: Sequence[ColumnGuess]) -> Iterator[str]:
    at = next((at for at, one in enumerate(sample.meanings) if one is not None and one.role == "variation"), None)
    if at is not None and any(one.north for one in used):
        yield from ("", "[variation]  # ? positive east assumed", f"column = {quoted(sample.names[at])}")


def _derived(used: Sequence[ColumnGuess]) -> Iterator[str]:
    """Yield velocities from track and ground speed, where a receiver has no others."""
    targets = {one.target for one in used}
    if {"gnss.track_deg", "gnss.ground_speed_mps"} <= targets and "gnss.velocity_north_mps" not in targets:
        yield from ("", "[[derived]]", 'topic = "gnss"', 'method = "velocity_from_track"')
        yield from ('track = "gnss.track_deg"', 'speed = "gnss.ground_speed_mps"')


def _rest(left: Sequence[ColumnGuess]) -> Iterator[str]:
    """Yield the columns left over, as comments."""
    if not left:
        return
    yield from ("", "# Left, and kept as they are:")
    for one in left[:MOST_LEFT]:
        notes = "; ".join(filter(None, (one.values, one.why, one.doubt)))
        yield _comment_line(f"# {quoted(one.name)}" + (f"  # {notes}" if notes else ""))
    if len(left) > MOST_LEFT:
        yield f"# ... and {len(left) - MOST_LEFT} more"


def _comment(text: str) -> str:
    """Return a text that may stand in a comment: no control characters."""
    return "".join(one if one.isprintable() else "?" for one in text)


def _comment_line(line: str) -> str:
    before, sign, after = line.partition("  # ")
    return before + sign + _comment(after)


def _name_of(file_name: str) -> str:
    """Return the name of a profile after a file.

    Examples
    --------
    >>> _name_of("Flight 3 (log).csv"), _name_of(".csv")
    ('flight-3-log', 'csv')
    """
    stem = Path(file_name).stem.lower()
    return "-".join(re.findall(r"[a-z0-9]+", stem))[:40] or "table"


def facts_of(draft: Draft) -> Mapping[str, object]:
    """Return what a draft understood as plain values."""
    return {
        "header_row": draft.header,
        "delimiter": draft.delimiter,
        "time": {"columns": list(draft.time_names), "why": draft.time.why, "doubt": draft.time.doubt},
        "columns": [
            {
                "name": one.name,
                "field": one.target,
                "unit": one.unit,
                "scale": one.scale,
                "sign": one.sign,
                "offset": one.offset,
                "values": one.values,
                "why": one.why,
                "doubt": one.doubt,
            }
            for one in draft.columns
        ],
        "profile": draft.text,
    }

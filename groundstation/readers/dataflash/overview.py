"""First pass over a log: units, parameters, firmware, satellite time, sensors, states.

The states are those that last until the next record of them.
"""

from collections.abc import Callable, Mapping
from dataclasses import field
from typing import Any

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.geodesy import has_position
from groundstation.base.records import BoolArray, Damage, Int64Array
from groundstation.base.sorted_values import distinct
from groundstation.readers.dataflash.blocks import RecordBlock, Scanner
from groundstation.readers.dataflash.definitions import RecordDefinition, Units
from groundstation.readers.dataflash.rules import FIX_3D, SIGMAS, FieldRule, UnknownUnits
from groundstation.readers.dataflash.values import RecordRows, by_instance, rows_of

MESSAGES_KEPT = 100
MOST_INSTANCES = 32  # more values than that tell no sensors apart
EV_LANDED, EV_NOT_LANDED = 18, 28
_GPS_TYPES = ("GPS", "GPS2")
_ACCURACY_TYPES = {"GPA": "GPS", "GPA2": "GPS2"}
_ARRIVAL, NS_PER_MS = "SMS", 1e6  # milliseconds since power-up at which the message of a fix was there
_EKF_STATUS_TYPES = ("EKF4", "NKF4", "XKF4")
_SECOND_STATUS_TYPES = ("NKF9", "XKF9")  # of the second core, in old firmware
_NOT_INITIALISED = 7  # bit of FS: the filter has no states yet, and writes zeros (NavEKF3_core::getFilterFaults)

Unit = tuple[str, int | None]  # type and instance: one sensor


@dataclass(frozen=True, eq=False)
class States:
    """State that lasts until its next record: the places where it was logged, and its values."""

    record_index: Int64Array = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    values: Int64Array = field(default_factory=lambda: np.zeros(0, dtype=np.int64))

    def at(self, record_index: Int64Array, before: int) -> Int64Array:
        """Return the state at places in the log; ``before`` where none was logged yet."""
        at = np.searchsorted(self.record_index, record_index, side="right")
        return np.concatenate(([before], self.values))[at]

    @property
    def first(self) -> int:
        """The first state that was logged, -1 when none was."""
        return int(self.values[0]) if len(self.values) else -1


@dataclass(frozen=True, eq=False)
class GpsTimes:
    """Fixes with a time, of all receivers.

    Each has its GPS week, milliseconds of the week, the autopilot's clock, and the place.
    """

    week: Int64Array = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    week_ms: Int64Array = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    device_ns: Int64Array = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    record_index: Int64Array = field(default_factory=lambda: np.zeros(0, dtype=np.int64))


@dataclass(frozen=True, eq=False)
class DataflashOverview:
    """Contents of a log, by the first pass over it.

    Parameters
    ----------
    units : Units
    types : mapping of str to RecordDefinition
        Types that have records which can be read, by name.
    sensors : tuple of (type, instance)
        Each type that has records; several entries where it has an instance field.
    split : set of (type id, name)
        The types whose records are told apart by their instance field.
    parameters : mapping of str to float
        The last value of each.
    messages : tuple of str
        The first texts that the autopilot wrote.
    gps_times : GpsTimes
    has_fix : bool
        Whether any receiver had a position.
    sigmas : mapping of receiver to (times in ns, values by field)
        What the receiver says of its own errors, logged in a record of its own.
    arrivals : mapping of receiver to (times in ns, arrivals in ns)
        When the message of a fix came, logged beside its errors.
    primary_core : mapping of EKF status type to States
        Which of the filter's cores was in use.
    unready : mapping of EKF status sensor to States
        1 while that core of the filter said that it is not initialised. A status holds for the records before it, back
        to the status before: a core writes it behind them.
    attitude_by : States
        Number of the estimator that gave the attitude (ATT.AEKF).
    landed : States
        1 landed, 0 not, as the land detector's events say.
    damages : tuple of Damage
    counts : mapping of str to int
        Records of each type, of all its instances.
    """

    units: Units
    types: Mapping[str, RecordDefinition]
    sensors: tuple[Unit, ...]
    split: frozenset[tuple[int, str]]
    parameters: Mapping[str, float]
    messages: tuple[str, ...]
    gps_times: GpsTimes
    has_fix: bool
    sigmas: Mapping[Unit, tuple[Int64Array, Mapping[str, FloatArray]]]
    arrivals: Mapping[Unit, tuple[Int64Array, FloatArray]]
    primary_core: Mapping[str, States]
    unready: Mapping[Unit, States]
    attitude_by: States
    landed: States
    damages: tuple[Damage, ...]
    counts: Mapping[str, int]


def overview(scanner: Scanner) -> DataflashOverview:
    """Read a log once and return its contents.

    The memory it takes does not grow with the file, but for GPS records.
    """
    survey = _Survey()
    for block in scanner:
        survey.add(block)
    return survey.result(scanner)


class _Survey:
    """Collector of an :class:`DataflashOverview`, block by block."""

    def __init__(self) -> None:
        self._units = Units()
        self._definitions: Mapping[int, RecordDefinition] = {}  # in force in the block at hand
        self._types: dict[str, RecordDefinition] = {}
        self._counts: dict[str, int] = {}
        self._instances: dict[tuple[int, str], set[int]] = {}
        self._parameters: dict[str, float] = {}
        self._messages: list[str] = []
        self._gps: list[tuple[Any, ...]] = []
        self._has_fix = False
        self._sigma: dict[Unit, list[tuple[Int64Array, dict[str, FloatArray]]]] = {}
        self._arrivals: dict[Unit, list[tuple[Int64Array, FloatArray]]] = {}
        self._unknown = UnknownUnits()
        self._cores: dict[str, list[tuple[Any, Any]]] = {}
        self._unready: dict[Unit, list[tuple[Any, Any]]] = {}
        self._last_status: dict[Unit, int] = {}
        self._attitude_by: list[tuple[Any, Any]] = []
        self._landed: list[tuple[Any, Any]] = []
        self._unread: dict[str, tuple[int, str]] = {}
        self._takers: dict[str, Callable[[RecordRows], None]] = {
            "UNIT": self._unit,
            "MULT": self._multiplier,
            "FMTU": self._field_units,
            "PARM": self._parameter,
            "MSG": self._message,
            "VER": self._version,
            "EV": self._event,
            **dict.fromkeys(_GPS_TYPES, self._fixes),
            **dict.fromkeys(_ACCURACY_TYPES, self._accuracy),
            **dict.fromkeys((*_EKF_STATUS_TYPES, *_SECOND_STATUS_TYPES), self._status),
            "ATT": self._attitude,
        }

    def add(self, block: RecordBlock) -> None:
        """Take in one block; units first, as they tell the field of instances."""
        self._definitions = block.definitions
        groups = sorted(block.groups(), key=lambda group: group[0].name not in ("UNIT", "MULT", "FMTU"))
        for definition, which in groups:
            name = definition.name
            if definition.fault:
                count = self._unread.get(name, (0, ""))[0]
                self._unread[name] = (count + len(which), definition.fault)
                continue
            self._types.setdefault(name, definition)
            self._counts[name] = self._counts.get(name, 0) + len(which)
            instance_field = self._units.instance_field(definition)
            if name not in self._takers and instance_field is None:
                self._instances.setdefault((definition.type_id, name), set())
                continue
            rows = rows_of(definition, block.records(definition, which), block.first_index + which)
            seen = self._instances.setdefault((definition.type_id, name), set())
            if instance_field is not None and len(seen) <= MOST_INSTANCES:
                seen.update(distinct(rows.values(instance_field)).tolist())
            if name in self._takers:
                self._takers[name](rows)

    def result(self, scanner: Scanner) -> DataflashOverview:
        """Return the contents found."""
        split = frozenset(key for key, seen in self._instances.items() if 0 < len(seen) <= MOST_INSTANCES)
        sensors: list[Unit] = []
        for key, seen in self._instances.items():
            sensors += [(key[1], value) for value in sorted(seen)] if key in split else [(key[1], None)]
        return DataflashOverview(
            units=self._units,
            types=self._types,
            sensors=tuple(sensors),
            split=split,
            parameters=self._parameters,
            messages=tuple(self._messages),
            gps_times=GpsTimes(*(_joined([part[n] for part in self._gps]) for n in range(4))),
            has_fix=self._has_fix,
            sigmas={unit: _sorted_pairs(parts) for unit, parts in self._sigma.items()},
            arrivals={unit: _sorted(parts) for unit, parts in self._arrivals.items()},
            primary_core={name: _states(parts) for name, parts in self._cores.items()},
            unready={unit: _states(parts) for unit, parts in self._unready.items()},
            attitude_by=_states(self._attitude_by),
            landed=_states(self._landed),
            damages=(*scanner.spans.damages(), *self._more_damages(scanner), *self._unknown.damages()),
            counts=self._counts,
        )

    def _more_damages(self, scanner: Scanner) -> list[Damage]:
        found = [
            Damage("dropped_channel", f"type {name}", count, f"records that cannot be read: {fault}", f"raw.{name}")
            for name, (count, fault) in self._unread.items()
        ]
        for place, refused in scanner.refused:
            what = f"definitions of a type {refused.name} that contradict records met before, left out"
            found.append(Damage("corrupt", f"byte {place}", 1, what))
        if scanner.refused_more:
            what = "more definitions that contradict others, left out"
            found.append(Damage("corrupt", f"behind byte {scanner.refused[-1][0]}", scanner.refused_more, what))
        return found

    def _unit(self, rows: RecordRows) -> None:
        if rows.definition.has_integers("Id") and rows.definition.has_texts("Label"):
            for code, text in zip(rows.values("Id").tolist(), rows.values("Label").tolist(), strict=True):
                self._units.texts[_character(code)] = str(text).strip()

    def _multiplier(self, rows: RecordRows) -> None:
        if rows.definition.has_integers("Id") and rows.definition.has_numbers("Mult"):
            for code, value in zip(rows.values("Id").tolist(), rows.values("Mult").tolist(), strict=True):
                self._units.multipliers[_character(code)] = float(f"{value:.7g}")  # single precision, logged as double

    def _field_units(self, rows: RecordRows) -> None:
        if rows.definition.has_integers("FmtType") and rows.definition.has_texts("UnitIds", "MultIds"):
            columns = (rows.values(name).tolist() for name in ("FmtType", "UnitIds", "MultIds"))
            for type_id, unit_ids, multiplier_ids in zip(*columns, strict=True):
                if type_id in self._definitions:
                    self._units.of_definition[self._definitions[type_id]] = (unit_ids, multiplier_ids)

    def _parameter(self, rows: RecordRows) -> None:
        if rows.definition.has_texts("Name") and rows.definition.has_numbers("Value"):
            names, values = rows.values("Name").tolist(), rows.values("Value").tolist()
            self._parameters.update(dict(zip(names, values, strict=True)))

    def _message(self, rows: RecordRows) -> None:
        if rows.definition.has_texts("Message"):
            self._messages += rows.values("Message")[: MESSAGES_KEPT - len(self._messages)].tolist()

    def _version(self, rows: RecordRows) -> None:
        if rows.definition.has_texts("FWS"):
            self._messages.insert(0, str(rows.values("FWS")[0]))

    def _event(self, rows: RecordRows) -> None:
        if rows.definition.has_integers("Id"):
            values = rows.values("Id")
            of_land = (values == EV_LANDED) | (values == EV_NOT_LANDED)
            self._landed.append((rows.record_index[of_land], values[of_land] == EV_LANDED))

    def _fixes(self, rows: RecordRows) -> None:
        definition = rows.definition
        names = next((pair for pair in (("GWk", "GMS"), ("Week", "TimeMS")) if definition.has_integers(*pair)), None)
        fixed = _fixed(rows)
        self._has_fix |= bool(fixed.any())
        if names is not None:
            timed = fixed & rows.time_ns.mask
            week, week_ms = (rows.values(name).astype(np.int64)[timed] for name in names)
            self._gps.append((week, week_ms, rows.time_ns.values[timed], rows.record_index[timed]))

    def _accuracy(self, rows: RecordRows) -> None:
        instance_field = self._units.instance_field(rows.definition)
        factors: dict[FieldRule, float] = {}
        for rule in SIGMAS:
            factor = rule.scale(rows.definition, self._units) if rows.definition.has_numbers(rule.source) else None
            if factor is not None:
                factors[rule] = factor
            elif rows.definition.has_numbers(rule.source):
                self._unknown.add(rule, rows.definition, self._units, len(rows), "gnss")
        has_arrivals = rows.definition.has_integers(_ARRIVAL)
        if not factors and not has_arrivals:
            return
        for part in by_instance(rows, instance_field) if instance_field else (rows,):
            receiver = (_ACCURACY_TYPES[rows.definition.name], part.instance)
            if has_arrivals:
                arrived_ns = part.doubles(_ARRIVAL) * NS_PER_MS
                self._arrivals.setdefault(receiver, []).append((part.time_ns.values, arrived_ns))
            if not factors:
                continue
            sigmas = {rule.field: part.doubles(rule.source) * factor for rule, factor in factors.items()}
            self._sigma.setdefault(receiver, []).append((part.time_ns.values, sigmas))

    def _status(self, rows: RecordRows) -> None:
        definition = rows.definition
        if definition.name in _EKF_STATUS_TYPES and definition.has_integers("PI"):
            self._cores.setdefault(definition.name, []).append(_changes(rows, rows.values("PI")))
        if definition.has_integers("FS"):
            instance_field = self._units.instance_field(definition)
            for part in by_instance(rows, instance_field) if instance_field else (rows,):
                self._add_unready((definition.name, part.instance), part)

    def _add_unready(self, core: Unit, rows: RecordRows) -> None:
        """Add from where on a core was initialised, or no more.

        That is behind its last status of another state.
        """
        state = rows.values("FS").astype(np.int64) >> _NOT_INITIALISED & 1
        begins = np.concatenate(([self._last_status.get(core, -1)], rows.record_index[:-1])) + 1
        changed = np.flatnonzero(np.diff(state, prepend=-1))
        self._unready.setdefault(core, []).append((begins[changed], state[changed]))
        self._last_status[core] = int(rows.record_index[-1])

    def _attitude(self, rows: RecordRows) -> None:
        if rows.definition.has_integers("AEKF"):
            self._attitude_by.append(_changes(rows, rows.values("AEKF")))


def _changes(rows: RecordRows, values: Any) -> tuple[Int64Array, Int64Array]:
    """Return the records at which a state changes, and the state."""
    numbers = values.astype(np.int64)
    changed = np.flatnonzero(np.diff(numbers, prepend=-1))
    return rows.record_index[changed], numbers[changed]


def _character(code: int) -> str:
    """The character of a unit's id, which is logged as a number."""
    return chr(code & 0xFF)


def _joined(parts: list[Any]) -> Int64Array:
    return np.concatenate(parts).astype(np.int64) if parts else np.zeros(0, dtype=np.int64)


def _states(parts: list[tuple[Any, Any]]) -> States:
    return States(_joined([index for index, _values in parts]), _joined([values for _index, values in parts]))


def _fixed(rows: RecordRows) -> BoolArray:
    """Return which records of a receiver have a 3D fix.

    A record of a type without a status has one where it has a position.
    """
    if rows.definition.has_numbers("Status"):
        return np.asarray(rows.values("Status") >= FIX_3D)
    if rows.definition.has_numbers("Lat", "Lng"):
        return has_position(rows.values("Lat"), rows.values("Lng"))
    return np.zeros(len(rows), dtype=bool)


def _sorted(parts: list[tuple[Int64Array, FloatArray]]) -> tuple[Int64Array, FloatArray]:
    times, values = (np.concatenate(several) for several in zip(*parts, strict=True))
    order = np.argsort(times, kind="stable")
    return times[order], values[order]


def _sorted_pairs(
    parts: list[tuple[Int64Array, dict[str, FloatArray]]],
) -> tuple[Int64Array, Mapping[str, FloatArray]]:
    times = np.concatenate([time for time, _values in parts])
    order = np.argsort(times, kind="stable")
    names = dict.fromkeys(name for _time, values in parts for name in values)
    columns = {
        name: np.concatenate([values.get(name, np.full(len(time), np.nan)) for time, values in parts])[order]
        for name in names
    }
    return times[order], columns

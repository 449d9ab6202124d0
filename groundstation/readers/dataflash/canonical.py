"""Canonical topics from the records of a block.

These are ins, gnss, magnetometer, baro, air, electric and discrete.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import FloatArray, wrap_360
from groundstation.base.ardupilot_codes import EVENTS, MODES, error_name, error_severity, event_severity, mode_severity
from groundstation.base.atmosphere import REFUSED, pressure_altitude_m
from groundstation.base.geodesy import has_position
from groundstation.base.log_levels import severity_of_text
from groundstation.base.records import BoolArray, Column, Damage, Int64Array, RecordBatch, Remark, frozen
from groundstation.readers import imu
from groundstation.readers.dataflash import rules
from groundstation.readers.dataflash.choices import Choices
from groundstation.readers.dataflash.overview import DataflashOverview, Unit
from groundstation.readers.dataflash.rules import FIX_2D, FIX_3D, FieldRule, UnknownUnits
from groundstation.readers.dataflash.values import RecordRows
from groundstation.readers.layout import velocity_from_track
from groundstation.readers.mapping import named
from groundstation.readers.parts import TopicPart, bounded, merged, occupied, sampled_ns
from groundstation.readers.places import nowhere, unready_filter

RANGE_GOOD, FACING_DOWN = 4, 25


class Mapper:
    """Gatherer of the canonical records of a block; yields them merged, in file order.

    Parameters
    ----------
    found : DataflashOverview
    choices : Choices
        Which of several sources a field is taken from.
    """

    def __init__(self, found: DataflashOverview, choices: Choices) -> None:
        self._found, self._choices = found, choices
        self._parts: dict[str, list[TopicPart]] = {}
        self.fields: dict[str, dict[str, None]] = {}  # fields that were yielded, for the remarks
        self._refused: dict[tuple[str, str], int] = {}
        self._nowhere: Counter[str] = Counter()
        self._unready: Counter[tuple[str, str]] = Counter()
        self._unknown = UnknownUnits()
        self._passed_over: dict[tuple[str, str], tuple[float, str]] = {}
        self._takers = self._all_takers()

    def take(self, rows: RecordRows) -> None:
        """Take in the rows of one sensor; types that map to nothing are passed over."""
        for topic, columns_of in self._takers.get((rows.definition.name, rows.instance), ()):
            validity_ns = self._validity_ns(topic, rows)
            source = rows.definition.name if rows.instance is None else f"{rows.definition.name}.{rows.instance}"
            part = occupied(TopicPart(rows.record_index, rows.time_ns, columns_of(topic, rows), validity_ns, source))
            if part is not None and len(part.index):
                self._parts.setdefault(topic, []).append(part)

    def batches(self) -> Iterator[RecordBatch]:
        """Yield the records taken in since the last call."""
        parts, self._parts = self._parts, {}
        for topic, of_topic in sorted(parts.items()):
            for piece in bounded(merged(topic, of_topic)):
                self.fields.setdefault(topic, {}).update(dict.fromkeys(piece.columns))
                yield piece

    def damages(self) -> Iterator[Damage]:
        """Yield counts of refused values; the log's own values are kept.

        Refused are pressures and positions that are none, and values in unknown units.
        """
        for (topic, what), count in self._refused.items():
            yield Damage("unreadable_cells", topic, count, what, topic, loses_data=False)
        yield from (nowhere(topic, count) for topic, count in self._nowhere.items() if count)
        unready = {key: count for key, count in self._unready.items() if count}
        if unready:
            records = " and ".join(dict.fromkeys(name for _topic, name in unready))
            yield unready_filter(next(iter(unready))[0], sum(unready.values()), records)
        yield from self._unknown.damages()

    def remarks(self) -> Iterator[Remark]:
        """Yield remarks on multipliers of floats that were passed over."""
        for (topic, field), (multiplier, source) in self._passed_over.items():
            text = (
                f"{source} is a float in its unit; the multiplier {multiplier:g} that the log gives it is not applied"
            )
            yield Remark("converted", text, topic, (field,))

    def _refuse(self, topic: str, what: str, count: int) -> None:
        if count:
            self._refused[topic, what] = self._refused.get((topic, what), 0) + count

    def _all_takers(self) -> Mapping[Unit, list[tuple[str, Callable[[str, RecordRows], dict[str, Column]]]]]:
        """Return, for each sensor, its topics and the functions that make their columns."""
        choices = self._choices
        takers: dict[Unit, list[tuple[str, Callable[[str, RecordRows], dict[str, Column]]]]] = {}

        def add(unit: Unit, topic: str, columns_of: Callable[[str, RecordRows], dict[str, Column]]) -> None:
            takers.setdefault(unit, []).append((topic, columns_of))

        by_kind = {
            "gnss": self._gnss,
            "magnetometer": self._magnetometer,
            "baro": self._baro,
            "electric": self._plain(rules.CURRENT),
            "radio_altimeter": self._height,
        }
        for unit, topic in choices.sensor_topics.items():
            add(unit, topic, by_kind[topic.partition(".")[0]])
        for unit, topic in choices.imu_topics.items():
            add(unit, topic, self._increments if unit[0] in rules.IMU_TYPES[0][0] else self._samples)
        add(("ATT", None), "ins", self._attitude)
        add(("AHR2", None), "ins.2", self._backup)
        add(("POS", None), "ins", self._position)
        add(("ATT", None), "discrete", self._landed)
        for unit in choices.rates:
            add(unit, "ins", self._plain((*rules.RATES, *rules.ACCELERATIONS)))
        for unit, core in choices.ekf_velocity.items():
            for topic, is_used in (("ins", True), ("ins.2", False)):
                if choices.ekf_flew in (None, is_used):
                    add(unit, topic, self._of_core(core, rules.VELOCITY, is_solution=True, is_used=is_used))
        for unit, core in choices.ekf_wind.items():
            add(unit, "air", self._of_core(core, rules.WIND, is_solution=False))
        for name in ("EV", "ARM", "MODE", "MSG", "ERR"):
            add((name, None), "event", self._event)
        return takers

    def _values(self, topic: str, rows: RecordRows, wanted: tuple[FieldRule, ...]) -> dict[str, FloatArray]:
        """Return the values of the rules whose field the type has, in canonical units.

        A field in an unknown unit has none.
        """
        found = {}
        definition, units = rows.definition, self._found.units
        for rule in wanted:
            if not definition.has_numbers(rule.source):
                continue
            factor = rule.scale(definition, units)
            if factor is None:
                self._unknown.add(rule, definition, units, len(rows), topic)
                continue
            passed_over = rule.passed_over(definition, units)
            if passed_over is not None:
                self._passed_over[topic, rule.field] = (passed_over, f"{definition.name}.{rule.source}")
            found[rule.field] = rows.doubles(rule.source, factor)
        return found

    def _placed(self, topic: str, values: Mapping[str, FloatArray], claimed: BoolArray | bool = True) -> BoolArray:
        """Return which of the records that claim a position have one.

        Zeros in place of a position are counted as missing; a NaN stays a NaN.
        """
        latitude, longitude = values["latitude_deg"], values["longitude_deg"]
        placed = has_position(latitude, longitude) | np.isnan(latitude) | np.isnan(longitude)
        self._nowhere[topic] += int(np.count_nonzero(claimed & ~placed))
        return frozen(claimed & placed)

    def _plain(self, wanted: tuple[FieldRule, ...]) -> Callable[[str, RecordRows], dict[str, Column]]:
        def columns_of(topic: str, rows: RecordRows) -> dict[str, Column]:
            return {name: Column(values) for name, values in self._values(topic, rows, wanted).items()}

        return columns_of

    def _with_mode(self, rows: RecordRows, columns: dict[str, Column]) -> dict[str, Column]:
        return {**columns, "mode": self._mode(rows, None)} if columns else {}

    def _mode(self, rows: RecordRows, present: BoolArray | None) -> Column:
        return Column(np.broadcast_to(self._choices.mode, len(rows)), present)

    def _attitude(self, topic: str, rows: RecordRows) -> dict[str, Column]:
        values = self._values(topic, rows, (*rules.ATTITUDE, self._choices.yaw))
        if self._choices.yaw.field in values:
            values[self._choices.yaw.field] = wrap_360(values[self._choices.yaw.field])
        return self._with_mode(rows, {name: Column(column) for name, column in values.items()})

    def _position(self, topic: str, rows: RecordRows) -> dict[str, Column]:
        values = self._values(topic, rows, rules.POSITION)
        if not {"latitude_deg", "longitude_deg"} <= values.keys():
            return {}
        known = self._placed(topic, values)
        return self._with_mode(rows, {name: Column(column, known) for name, column in values.items()})

    def _backup(self, topic: str, rows: RecordRows) -> dict[str, Column]:
        return {**self._attitude(topic, rows), **self._position(topic, rows)}

    def _of_core(
        self, core: int | None, wanted: tuple[FieldRule, ...], is_solution: bool, is_used: bool = True
    ) -> Callable[[str, RecordRows], dict[str, Column]]:
        """Return the function for columns of a filter core that is in use and initialised.

        Until the log tells the core in use, it is the first one that it tells. ``is_used`` false: while another
        estimator gave the attitude.
        """
        primary = self._choices.primary_core

        def columns_of(topic: str, rows: RecordRows) -> dict[str, Column]:
            values = self._values(topic, rows, wanted)
            wrong = self._choices.flies(rows.record_index) != is_used
            if core is not None:
                wrong |= primary.at(rows.record_index, before=primary.first) != core
            unready = self._unready_at(rows) & ~wrong
            self._unready[topic, rows.definition.name] += int(np.count_nonzero(unready)) if values else 0
            used = frozen(~(wrong | unready)) if (wrong | unready).any() else None
            columns = {name: Column(column, used) for name, column in values.items()}
            if is_solution and columns:
                columns["mode"] = self._mode(rows, used)
            return columns

        return columns_of

    def _unready_at(self, rows: RecordRows) -> BoolArray:
        """Tell which records a core of the filter wrote before it had states, shape (n,)."""
        name, instance = rows.definition.name, rows.instance
        status = f"{name[:3]}{rules.STATUS_OF[name[3]]}"
        states = self._found.unready.get((status, instance), self._found.unready.get((status, None)))
        if states is None:
            return np.zeros(len(rows), dtype=bool)
        return np.asarray(states.at(rows.record_index, before=states.first) == 1)

    def _gnss(self, topic: str, rows: RecordRows) -> dict[str, Column]:
        position, motion = self._values(topic, rows, rules.POSITION), self._values(topic, rows, rules.GNSS_VELOCITY)
        everywhere = np.ones(len(rows), dtype=bool)
        has_status = rows.definition.has_numbers("Status")
        has_2d, has_3d = (
            frozen(rows.values("Status") >= least if has_status else everywhere) for least in (FIX_2D, FIX_3D)
        )
        placed = has_2d
        if {"latitude_deg", "longitude_deg"} <= position.keys():
            placed = self._placed(topic, position, has_2d)
        if not has_status:  # without a status, a record with a position has a fix
            has_2d = has_3d = placed
        placed_3d = frozen(placed & has_3d)
        columns = {
            name: Column(values, placed_3d if name == "altitude_msl_m" else placed) for name, values in position.items()
        }
        if "track_deg" in motion:
            motion["track_deg"] = wrap_360(motion["track_deg"])
        if {"track_deg", "ground_speed_mps"} <= motion.keys():
            velocity = velocity_from_track(motion["track_deg"], motion["ground_speed_mps"])
            motion["velocity_north_mps"], motion["velocity_east_mps"] = velocity
        columns |= {name: Column(values, has_3d) for name, values in motion.items()}
        columns |= {
            name: Column(values, has_2d) for name, values in self._values(topic, rows, rules.GNSS_QUALITY).items()
        }
        columns |= self._plain(rules.SATELLITES)(topic, rows)
        if has_status:
            columns["fix"] = named(rows.doubles("Status"), rules.FIXES)
        return columns | self._sigmas(rows, has_3d)

    def _sigmas(self, rows: RecordRows, has_fix: BoolArray) -> dict[str, Column]:
        """Return what the receiver says of its own errors, logged separately at the same time.

        A position error of 0 is one that the receiver does not know.
        """
        times, sigmas = self._found.sigmas.get((rows.definition.name, rows.instance), (None, {}))
        if times is None or not len(times):
            return {}
        at, known = _same_time(times, rows)
        known = known & has_fix
        return {
            name: Column(values[at], known if name == "velocity_sigma_mps" else known & (values[at] > 0.0))
            for name, values in sigmas.items()
        }

    def _increments(self, topic: str, rows: RecordRows) -> dict[str, Column]:
        """Return the increments of a unit, with the intervals of its gyros and accelerometers."""
        definition = rows.definition
        if not definition.has_numbers(*rules.INCREMENTS) or not definition.has_numbers(rules.INTERVAL):
            return {}
        values = [rows.doubles(name) for name in rules.INCREMENTS]
        angle_s, velocity_s = (
            rows.doubles(name if definition.has_numbers(name) else rules.INTERVAL)
            for name in (rules.ANGLE_INTERVAL, rules.VELOCITY_INTERVAL)
        )
        return imu.increments(values[:3], values[3:], angle_s, velocity_s)

    def _samples(self, topic: str, rows: RecordRows) -> dict[str, Column]:
        values = self._values(topic, rows, (*rules.RATES, *rules.ACCELERATIONS))
        columns = {name: Column(column) for name, column in values.items()}
        named = next((name for name in rules.TEMPERATURE if rows.definition.has_numbers(name)), None)
        if named and columns:
            temperature = rows.doubles(named)
            columns["temperature_c"] = Column(temperature, temperature != 0.0)  # of a sensor without one
        return imu.samples(columns)

    def _validity_ns(self, topic: str, rows: RecordRows) -> Int64Array | None:
        """Return when the values of records were true, where the log tells it."""
        if topic in self._choices.imu_topics.values() and rows.definition.has_integers(rules.SAMPLED):
            return sampled_ns(rows.time_ns, rows.values(rules.SAMPLED).astype(np.float64) * 1e3)
        if topic.startswith("gnss"):
            arrived = self._found.arrivals.get((rows.definition.name, rows.instance))
            if arrived is not None:
                at, known = _same_time(arrived[0], rows)
                return sampled_ns(rows.time_ns, np.where(known, arrived[1][at], np.nan))
        return None

    def _magnetometer(self, topic: str, rows: RecordRows) -> dict[str, Column]:
        healthy = frozen(rows.values("Health") != 0) if rows.definition.has_numbers("Health") else None
        return {name: Column(values, healthy) for name, values in self._values(topic, rows, rules.FIELD).items()}

    def _baro(self, topic: str, rows: RecordRows) -> dict[str, Column]:
        columns = {}
        for name, pressure_pa in self._values(topic, rows, (rules.PRESSURE,)).items():
            altitude, is_refused = pressure_altitude_m(pressure_pa)
            self._refuse(topic, REFUSED, int(np.count_nonzero(is_refused)))
            columns[name] = Column(altitude, ~is_refused)
        return columns

    def _height(self, topic: str, rows: RecordRows) -> dict[str, Column]:
        if not rows.definition.has_numbers("Dist", "Stat", "Orient"):
            return {}
        is_height = frozen((rows.values("Orient") == FACING_DOWN) & (rows.values("Stat") == RANGE_GOOD))
        return {name: Column(values, is_height) for name, values in self._values(topic, rows, rules.HEIGHT).items()}

    def _landed(self, topic: str, rows: RecordRows) -> dict[str, Column]:
        states = self._found.landed
        if not len(states.record_index):
            return {}
        state = states.at(rows.record_index, before=-1)
        return {"weight_on_wheels": Column(state == 1, state >= 0)}

    def _event(self, topic: str, rows: RecordRows) -> dict[str, Column]:
        names = event_names(rows, self._choices.vehicle)
        return {} if names is None else {"name": Column(names), "severity": Column(event_severities(rows, names))}


def _same_time(times: Int64Array, rows: RecordRows) -> tuple[Int64Array, BoolArray]:
    """Return the place of each row's time among some times, and whether it is there."""
    if not len(times):
        return np.zeros(len(rows), dtype=np.int64), np.zeros(len(rows), dtype=bool)
    at = np.minimum(np.searchsorted(times, rows.time_ns.values), len(times) - 1)
    return at, frozen((times[at] == rows.time_ns.values) & rows.time_ns.mask)


def event_names(rows: RecordRows, vehicle: str) -> NDArray[np.str_] | None:
    """Return a name for each record of EV, ARM, MODE, MSG or ERR.

    None when the type lacks the fields.
    """
    definition = rows.definition
    match definition.name:
        case "MSG" if definition.has_texts("Message"):
            return rows.values("Message")
        case "EV" if definition.has_integers("Id"):
            return _named(rows.values("Id"), lambda number: EVENTS.get(number, f"event {number}"))
        case "ARM" if definition.has_integers("ArmState"):
            return _named(rows.values("ArmState"), lambda state: "armed" if state else "disarmed")
        case "MODE" if definition.has_integers("Mode"):
            known = MODES.get(vehicle, ())
            return _named(rows.values("Mode"), lambda number: _mode(number, known))
        case "ERR" if definition.has_integers("Subsys", "ECode"):
            subsystem, code = (rows.values(name).astype(np.int64) for name in ("Subsys", "ECode"))
            return _named(subsystem * 1000 + code, lambda pair: error_name(pair // 1000, pair % 1000))
    return None


def event_severities(rows: RecordRows, names: NDArray[np.str_]) -> NDArray[np.str_]:
    """Return the grade of each record of EV, ARM, MODE, MSG or ERR."""
    match rows.definition.name:
        case "MSG":
            return _named(names, severity_of_text)
        case "EV":
            return _named(rows.values("Id"), event_severity)
        case "MODE" if rows.definition.has_integers("Rsn"):
            return _named(rows.values("Rsn"), mode_severity)
        case "ERR":
            subsystem, code = (rows.values(name).astype(np.int64) for name in ("Subsys", "ECode"))
            return _named(subsystem * 1000 + code, lambda pair: error_severity(pair // 1000, pair % 1000))
    return np.full(len(rows), "info")


def _mode(number: int, known: tuple[str, ...]) -> str:
    name = known[number] if 0 <= number < len(known) else ""
    return f"mode {name or number}"


def _named(values: NDArray[Any], name_of: Callable[[Any], str]) -> NDArray[np.str_]:
    distinct, which = np.unique(values, return_inverse=True)
    return np.array([name_of(value) for value in distinct.tolist()], dtype=np.str_)[which]

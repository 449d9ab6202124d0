"""Canonical topics from the records of a block: ins, gnss, magnetometer, baro, air, electric, discrete."""

from collections.abc import Callable, Iterator, Mapping

import numpy as np

from groundstation.base.angles import FloatArray, wrap_360
from groundstation.base.atmosphere import REFUSED, pressure_altitude_m
from groundstation.base.records import BoolArray, Column, Damage, RecordBatch, frozen
from groundstation.readers.dataflash import rules
from groundstation.readers.dataflash.choices import Choices
from groundstation.readers.dataflash.events import event_names
from groundstation.readers.dataflash.overview import Overview, Unit
from groundstation.readers.dataflash.rules import Rule
from groundstation.readers.dataflash.values import Rows, as_double
from groundstation.readers.layout import velocity_from_track
from groundstation.readers.parts import Part, bounded, merged, occupied

FIX_2D, FIX_3D = 2, 3
RANGE_GOOD, FACING_DOWN = 4, 25


class Mapper:
    """Gathers the canonical records of a block and yields them merged, in the order of the file.

    Parameters
    ----------
    found : Overview
    choices : Choices
        Which of several sources a field is taken from.
    """

    def __init__(self, found: Overview, choices: Choices) -> None:
        self._found, self._choices = found, choices
        self._parts: dict[str, list[Part]] = {}
        self.fields: dict[str, dict[str, None]] = {}  # what was yielded, for the remarks
        self._refused: dict[str, int] = {}
        self._takers = self._all_takers()

    def take(self, rows: Rows) -> None:
        """Take in the rows of one sensor; types that map to nothing are passed over."""
        for topic, columns_of in self._takers.get((rows.definition.name, rows.instance), ()):
            part = occupied(Part(rows.record_index, rows.time_ns, columns_of(topic, rows)))
            if part is not None and len(part.index):
                self._parts.setdefault(topic, []).append(part)

    def batches(self) -> Iterator[RecordBatch]:
        """Yield what was taken in since the last call."""
        parts, self._parts = self._parts, {}
        for topic, of_topic in sorted(parts.items()):
            for piece in bounded(merged(topic, of_topic)):
                self.fields.setdefault(topic, {}).update(dict.fromkeys(piece.columns))
                yield piece

    def damages(self) -> Iterator[Damage]:
        """Pressures that are none, one line for each topic; the log's own values are kept."""
        for topic, count in self._refused.items():
            yield Damage("unreadable_cells", topic, count, REFUSED, topic, loses_data=False)

    def _all_takers(self) -> Mapping[Unit, list[tuple[str, Callable[[str, Rows], dict[str, Column]]]]]:
        """For each sensor the topics it gives to, and the function that makes the columns."""
        choices = self._choices
        takers: dict[Unit, list[tuple[str, Callable[[str, Rows], dict[str, Column]]]]] = {}

        def add(unit: Unit, topic: str, columns_of: Callable[[str, Rows], dict[str, Column]]) -> None:
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
        add(("ATT", None), "ins", self._attitude)
        add(("AHR2", None), "ins.2", self._backup)
        add(("POS", None), "ins", self._position)
        add(("ATT", None), "discrete", self._landed)
        for unit in choices.rates:
            add(unit, "ins", self._plain((*rules.RATES, *rules.ACCELERATIONS)))
        for unit, core in choices.ekf_velocity.items():
            add(unit, choices.ekf_topic, self._of_core(core, rules.VELOCITY, is_solution=True))
        for unit, core in choices.ekf_wind.items():
            add(unit, "air", self._of_core(core, rules.WIND, is_solution=False))
        for name in ("EV", "ARM", "MODE", "MSG", "ERR"):
            add((name, None), "event", self._event)
        return takers

    def _values(self, topic: str, rows: Rows, wanted: tuple[Rule, ...]) -> dict[str, FloatArray]:
        """Values of the rules whose field the type has, in canonical units."""
        found = {}
        for rule in wanted:
            if rows.definition.has_numbers(rule.source):
                factor = rule.scale(topic, rows.definition, self._found.units)
                values = as_double(rows.values(rule.source))
                found[rule.field] = values if factor == 1.0 else values * factor
        return found

    def _plain(self, wanted: tuple[Rule, ...]) -> Callable[[str, Rows], dict[str, Column]]:
        def columns_of(topic: str, rows: Rows) -> dict[str, Column]:
            return {name: Column(values) for name, values in self._values(topic, rows, wanted).items()}

        return columns_of

    def _with_mode(self, rows: Rows, columns: dict[str, Column]) -> dict[str, Column]:
        return {**columns, "mode": self._mode(rows, None)} if columns else {}

    def _mode(self, rows: Rows, present: BoolArray | None) -> Column:
        return Column(np.broadcast_to(self._choices.mode, len(rows)), present)

    def _attitude(self, topic: str, rows: Rows) -> dict[str, Column]:
        values = self._values(topic, rows, (*rules.ATTITUDE, self._choices.yaw))
        if self._choices.yaw.field in values:
            values[self._choices.yaw.field] = wrap_360(values[self._choices.yaw.field])
        return self._with_mode(rows, {name: Column(column) for name, column in values.items()})

    def _position(self, topic: str, rows: Rows) -> dict[str, Column]:
        values = self._values(topic, rows, rules.POSITION)
        if not {"latitude_deg", "longitude_deg"} <= values.keys():
            return {}
        known = frozen((values["latitude_deg"] != 0.0) | (values["longitude_deg"] != 0.0))  # both zero: not known yet
        return self._with_mode(rows, {name: Column(column, known) for name, column in values.items()})

    def _backup(self, topic: str, rows: Rows) -> dict[str, Column]:
        return {**self._attitude(topic, rows), **self._position(topic, rows)}

    def _of_core(
        self, core: int | None, wanted: tuple[Rule, ...], is_solution: bool
    ) -> Callable[[str, Rows], dict[str, Column]]:
        """Columns that are present while this core of the filter is the one in use."""

        def columns_of(topic: str, rows: Rows) -> dict[str, Column]:
            values = self._values(topic, rows, wanted)
            used = None
            if core is not None:
                used = frozen(self._choices.primary_core.at(rows.record_index, before=0) == core)
            columns = {name: Column(column, used) for name, column in values.items()}
            if is_solution and columns:
                columns["mode"] = self._mode(rows, used)
            return columns

        return columns_of

    def _gnss(self, topic: str, rows: Rows) -> dict[str, Column]:
        status = rows.values("Status") if rows.definition.has_numbers("Status") else np.full(len(rows), FIX_3D)
        has_2d, has_3d = frozen(status >= FIX_2D), frozen(status >= FIX_3D)
        columns = {}
        for name, values in self._values(topic, rows, rules.POSITION).items():
            columns[name] = Column(values, has_3d if name == "altitude_msl_m" else has_2d)
        motion = self._values(topic, rows, rules.GNSS_VELOCITY)
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
        return columns | self._speed_sigma(rows, has_3d)

    def _speed_sigma(self, rows: Rows, has_fix: BoolArray) -> dict[str, Column]:
        """Speed accuracy that the receiver gave in a record of its own, with the time of this one."""
        times, sigmas = self._found.speed_sigma.get((rows.definition.name, rows.instance), (None, None))
        if times is None or sigmas is None or not len(times):
            return {}
        at = np.minimum(np.searchsorted(times, rows.time_ns.values), len(times) - 1)
        known = (times[at] == rows.time_ns.values) & rows.time_ns.mask & has_fix
        return {"velocity_sigma_mps": Column(sigmas[at], known)}

    def _magnetometer(self, topic: str, rows: Rows) -> dict[str, Column]:
        healthy = frozen(rows.values("Health") != 0) if rows.definition.has_numbers("Health") else None
        return {name: Column(values, healthy) for name, values in self._values(topic, rows, rules.FIELD).items()}

    def _baro(self, topic: str, rows: Rows) -> dict[str, Column]:
        if not rows.definition.has_numbers("Press"):
            return {}
        altitude, is_refused = pressure_altitude_m(as_double(rows.values("Press")))
        if is_refused.any():
            self._refused[topic] = self._refused.get(topic, 0) + int(is_refused.sum())
        return {"pressure_altitude_m": Column(altitude, ~is_refused)}

    def _height(self, topic: str, rows: Rows) -> dict[str, Column]:
        if not rows.definition.has_numbers("Dist", "Stat", "Orient"):
            return {}
        is_height = frozen((rows.values("Orient") == FACING_DOWN) & (rows.values("Stat") == RANGE_GOOD))
        return {name: Column(values, is_height) for name, values in self._values(topic, rows, rules.HEIGHT).items()}

    def _landed(self, topic: str, rows: Rows) -> dict[str, Column]:
        states = self._found.landed
        if not len(states.record_index):
            return {}
        state = states.at(rows.record_index, before=-1)
        return {"weight_on_wheels": Column(state == 1, state >= 0)}

    def _event(self, topic: str, rows: Rows) -> dict[str, Column]:
        names = event_names(rows, self._choices.vehicle)
        return {} if names is None else {"name": Column(names)}

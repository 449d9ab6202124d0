"""Time of a profile: the kind that its TOML tells, with columns and unit."""

import re
from typing import Any

from groundstation.readers.profile import TIME_UNITS, TimeColumns
from groundstation.readers.profile_values import Checker

_DATE_DIRECTIVES = frozenset("YymdbBj")


class TimeChecker(Checker):
    """Parser of the table ``time``."""

    def time(self, value: Any) -> TimeColumns:
        kinds = ("seconds", "nanoseconds", "iso", "local", "unix", "gps_week", "time_of_day", "utc_counter")
        table = self.table(value, "time", (), ("kind",))
        kind = self.text(table["kind"], "time.kind")
        if kind not in kinds:
            self.fail("time.kind", repr(kind), f"one of {', '.join(kinds)}")
        if kind == "local":
            return self.local_time(table)
        if kind == "utc_counter":
            return self.counter_time(table)
        if kind == "gps_week":
            self.table(table, "time", ("kind", "week", "seconds", "unit", "earliest_year"), ("week", "seconds"))
            year = self.number(table.get("earliest_year", 0), "time.earliest_year")
            names = tuple(self.text(table[key], f"time.{key}") for key in ("week", "seconds"))
            return TimeColumns(kind, names, self.time_unit(table), earliest_year=self.year(year))
        if kind == "time_of_day":
            self.table(table, "time", ("kind", "column", "date", "date_formats"), ("column", "date"))
            names = (self.text(table["column"], "time.column"),)
            return TimeColumns(
                kind, names, date_formats=self.date_formats(table), date=self.text(table["date"], "time.date")
            )
        allowed = {"seconds": ("kind", "column", "unit", "rtklib_tag"), "unix": ("kind", "column", "unit")}
        self.table(table, "time", allowed.get(kind, ("kind", "column")), ("column",))
        has_tag = self.flag(table.get("rtklib_tag", False), "time.rtklib_tag")
        return TimeColumns(kind, (self.text(table["column"], "time.column"),), self.time_unit(table), has_tag=has_tag)

    def time_unit(self, table: dict[str, Any]) -> tuple[int, int]:
        unit = table.get("unit", "s")
        if not isinstance(unit, str) or unit not in TIME_UNITS:
            self.fail("time.unit", repr(unit), f"one of {', '.join(TIME_UNITS)}")
        return TIME_UNITS[unit]

    def year(self, value: float) -> int:
        if value != int(value) or (value and not 1980 <= value <= 2100):
            self.fail("time.earliest_year", f"{value:g}", "a year from 1980 on")
        return int(value)

    def counter_time(self, table: dict[str, Any]) -> TimeColumns:
        """Return the columns of a counter and of UTC in whole seconds."""
        allowed = ("kind", "counter", "unit", "utc", "date", "time", "date_formats")
        self.table(table, "time", allowed, ("counter",))
        keys = ["counter", *(["utc"] if "utc" in table else ["date", "time"])]
        self.table(table, "time", ("kind", "unit", "date_formats", *keys), keys)
        names = tuple(self.text(table[key], f"time.{key}") for key in keys)
        return TimeColumns("utc_counter", names, self.time_unit(table), self.date_formats(table))

    def local_time(self, table: dict[str, Any]) -> TimeColumns:
        """Return the columns of date and time of day, which may be one, and of the offset."""
        needed = ("column",) if "column" in table else ("date", "time")
        self.table(table, "time", ("kind", *needed, "offset", "date_formats"), needed)
        is_utc = table.get("offset") == "UTC"
        keys = [*(needed * 2)[:2], *(["offset"] if "offset" in table and not is_utc else [])]
        names = [self.text(table[key], f"time.{key}") for key in keys]
        return TimeColumns("local", tuple(names), date_formats=self.date_formats(table), is_utc=is_utc)

    def date_formats(self, table: dict[str, Any]) -> tuple[str, ...]:
        formats = self.texts(table.get("date_formats", ["%Y-%m-%d"]), "time.date_formats")
        for form in formats:
            used = set(re.findall(r"%(.)", form))
            if not used or not used <= _DATE_DIRECTIVES:
                self.fail("time.date_formats", repr(form), "a date such as %Y-%m-%d")
        return formats

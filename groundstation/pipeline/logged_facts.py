"""Parameters of the autopilot, metadata and events, as the log itself tells them."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from groundstation.base.signals import topics_of_kind
from groundstation.tables.parameters import parameters_of
from groundstation.tables.table import Flight, Tables

if TYPE_CHECKING:
    import pandas as pd


# One name for what formats name differently, from the key that says it best to the others.
COMMON: dict[str, tuple[str, ...]] = {
    "aircraft": ("aircraft",),
    "flight": ("flight",),
    "vehicle": ("vehicle", "aircraft_type"),
    "firmware": ("firmware", "ver_sw_release"),
    "hardware": ("hardware", "ver_hw", "product", "recorder"),
    "serial": ("serial_number", "sys_uuid", "ins_serial"),
    "receiver": ("receiver", "product.gnss"),
}
# Facts that reader and run add about columns; parameters have a frame of their own.
NOT_OF_ITSELF = ("derived.", "units.", "parameter.", "truth.", "heading_is_track.", "type.", "phases.", "vehicle.")


def parameters_frame(flight: Flight) -> "pd.DataFrame":
    """Return the parameters of the autopilot by name; without rows where the log has none.

    Columns are ``value`` (the last one logged), ``default`` (NaN where the log does not tell it), ``differs`` (from the
    default), ``first`` (the first one logged) and ``changed`` (while the log was recorded). Units are the autopilot's.
    """
    import pandas as pd

    known = parameters_of(flight)
    every = [known.by_name[name] for name in sorted(known.by_name)]
    changed = {one.name for one in known.changed}
    columns = {
        "value": np.array([one.value for one in every], dtype=np.float64),
        "default": np.array([np.nan if one.default is None else one.default for one in every], dtype=np.float64),
        "differs": np.array([one.differs for one in every], dtype=np.bool_),
        "first": np.array([one.first for one in every], dtype=np.float64),
        "changed": np.array([one.name in changed for one in every], dtype=np.bool_),
    }
    frame = pd.DataFrame(columns, index=pd.Index([one.name for one in every], name="name", dtype=object))
    frame.attrs["units"] = {}
    return frame


def metadata_series(told: Mapping[str, str]) -> "pd.Series[str]":
    """Return what a log says of vehicle, firmware, hardware and serials, by name.

    First the names of :data:`COMMON`, then everything as the log names it.
    """
    import pandas as pd

    found = {name: next((told[key] for key in keys if told.get(key)), "") for name, keys in COMMON.items()}
    named = {name: value for name, value in found.items() if value}
    if "sys_name" in told and "firmware" in named and "firmware" not in told:
        named["firmware"] = f"{told['sys_name']} {named['firmware']}"
    rest = {key: told[key] for key in sorted(told) if key not in named and not key.startswith(NOT_OF_ITSELF)}
    return pd.Series({**named, **rest}, name="metadata", dtype=object)


def events_frame(flight: Flight) -> "pd.DataFrame":
    """Return the events that the log names, by time: markers, messages, changes of mode.

    Columns are ``time_s`` (flight seconds), ``topic``, ``name`` and ``severity`` (info, warn, fail; empty where the log
    does not say). The index is UTC, or flight time where there is none.
    """
    import pandas as pd

    tables = Tables(flight)
    parts = []
    for topic in topics_of_kind("event", flight.topics()):
        table = tables[topic]
        said = table.take(np.flatnonzero(table.text("name") != ""))
        texts = {"topic": topic, "name": said.text("name"), "severity": said.text("severity")}
        parts.append(pd.DataFrame({"time_s": said.flight_time_s, **texts}, index=said.to_frame().index))
    if parts:
        frame = pd.concat(parts).sort_index(kind="stable")
    else:
        index = pd.DatetimeIndex([], tz="UTC", name="utc") if flight.has_utc else pd.TimedeltaIndex([])
        frame = pd.DataFrame({"time_s": np.zeros(0), "topic": [], "name": [], "severity": []}, index=index)
    frame.attrs["units"] = {"time_s": "s"}
    return frame

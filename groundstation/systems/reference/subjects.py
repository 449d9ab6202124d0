"""Subjects of the comparison, as tables of canonical fields.

They are the recorded GNSS and INS, and what the estimators made of them.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from groundstation.base.angles import FloatArray, wrap_360
from groundstation.base.climb import is_upward
from groundstation.base.errors import NotAssessableError
from groundstation.base.records import Column
from groundstation.base.signals import topics_of_kind
from groundstation.base.units import NS_PER_S
from groundstation.results.arrays.states import BodyStates
from groundstation.results.roles import HeadingByTrack, StatesAlongTheFlight
from groundstation.systems.known import Known
from groundstation.tables.epochs import distinct_epochs
from groundstation.tables.headings import true_heading
from groundstation.tables.table import Flight, Table
from groundstation.tables.tracks import HasTracks, ins_table

HEIGHTS = ("altitude_ellipsoid_m", "altitude_msl_m")
DOWN = "velocity_down_mps"


def subjects_of(flight: Flight, known: Known) -> Iterator[tuple[str, Table]]:
    """Name and table of everything that may be judged, in the order it is shown."""
    for topic in topics_of_kind("gnss", flight.topics()):
        table = flight[topic].trusted()
        moving = distinct_epochs(table)
        yield topic, moving if len(moving) >= 2 else table
    for topic in topics_of_kind("ins", flight.topics()):
        yield topic, _ins(flight, topic)
    for working in known.workings.values():
        if isinstance(working, HasTracks):
            yield from working.tracks(flight.start_ns)
    estimated = known.answer_meeting(StatesAlongTheFlight)
    states = None if estimated is None else estimated.states_at_antenna()
    if estimated is not None and states is not None:
        yield estimated.states_name, _of_states(states, flight.start_ns)
    heading = known.answer_meeting(HeadingByTrack)
    if heading is not None and heading.ins_topic in flight:
        corrected = wrap_360(_true_heading(flight, heading.ins_topic) - heading.error_deg)
        sigma = np.full(len(corrected), heading.standard_error_deg)
        columns = {"true_heading_deg": corrected, "true_heading_sigma_deg": sigma}
        yield "heading", ins_table(flight[heading.ins_topic].time_ns, columns)


def _of_states(states: BodyStates, start_ns: int) -> Table:
    """Return states as a table, the sigmas of north and east together, as a claim has them."""
    columns = {name: values for name, values in states.columns.items() if name not in ("time_s", "segment")}
    position = (states.position_north_sigma_m, states.position_east_sigma_m)
    velocity = (states.velocity_north_sigma_mps, states.velocity_east_sigma_mps)
    columns |= {"horizontal_sigma_m": np.hypot(*position), "velocity_sigma_mps": np.hypot(*velocity)}
    return ins_table(start_ns + np.rint(states.time_s * NS_PER_S).astype(np.int64), columns)


def _ins(flight: Flight, topic: str) -> Table:
    """An INS that navigates, its heading from true north."""
    table = flight[topic]
    heading = _true_heading(flight, topic)
    columns = {**table.columns, "true_heading_deg": Column(heading, np.isfinite(heading))}
    height = next((name for name in HEIGHTS if table.has(name)), "")
    if (
        height
        and table.has(DOWN)
        and is_upward(flight.seconds(table.time_ns), table.values(height), table.values(DOWN))
    ):
        del columns[DOWN]  # its sign is told as a contradiction of the log
    return replace(table, columns=columns).trusted()


def _true_heading(flight: Flight, topic: str) -> FloatArray:
    try:
        return true_heading(flight, topic).values_deg
    except NotAssessableError:
        return np.full(len(flight[topic]), np.nan)

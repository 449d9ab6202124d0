"""Units and reference of a flight, read off its tables."""

import re
from contextlib import suppress
from itertools import pairwise

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.errors import NotAssessableError
from groundstation.base.signals import topics_of_kind
from groundstation.methods.ins_noise import InsNoise, choose_class, class_names
from groundstation.results.arrays.states import BodyStates
from groundstation.results.roles import StatesAlongTheFlight
from groundstation.systems.inertial.differences import POSITION_FIELDS, VELOCITY_FIELDS, differences, navigating
from groundstation.systems.inertial.kind import kind_of, stated_kind
from groundstation.systems.inertial.navigation_start import navigation_start, stated_start
from groundstation.systems.inertial.settings import InertialSettings
from groundstation.systems.inertial.units_track import ReferenceTrack, UnitTrack
from groundstation.systems.known import Known
from groundstation.tables.sources import (
    AIDED,
    HALF,
    UNKNOWN,
    Need,
    aided_share,
    choose_source,
    said_of,
)
from groundstation.tables.table import Flight, Table

GNSS = Need("gnss", "GNSS position", POSITION_FIELDS, or_else=VELOCITY_FIELDS, takes_longest=True)
SUREST_M = 30.0  # states of the trajectory with a larger sigma are no reference
SERIAL_FROM = re.compile(r"^(?P<serial>.*?)\s+from\s+(?P<from_s>\d+(\.\d+)?)(\s*s)?$")
TRAJECTORY = "the best trajectory"
# Slow errors of an ordinary receiver: the noise of a class may be that of a better one than the aircraft has.
ORDINARY_M, ORDINARY_MPS = 3.0, 0.03


def unit_topics(flight: Flight) -> tuple[str, ...]:
    """Topics of INS with position or velocity, in the order of their names."""
    return tuple(
        topic
        for topic in topics_of_kind("ins", flight.topics())
        if len(flight[topic]) > 1 and (flight[topic].has(*POSITION_FIELDS) or flight[topic].has(*VELOCITY_FIELDS))
    )


def unit_class(flight: Flight, known: Known, settings: InertialSettings) -> tuple[InsNoise, str]:
    """Return the class of the units, and who chose it."""
    topics = unit_topics(flight)
    said = said_of(flight, topics[0], "ins_class") if topics else ""
    return choose_class(settings.ins_class, known.aircraft.ins_class, said)


def unit_tracks(flight: Flight, known: Known, settings: InertialSettings) -> tuple[UnitTrack, ...]:
    """Return the units of a flight."""
    found = []
    for place, topic in enumerate(unit_topics(flight)):
        table, _ = navigating(flight[topic].unique_times())
        if len(table) > 1:
            found.append(_track(flight, topic, table, known, settings, is_first=place == 0))
    return tuple(found)


def _track(
    flight: Flight, topic: str, table: Table, known: Known, settings: InertialSettings, *, is_first: bool
) -> UnitTrack:
    kind, reason, start_s = _against_gnss(flight, topic, known, settings, is_first=is_first)
    return UnitTrack(
        topic,
        flight.seconds(table.time_ns),
        table.values("latitude_deg"),
        table.values("longitude_deg"),
        np.column_stack([table.values(name) for name in VELOCITY_FIELDS]),
        heading_deg=table.values("true_heading_deg") if table.has("true_heading_deg") else None,
        altitude_m=_altitude(table),
        kind=kind,
        kind_reason=reason,
        serials=serials_of(_serial_text(flight, topic, known, is_first=is_first)),
        start_s=start_s,
        ins_class=_class_of(flight, topic, settings, is_first=is_first),
    )


def _class_of(flight: Flight, topic: str, settings: InertialSettings, *, is_first: bool) -> str:
    """Return the class that the log states of a unit alone; settings go before it."""
    if is_first or settings.ins_class != "auto":
        return ""
    said = flight.metadata.get(f"ins_class.{topic}", "").strip().lower()
    return said if said in class_names() else ""


def _altitude(table: Table) -> FloatArray | None:
    for name in ("altitude_ellipsoid_m", "altitude_msl_m"):
        if table.has(name):
            return table.values(name)
    return None


def _against_gnss(
    flight: Flight, topic: str, known: Known, settings: InertialSettings, *, is_first: bool
) -> tuple[str, str, float | None]:
    """Return the kind of a unit with the reason, and when it began to navigate.

    The aircraft file speaks of the first unit.
    """
    said = said_of(flight, topic, f"ins_kind.{topic}") or (said_of(flight, topic, "ins_kind") if is_first else "")
    stated = stated_kind(known.aircraft.ins_kind if is_first else "", {"ins_kind": said})
    nav_start = stated_start(known.aircraft.nav_start_utc, flight, topic)
    with suppress(NotAssessableError):
        compared = differences(flight, settings=settings, excluded_s=known.excluded_s, ins_topic=topic)
        kind, reason = kind_of(compared, settings, stated)
        noise, _ = unit_class(flight, known, settings)
        start, _ = navigation_start(flight, compared, noise.gnss, nav_start)
        return kind, reason, None if kind == AIDED else start.time_s
    if stated[0]:
        return *stated, None
    if aided_share(flight[topic]) > HALF:
        return AIDED, "its mode in the log is gnss_aided", None
    return UNKNOWN, "nothing to compare it with", None


def _serial_text(flight: Flight, topic: str, known: Known, *, is_first: bool) -> str:
    own = flight.metadata.get(f"ins_serial.{topic}", "")
    return own or (known.aircraft.ins_serial or said_of(flight, topic, "ins_serial") if is_first else "")


def serials_of(text: str) -> tuple[tuple[float, str], ...]:
    """Return the serials of a unit with the flight second from which each holds.

    A comma that no time follows is part of a serial.

    Examples
    --------
    >>> serials_of("A12"), serials_of("A12, B07 from 5400 s")
    (((0.0, 'A12'),), ((0.0, 'A12'), (5400.0, 'B07')))
    >>> serials_of("HG2001, rev B, B07 from 5400")
    ((0.0, 'HG2001, rev B'), (5400.0, 'B07'))
    """
    found: list[tuple[float, str]] = []
    for part in text.split(","):
        if not part.strip():
            continue
        told = SERIAL_FROM.match(part.strip())
        if told is not None:
            found.append((float(told["from_s"]), told["serial"]))
        elif found:
            at_s, serial = found[-1]
            found[-1] = at_s, f"{serial},{part.rstrip()}"
        else:
            found.append((0.0, part.strip()))
    ordered = sorted(found, key=lambda one: one[0])
    return tuple(one for before, one in pairwise([(-1.0, ""), *ordered]) if one[1] != before[1])


def unit_reference(flight: Flight, known: Known, noise: InsNoise) -> ReferenceTrack | None:
    """Return the best trajectory where its checks hold, else GNSS, else None."""
    best = known.answer_meeting(StatesAlongTheFlight)
    if best is not None and best.is_reference:
        states = best.states_at_antenna()
        if states is not None and len(states.time_s) > 1:
            return _by_states(best.states_name, states)
    try:
        topic = choose_source(flight, GNSS, "ins_units")
    except NotAssessableError:
        return None
    return _by_gnss(flight, topic, known.excluded_s, noise)


def _by_states(topic: str, states: BodyStates) -> ReferenceTrack:
    sigma = np.hypot(states.position_north_sigma_m, states.position_east_sigma_m) / np.sqrt(2.0)
    velocity_sigma = np.hypot(states.velocity_north_sigma_mps, states.velocity_east_sigma_mps) / np.sqrt(2.0)
    unsure = sigma > SUREST_M
    hidden = np.where(unsure, np.nan, 0.0)
    return ReferenceTrack(
        topic,
        TRAJECTORY,
        states.time_s,
        states.latitude_deg + hidden,
        states.longitude_deg + hidden,
        np.column_stack([states.velocity_north_mps + hidden, states.velocity_east_mps + hidden]),
        position_sigma_m=float(np.median(sigma)),
        velocity_sigma_mps=float(np.median(velocity_sigma)),
        heading_deg=states.true_heading_deg,
    )


def _by_gnss(
    flight: Flight, topic: str, excluded_s: tuple[tuple[float, float], ...], noise: InsNoise
) -> ReferenceTrack | None:
    table = flight[topic].unique_times()
    if table.has("integrity_ok"):
        column = table.columns["integrity_ok"]
        table = table.take(~(column.mask & ~np.asarray(column.values, dtype=bool)))
    time_s = flight.seconds(table.time_ns)
    for start_s, end_s in excluded_s:
        outside = (time_s < start_s) | (time_s > end_s)
        table, time_s = table.take(outside), time_s[outside]
    if len(table) < 2:
        return None
    gnss = noise.gnss
    return ReferenceTrack(
        topic,
        topic,
        time_s,
        table.values("latitude_deg"),
        table.values("longitude_deg"),
        np.column_stack([table.values(name) for name in VELOCITY_FIELDS]),
        position_sigma_m=max(gnss.position_correlated_m, ORDINARY_M),
        velocity_sigma_mps=max(gnss.velocity_correlated_mps, ORDINARY_MPS),
        position_correlation_s=gnss.position_correlation_s,
        velocity_correlation_s=gnss.velocity_correlation_s,
    )

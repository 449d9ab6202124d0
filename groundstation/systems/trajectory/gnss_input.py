"""Fixes of the receiver of a flight, with the source of their sigmas."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import NotAssessableError
from groundstation.base.records import BoolArray
from groundstation.base.signals import topics_of_kind
from groundstation.base.words import counted, listed
from groundstation.systems.trajectory.gathered import GnssFacts, InputNote
from groundstation.systems.trajectory.input_settings import InputSettings
from groundstation.systems.trajectory.inputs import GnssFixes
from groundstation.tables.sources import WHOLE_SHARE, sources_of_kind, why_without_gnss
from groundstation.tables.table import Flight, Table

FloatArray = NDArray[np.float64]

SUBJECT = "trajectory"
POSITION = ("latitude_deg", "longitude_deg")
VELOCITY = tuple(f"velocity_{axis}_mps" for axis in ("north", "east", "down"))
PRECISE = ("rtk_fixed", "rtk_float", "ppp")
BLENDED = ("gnss_ins",)
NO_FIX = ("none", "dead_reckoning")
MOVING_MPS = 0.5  # a place must change from one fix to the next
REPEATED_SHARE = 0.1  # of the fixes in motion: a log with more of them writes a fix again
FEWEST = 2
TOGETHER = np.sqrt(2.0)  # a sigma of north and east together over that of one of them, both alike


class FixClass(NamedTuple):
    """Standard deviations by axis that a kind of fix has where the receiver states none.

    Attributes
    ----------
    horizontal_m, vertical_m, horizontal_mps, vertical_mps : float
        Those of position at a dilution of 1 where ``by_dilution``.
    """

    horizontal_m: float
    vertical_m: float
    horizontal_mps: float
    vertical_mps: float
    by_dilution: bool = True


STANDALONE = FixClass(2.0, 3.0, 0.10, 0.15)
CLASSES: Mapping[str, FixClass] = MappingProxyType(
    {
        "rtk_fixed": FixClass(0.02, 0.03, 0.05, 0.08, by_dilution=False),
        "rtk_float": FixClass(0.4, 0.6, 0.08, 0.12, by_dilution=False),
        "ppp": FixClass(0.15, 0.3, 0.08, 0.12, by_dilution=False),
        "dgnss": FixClass(1.0, 1.5, 0.10, 0.15),
        "3d": STANDALONE,
    }
)
LEAST_DILUTION, MOST_DILUTION = 0.5, 50.0
MOST_SIGMA_M, MOST_SIGMA_MPS = 1_000.0, 100.0  # a receiver that states more knows nothing


@dataclass(frozen=True)
class GnssInput:
    """Fixes, facts and notes of a receiver."""

    gnss: GnssFixes
    facts: GnssFacts
    notes: tuple[InputNote, ...]


def gnss_of(flight: Flight, excluded_s: tuple[tuple[float, float], ...], settings: InputSettings) -> GnssInput:
    """Return the fixes of the best receiver of a flight.

    Raises
    ------
    NotAssessableError
        Where there is none, or none that is a fix.
    """
    topic, others = _chosen(flight, settings)
    notes: list[InputNote] = []
    if others:
        notes.append(InputNote("several_receivers", f"{topic} is used; {listed(others)} not", len(others)))
    table = _fixes(flight, topic, excluded_s, notes)
    velocity = _velocity(table, topic, notes)
    table, velocity = _without_repeats(table, velocity, topic, notes)
    kinds = table.text("fix")
    height, datum = _height(table, notes)
    flat = kinds == "2d"
    if flat.any():
        text = f"{_fix_count(int(flat.sum()))} in two dimensions: without height and vertical velocity"
        notes.append(InputNote("flat_fixes", text, int(flat.sum())))
        height, velocity = np.where(flat, np.nan, height), np.where(flat[:, None] & _DOWN, np.nan, velocity)
    position_sigma, position_from = _position_sigma(table, kinds)
    velocity_sigma, velocity_from = _velocity_sigma(table, kinds)
    notes.append(InputNote("position_sigma", f"sigma of position of {topic}: {position_from}"))
    if np.isfinite(velocity).any():
        notes.append(InputNote("velocity_sigma", f"sigma of velocity of {topic}: {velocity_from}"))
    precise = np.isin(kinds, PRECISE)
    fixes = GnssFixes(
        flight.seconds(table.time_ns),
        table.values("latitude_deg"),
        table.values("longitude_deg"),
        height,
        velocity,
        position_sigma,
        velocity_sigma,
        precise,
    )
    rate_hz = 1.0 / float(np.median(np.diff(fixes.time_s)))
    facts = GnssFacts(topic, rate_hz, position_from, velocity_from, datum, float(np.mean(precise)))
    return GnssInput(fixes, facts, tuple(notes))


_DOWN = np.array([[False, False, True]])


def _chosen(flight: Flight, settings: InputSettings) -> tuple[str, tuple[str, ...]]:
    """Return the topic to use, and the others that could be used.

    A receiver whose fixes do not come out of an INS is before one whose do; then among those that cover most of the
    time: velocity, carrier phase, rate. Several logs of a flight have an order of their own.
    """
    named = settings.gnss_topic
    having = [one for one in sources_of_kind(flight, "gnss") if flight[one].has(*POSITION)]
    if named:
        if named not in flight:
            raise NotAssessableError(SUBJECT, f"no topic {named}")
        if named not in having:
            raise NotAssessableError(SUBJECT, f"no position in {named}")
        return named, tuple(one for one in having if one != named)
    if not having:
        raise NotAssessableError(SUBJECT, _why_none(flight))
    counts = {one: _rank(flight[one]) for one in having}
    longest_s = max(rank.covered_s for rank in counts.values())

    def key(one: str) -> tuple[bool, bool, bool, float, float]:
        rank = counts[one]
        is_short = rank.covered_s < WHOLE_SHARE * longest_s
        return is_short, rank.is_blended, not rank.has_velocity, -round(rank.precise, 1), -round(rank.rate_hz)

    best = min(having, key=key)
    return best, tuple(one for one in having if one != best)


def _why_none(flight: Flight) -> str:
    topics = [one for one in topics_of_kind("gnss", flight.topics()) if len(flight[one])]
    return why_without_gnss(flight, "position") if topics else "no GNSS receiver (topic gnss) in the log"


class _Rank(NamedTuple):
    covered_s: float
    is_blended: bool
    has_velocity: bool
    precise: float
    rate_hz: float


def _rank(table: Table) -> _Rank:
    times = table.time_ns[_is_fix(table)] / 1e9
    kinds = table.text("fix")
    steps = np.diff(times)
    steps = steps[steps > 0.0]
    usual = float(np.median(steps)) if steps.size else 1.0
    has_velocity = table.has(*VELOCITY[:2]) or table.has("track_deg", "ground_speed_mps")
    blended, precise = (float(np.mean(np.isin(kinds, names))) for names in (BLENDED, PRECISE))
    return _Rank(float(steps[steps <= 5.0 * usual].sum()), blended > 0.5, has_velocity, precise, 1.0 / usual)


def _is_fix(table: Table) -> BoolArray:
    """Tell which rows have a place that is a fix."""
    latitude, longitude = (table.values(name) for name in POSITION)
    placed = np.isfinite(latitude) & np.isfinite(longitude) & ((latitude != 0.0) | (longitude != 0.0))
    return np.asarray(placed & ~np.isin(table.text("fix"), NO_FIX))


def _fixes(flight: Flight, topic: str, excluded_s: tuple[tuple[float, float], ...], notes: list[InputNote]) -> Table:
    """Return the rows of a topic that are fixes, one for each time."""
    whole = flight[topic].unique_times()
    repeated = len(flight[topic]) - len(whole)
    table = whole.trusted()
    kinds = table.text("fix")
    reckoned = int(np.count_nonzero(kinds == "dead_reckoning"))
    is_fix = _is_fix(table)
    blended = int(np.count_nonzero(is_fix & np.isin(kinds, BLENDED)))
    if reckoned:
        text = f"{_fix_count(reckoned)} of {topic} by dead reckoning: left out"
        notes.append(InputNote("dead_reckoning", text, reckoned))
    if blended:
        text = f"{_fix_count(blended)} of {topic} come out of the receiver's own INS: not independent of inertial data"
        notes.append(InputNote("blended", text, blended, is_doubt=True))
    without = len(whole) - int(np.count_nonzero(is_fix)) - reckoned
    if without:
        notes.append(InputNote("no_fix", f"{counted(without, 'row')} of {topic} without a fix", without))
    if repeated:
        notes.append(InputNote("repeated_times", f"{counted(repeated, 'row')} of {topic} of a time before", repeated))
    table = table.take(is_fix)
    time_s = flight.seconds(table.time_ns)
    out = np.zeros(len(table), dtype=bool)
    for start_s, end_s in excluded_s:
        out |= (time_s >= start_s) & (time_s <= end_s)
    if out.any():
        notes.append(InputNote("excluded", f"{_fix_count(int(out.sum()))} excluded by the user", int(out.sum())))
        table = table.take(~out)
    if len(table) < FEWEST:
        raise NotAssessableError(SUBJECT, f"{topic} has only {_fix_count(len(table))}")
    return table


def _fix_count(count: int) -> str:
    return counted(count, "fix", "fixes")


def _velocity(table: Table, topic: str, notes: list[InputNote]) -> FloatArray:
    """Return velocities north, east, down; from speed and track where a row has no components."""
    velocity = np.column_stack([table.values(name) for name in VELOCITY])
    speed, track = table.values("ground_speed_mps"), table.values("track_deg")
    track_rad = np.deg2rad(np.where(np.isfinite(track), track, np.where(speed == 0.0, 0.0, np.nan)))
    by_track = np.column_stack([speed * np.cos(track_rad), speed * np.sin(track_rad)])
    lacking = ~np.isfinite(velocity[:, :2]).all(axis=1)
    velocity[lacking, :2] = by_track[lacking]
    count = int(np.count_nonzero(lacking & np.isfinite(by_track).all(axis=1)))
    if count:
        text = f"velocity of {_fix_count(count)} of {topic} from speed over ground and track"
        notes.append(InputNote("track_and_speed", text, count))
    if not np.isfinite(velocity[:, :2]).any():
        notes.append(InputNote("no_velocity", f"{topic} has no velocity"))
    elif not np.isfinite(velocity[:, 2]).any():
        notes.append(InputNote("no_vertical_velocity", f"{topic} has no vertical velocity"))
    return velocity


def _without_repeats(
    table: Table, velocity: FloatArray, topic: str, notes: list[InputNote]
) -> tuple[Table, FloatArray]:
    """Drop fixes that are the one before, written again: in motion a place changes."""
    values = np.column_stack([*(table.values(name) for name in (*POSITION, *_HEIGHTS)), velocity])
    old, new = values[:-1], values[1:]
    same = np.concatenate(([False], ((old == new) | (np.isnan(old) & np.isnan(new))).all(axis=1)))
    moving = np.hypot(velocity[:, 0], velocity[:, 1]) > MOVING_MPS
    in_motion = same & moving
    often = moving.any() and np.count_nonzero(in_motion) > REPEATED_SHARE * np.count_nonzero(moving)
    drop = same if often else in_motion
    count = int(np.count_nonzero(drop))
    if count:
        notes.append(InputNote("stuck_fixes", f"{_fix_count(count)} of {topic} the same as before: left out", count))
    if len(table) - count < FEWEST:
        raise NotAssessableError(SUBJECT, f"{topic} keeps one place and velocity: {_fix_count(len(table))}")
    return table.take(~drop), velocity[~drop]


_HEIGHTS = ("altitude_ellipsoid_m", "altitude_msl_m")


def _height(table: Table, notes: list[InputNote]) -> tuple[FloatArray, str]:
    """Return heights of one datum, and which."""
    ellipsoid, msl = (table.values(name) for name in _HEIGHTS)
    if 2 * np.count_nonzero(np.isfinite(ellipsoid)) >= max(int(np.count_nonzero(np.isfinite(msl))), 1):
        return ellipsoid, "ellipsoid"
    if np.isfinite(msl).any():
        notes.append(InputNote("height_msl", "heights are above mean sea level"))
        return msl, "msl"
    notes.append(InputNote("no_height", "the receiver's fixes have no height"))
    return msl, ""


def _sound(values: FloatArray, most: float) -> FloatArray:
    """Return standard deviations, NaN where they are none."""
    with np.errstate(invalid="ignore"):
        return np.asarray(np.where((values > 0.0) & (values < most), values, np.nan))


def _classes(kinds: NDArray[np.str_]) -> list[FixClass]:
    return [CLASSES.get(str(kind), STANDALONE) for kind in kinds]


def _position_sigma(table: Table, kinds: NDArray[np.str_]) -> tuple[FloatArray, str]:
    """Return sigmas north, east, down, and where they are from."""
    by_axis = [_sound(table.values(f"position_{axis}_sigma_m"), MOST_SIGMA_M) for axis in ("north", "east")]
    together = _sound(table.values("horizontal_sigma_m"), MOST_SIGMA_M) / TOGETHER
    vertical = _sound(table.values("vertical_sigma_m"), MOST_SIGMA_M)
    hdop = _dilution(table.values("hdop"))
    with np.errstate(invalid="ignore"):
        vdop = _dilution(np.sqrt(np.maximum(table.values("pdop") ** 2 - table.values("hdop") ** 2, 0.0)))
    classes = _classes(kinds)
    usual = np.array([[one.horizontal_m, one.vertical_m] for one in classes])
    scaled = np.array([one.by_dilution for one in classes])
    levels: list[tuple[str, FloatArray]] = [
        ("by axis, as logged", np.column_stack(by_axis)),
        ("horizontal and vertical, as logged", np.column_stack([together, together])),
        ("dilution times a class figure", np.where(scaled, usual[:, 0] * hdop, np.nan)[:, None].repeat(2, axis=1)),
        ("class figure of the kind of fix", usual[:, :1].repeat(2, axis=1)),
    ]
    horizontal, source = _first(levels)
    ratio = usual[:, 1] / usual[:, 0]
    by_dilution = np.where(scaled, usual[:, 1] * vdop / ratio, np.nan)
    down = np.where(np.isfinite(vertical), vertical, by_dilution)
    down = np.where(np.isfinite(down), down, ratio * horizontal.max(axis=1))
    return np.column_stack([horizontal, down]), source


def _dilution(values: FloatArray) -> FloatArray:
    with np.errstate(invalid="ignore"):
        return np.asarray(np.where((values >= LEAST_DILUTION) & (values <= MOST_DILUTION), values, np.nan))


def _velocity_sigma(table: Table, kinds: NDArray[np.str_]) -> tuple[FloatArray, str]:
    """Return sigmas north, east, down, and where they are from."""
    by_axis = [_sound(table.values(f"velocity_{axis}_sigma_mps"), MOST_SIGMA_MPS) for axis in ("north", "east", "down")]
    together = _sound(table.values("velocity_sigma_mps"), MOST_SIGMA_MPS) / TOGETHER
    usual = np.array([[one.horizontal_mps, one.vertical_mps] for one in _classes(kinds)])
    levels = [
        ("by axis, as logged", np.column_stack(by_axis[:2])),
        ("of all axes, as logged", np.column_stack([together, together])),
        ("class figure of the kind of fix", usual[:, :1].repeat(2, axis=1)),
    ]
    horizontal, source = _first(levels)
    ratio = usual[:, 1] / usual[:, 0]
    down = np.where(np.isfinite(by_axis[2]), by_axis[2], ratio * horizontal.max(axis=1))
    return np.column_stack([horizontal, down]), source


def _first(levels: list[tuple[str, FloatArray]]) -> tuple[FloatArray, str]:
    """Return for each row the first level that has it, and which levels served."""
    found = np.full(levels[0][1].shape, np.nan)
    counts = []
    for name, values in levels:
        take = ~np.isfinite(found).all(axis=1) & np.isfinite(values).all(axis=1)
        found[take] = values[take]
        counts.append((int(np.count_nonzero(take)), name))
    told = [(count, name) for count, name in counts if count]
    if len(told) == 1:
        return found, told[0][1]
    return found, "; ".join(f"{name} ({count})" for count, name in told)

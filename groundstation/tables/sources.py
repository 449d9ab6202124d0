"""Choice among sources of a kind when several logs of one flight have one.

There is an order, and a reason why the first is first.
"""

from dataclasses import dataclass

import numpy as np

from groundstation.base.signals import topics_of_kind
from groundstation.base.units import NS_PER_S
from groundstation.tables.ins_kind import AIDED, HALF
from groundstation.tables.table import Flight, Table

TOGETHER = "together"  # key of the metadata of a flight of several logs
WHOLE_SHARE = 0.8  # least cover as a share of the longest: a source with less is used for want of a better one
FASTEST_HZ = 10.0  # a faster source says no more of a motion
SURER = 1.5  # times: a smaller difference of the stated sigma is none
NEEDS = {"gnss": ("velocity_north_mps", "velocity_east_mps"), "ins": ("roll_deg", "pitch_deg")}
FIX_FIELDS = ("latitude_deg", "velocity_north_mps", "ground_speed_mps")  # a receiver with a fix logs one of them
NEVER_A_FIX = "GNSS never had a fix"


@dataclass(frozen=True)
class Ranked:
    """Source with the facts that its place among the others rests on."""

    topic: str
    has_needed: bool
    covered_s: float
    is_aided: bool
    sigma_mps: float
    rate_hz: float


def is_joined(flight: Flight) -> bool:
    """Tell whether a flight is made of several logs."""
    return TOGETHER in flight.metadata


def said_of(flight: Flight, topic: str, key: str) -> str:
    """Return the metadata of a topic's log under a key; empty where there is none.

    In a flight of several logs each log speaks for its own topics: those of the second end in ``.b``, as its keys
    begin.
    """
    label = topic.rpartition(".")[2] if is_joined(flight) else ""
    return flight.metadata.get(f"{label}.{key}" if len(label) == 1 and label.isalpha() else key, "")


def sources_of_kind(flight: Flight, kind: str) -> tuple[str, ...]:
    """Topics of a kind, the one to use first.

    In a flight of one log they are in the order of their names. In a flight of several logs the order is: those with
    velocity (GNSS) or attitude (INS), that cover most of the flight, an INS that GNSS does not correct, the smaller
    stated sigma, the higher rate up to ``FASTEST_HZ``, the earlier log.
    """
    topics = topics_of_kind(kind, flight.topics())
    if not is_joined(flight) or len(topics) < 2:
        return topics
    return tuple(one.topic for one in ranked(flight, kind))


def why_without_gnss(flight: Flight, what: str) -> str:
    """Explain why GNSS has no velocity or no position.

    The reason is ``no GNSS velocity in the log``, or that it never had a fix. A receiver that logs its satellites or
    its kind of fix and never a place or a velocity had none.
    """
    tables = [flight[topic] for topic in topics_of_kind("gnss", flight.topics()) if len(flight[topic])]
    told = [table for table in tables if table.has("satellites_used") or table.has("fix")]
    if not told or any(table.has(field) for table in tables for field in FIX_FIELDS):
        return f"no GNSS {what} in the log"
    used = [table.values("satellites_used") for table in told if table.has("satellites_used")]
    most = max((float(np.nanmax(values)) for values in used), default=np.nan)
    satellites = "" if np.isnan(most) else f", {'at most ' if most else ''}{_counted(most, 'satellite')}"
    return f"{NEVER_A_FIX}: {_counted(sum(len(table) for table in tables), 'row')}{satellites}"


def _counted(number: float, noun: str) -> str:
    return f"{number:g} {noun}" + ("" if number == 1 else "s")


def ranked(flight: Flight, kind: str) -> list[Ranked]:
    """Sources of a kind, the best first."""
    found = [
        _ranked(flight[topic], kind, said_of(flight, topic, "ins_kind"))
        for topic in topics_of_kind(kind, flight.topics())
        if len(flight[topic])
    ]
    longest_s = max((one.covered_s for one in found), default=0.0)
    known = [one.sigma_mps for one in found if np.isfinite(one.sigma_mps)]
    least_mps = min(known, default=np.nan)

    def key(one: Ranked) -> tuple[bool, bool, bool, bool, float]:
        is_short = one.covered_s < WHOLE_SHARE * longest_s
        is_unsure = len(known) == len(found) and one.sigma_mps > SURER * least_mps
        return not one.has_needed, is_short, one.is_aided, is_unsure, -round(min(one.rate_hz, FASTEST_HZ), 1)

    return sorted(found, key=key)


def why_first(kind: str, order: list[Ranked]) -> str:
    """Explain why the first of several sources is first: how it differs from the second."""
    first, *others = order
    if not others:
        return "the only one"
    second = others[0]
    if first.has_needed and not second.has_needed:
        return f"{second.topic} has no {'velocity' if kind == 'gnss' else 'attitude'}"
    if second.covered_s < WHOLE_SHARE * first.covered_s:
        return f"{first.covered_s:.0f} s of it, {second.covered_s:.0f} s of {second.topic}"
    if second.is_aided and not first.is_aided:
        return f"GNSS corrects {second.topic}, not {first.topic}"
    if second.sigma_mps > SURER * first.sigma_mps:
        return f"velocity to {first.sigma_mps:.2g} m/s, {second.topic} to {second.sigma_mps:.2g} m/s"
    if round(min(first.rate_hz, FASTEST_HZ), 1) > round(min(second.rate_hz, FASTEST_HZ), 1):
        return f"{first.rate_hz:.3g} Hz, {second.topic} {second.rate_hz:.3g} Hz"
    return f"as good as {second.topic}, and of the earlier log"


def _ranked(table: Table, kind: str, said: str) -> Ranked:
    """Rank a source; ``said`` is what its log says of the INS where the samples say nothing."""
    needed = NEEDS.get(kind, ())
    known = table.take(table.valid(*needed)) if table.has(*needed) else table
    time_s = known.time_ns / NS_PER_S
    steps_s = np.diff(time_s)
    steps_s = steps_s[steps_s > 0.0]
    usual_s = float(np.median(steps_s)) if steps_s.size else np.inf
    modes = known.text("mode") if kind == "ins" else np.zeros(0, dtype="U1")
    stated = modes[modes != ""]
    sigma = known.values("velocity_sigma_mps") if kind in NEEDS else np.full(len(known), np.nan)
    sigma = sigma[np.isfinite(sigma)]
    return Ranked(
        table.topic,
        table.has(*needed),
        float(np.sum(steps_s[steps_s <= 5.0 * usual_s])),
        bool(np.mean(stated == AIDED) > HALF) if stated.size else kind == "ins" and said.strip().lower() == AIDED,
        float(np.median(sigma)) if sigma.size else np.nan,
        1.0 / usual_s,
    )

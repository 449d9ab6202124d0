"""Choice of a source: by the order of several logs, and by what a method needs.

The kind of an INS, by its log: whether GNSS corrects it, and how often its mode says so.
"""

from typing import NamedTuple

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import NotAssessableError
from groundstation.base.records import HEADING_IS_TRACK
from groundstation.base.signals import topics_of_kind
from groundstation.base.units import NS_PER_S
from groundstation.base.words import never_a_fix
from groundstation.tables.gaps import seconds_covered
from groundstation.tables.table import Flight, Table

TOGETHER = "together"  # key of the metadata of a flight of several logs
WHOLE_SHARE = 0.8  # least cover as a share of the longest: a source with less is used for want of a better one
FASTEST_HZ = 10.0  # a faster source says no more of a motion
SURER = 1.5  # times: a smaller difference of the stated sigma is none
NEEDS = {"gnss": ("velocity_north_mps", "velocity_east_mps"), "ins": ("roll_deg", "pitch_deg")}
FIX_FIELDS = ("latitude_deg", "velocity_north_mps", "ground_speed_mps")  # a receiver with a fix logs one of them
LONGEST_STEP_S = 10.0  # between samples for a source to count as there
UNAIDED, AIDED, UNKNOWN = "unaided", "gnss_aided", "unknown"  # kinds of INS
STATED = (UNAIDED, AIDED)  # kinds that an aircraft file or the head of a log may state
HALF = 0.5


@dataclass(frozen=True)
class Need:
    """Needs of a method from the source it works with.

    Parameters
    ----------
    kind : str
        Of topic.
    what : str
        In words: "INS heading".
    fields : tuple of str
    or_else : tuple of str
        Fields that serve where no source has the others.
    is_nose : bool
        A heading that is the receiver's own track does not serve: it does not tell where the nose points.
    takes_longest : bool
        Of a flight of one log, the source whose fields are known for the most minutes comes first.
    """

    kind: str
    what: str
    fields: tuple[str, ...]
    or_else: tuple[str, ...] = ()
    is_nose: bool = False
    takes_longest: bool = False


GNSS_VELOCITY = Need("gnss", "GNSS velocity", ("velocity_north_mps", "velocity_east_mps"))


@dataclass(frozen=True)
class PairNeed:
    """Needs of an analysis from an INS and the GNSS compared with it."""

    analysis: str
    ins: Need
    gnss: Need


class Pair(NamedTuple):
    """Topics of an INS and of the GNSS compared with it."""

    ins: str
    gnss: str


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
    return flight.once(("sources", kind), lambda one: tuple(source.topic for source in ranked(one, kind)))


def choose_pair(flight: Flight, need: PairNeed, ins_topic: str = "", gnss_topic: str = "") -> Pair:
    """Return the INS and GNSS topics that an analysis works with.

    They are those named, else the first that have what it needs.

    Raises
    ------
    NotAssessableError
        When there is no pair.
    """
    ins = choose_source(flight, need.ins, need.analysis, ins_topic)
    gnss = choose_source(flight, need.gnss, need.analysis, gnss_topic)
    if need.ins.is_nose and _is_track(flight, ins):
        text = f"the heading of {ins} is the receiver's own track: their difference is zero whatever the nose does"
        raise NotAssessableError(need.analysis, text)
    return Pair(ins, gnss)


def choose_source(flight: Flight, need: Need, analysis: str, named: str = "") -> str:
    """Return the topic that an analysis works with.

    It is the one named, else the first that has what it needs.

    Raises
    ------
    NotAssessableError
        When there is none.
    """
    having = flight.once(need, lambda one: _having(one, need))
    if named in having or (having and not named):
        return named or having[0]
    if named:
        raise NotAssessableError(analysis, f"no {need.what} in {named}" if named in flight else f"no topic {named}")
    is_gnss = need.kind == "gnss"
    why = why_without_gnss(flight, need.what.removeprefix("GNSS ")) if is_gnss else f"no {need.what} in the log"
    raise NotAssessableError(analysis, why)


def _having(flight: Flight, need: Need) -> tuple[str, ...]:
    """Topics that have what is needed, the one to use first."""
    sources = sources_of_kind(flight, need.kind)
    having = [topic for topic in sources if flight[topic].has(*need.fields)]
    if need.or_else:
        having += [topic for topic in sources if topic not in having and flight[topic].has(*need.or_else)]
    if need.takes_longest and not is_joined(flight):
        having.sort(key=lambda topic: -round(_known_s(flight[topic], need.fields) / 60.0))
    return tuple(sorted(having, key=lambda topic: need.is_nose and _is_track(flight, topic)))


def _is_track(flight: Flight, topic: str) -> bool:
    """Tell whether a topic's heading is a receiver's own track.

    A track does not measure where the nose points.
    """
    return f"{HEADING_IS_TRACK}.{topic}.true_heading_deg" in flight.metadata


def _known_s(table: Table, fields: tuple[str, ...]) -> float:
    times = table.time_ns[table.valid(*fields)] / NS_PER_S
    return seconds_covered(times - times[0], LONGEST_STEP_S) if len(times) else 0.0


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
    return never_a_fix(sum(len(table) for table in tables), None if np.isnan(most) else most)


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


def aided_share(table: Table) -> float:
    """Share of the samples with a mode whose mode is ``gnss_aided``; 0 where none has a mode."""
    modes = table.text("mode")
    stated = modes != ""
    return float(np.mean(modes[stated] == AIDED)) if stated.any() else 0.0


def is_mostly_aided(table: Table) -> bool:
    """Tell whether the logged mode of an INS is ``gnss_aided`` for more than half of the time."""
    return aided_share(table) > HALF

"""Anonymous flight: places turned about the earth's axis, dates moved, names removed.

Dates move by whole weeks; texts are removed too. Latitude and height stay, so that gravity, the rate of the earth, the
convergence of meridians and all differences stay exactly what they were; time of day and week stay with the whole
weeks. A magnetic heading is that of the new place and date: the true heading that follows from it is the same.
"""

import hashlib
import hmac
import math
import secrets
from collections.abc import Callable, Mapping
from dataclasses import field, replace
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from groundstation.base.angles import FloatArray, wrap_180, wrap_360
from groundstation.base.clock import Clock
from groundstation.base.dataclasses import dataclass
from groundstation.base.declination import declination_along
from groundstation.base.errors import NotAssessableError
from groundstation.base.ledger import DamagedSpan, Ledger
from groundstation.base.records import HEADING_IS_TRACK, BoolArray, Column, Damage, Int64Array, RecordBatch
from groundstation.base.signals import TOPICS, is_canonical, kind_of
from groundstation.base.timescales import utc_ns_to_iso
from groundstation.base.units import NS_PER_S
from groundstation.methods.ins_noise import class_names
from groundstation.tables.headings import positions_for
from groundstation.tables.sources import STATED
from groundstation.tables.table import Flight
from groundstation.tables.vehicle import ALWAYS_ON_GROUND, KINDS, VEHICLE, YES

if TYPE_CHECKING:
    from groundstation.store.info import StoreInfo

# Field, iron and orbits tell the place or the date to whoever has a model of them.
LEFT_OUT = frozenset(("magnetometer", "corrected_heading", "satellite"))
NAMED = frozenset(("link", "adf"))  # topics whose second part is the name of an aircraft or a beacon
MAGNETIC_HEADING = "magnetic_heading_deg"
COLUMNS_LEFT_OUT = frozenset(("frequency_mhz", "course_magnetic_deg"))  # of a localizer: it is found by them
WORDS = frozenset(("mode", "constellation", "fix", "severity"))  # text of a few fixed words
ORIGINS = ("magnetic", "land")  # what analyses look for in the text that tells what a field was derived from
ANONYMOUS, ZERO_EVENT = "anonymous", "flight time zero"
LEAST_SHIFT_DEG, WEEKS, FORWARD_BEFORE_YEAR = 10.0, (26, 300), 2018  # models of the field serve 2010 to 2029
ON_EARTH_M = 6.0e6  # nearer to the origin, a position is one of a local frame
WEEK_NS, YEAR_NS = 7 * 86_400 * NS_PER_S, 31_556_952 * NS_PER_S
DATE_NS = 25 * YEAR_NS  # times so near to the start are dates, others count from elsewhere
XYZ = "xyz"


def _number(text: str) -> str:
    """Return a number as it was written; empty where it is none."""
    try:
        return text.strip() if math.isfinite(float(text)) else ""
    except ValueError:
        return ""


def _word_of(*words: str) -> Callable[[str], str]:
    """Make a function that returns a text if it is a known word, else an empty text."""
    return lambda text: text.strip().lower() if text.strip().lower() in words else ""


_FACTS: Mapping[str, Callable[[str], str]] = MappingProxyType(
    {
        "ins_kind": _word_of(*STATED),
        "ins_class": lambda text: _word_of(*class_names())(text),
        ALWAYS_ON_GROUND: _word_of(*YES),
        VEHICLE: _word_of(*KINDS),
        **dict.fromkeys(("clip.zero_s", "clip.from_s", "clip.to_s"), _number),
        **dict.fromkeys(("reference.parking_heading_deg", "reference.parking_heading_sigma_deg"), _number),
    }
)


@dataclass(frozen=True)
class Disguise:
    """Changes that make a flight anonymous.

    The same seed gives the same disguise, so that the flights of a session still fit together.

    Parameters
    ----------
    seed : int
        A secret: whoever knows or guesses it can undo the shift. The default is drawn by ``secrets``.
    start_utc_ns : int, optional
        First corrected time; None for a flight without UTC, whose times stay.
    change_deg : mapping of topic to (time_ns (n,), degrees (n,))
        Added to magnetic headings: declination of the true place minus that of the new one.
    """

    seed: int = field(default_factory=lambda: secrets.randbits(128))
    start_utc_ns: int | None = None
    change_deg: Mapping[str, tuple[Int64Array, FloatArray]] = field(default_factory=dict)

    @cached_property
    def _drawn(self) -> tuple[float, int]:
        rng = np.random.default_rng(self.seed)
        return float(rng.uniform(LEAST_SHIFT_DEG, 360.0 - LEAST_SHIFT_DEG)), int(rng.integers(*WEEKS))

    @property
    def shift_deg(self) -> float:
        """Degrees that every longitude is moved east."""
        return self._drawn[0]

    @property
    def shift_ns(self) -> int:
        """Time added to every time: whole weeks, backwards except for old flights.

        Zero without UTC.
        """
        if self.start_utc_ns is None:
            return 0
        is_old = 1970 + self.start_utc_ns // YEAR_NS < FORWARD_BEFORE_YEAR
        return (1 if is_old else -1) * self._drawn[1] * WEEK_NS

    def alias(self, name: str) -> str:
        """Return another name for a name, the same for the same seed.

        Examples
        --------
        >>> Disguise(1).alias("RA-1"), Disguise(1).alias("RA-1") == Disguise(2).alias("RA-1")
        ('Nf5377a', False)
        """
        digest = hmac.new(str(self.seed).encode(), name.encode("utf-8", "replace"), hashlib.sha256).hexdigest()
        return f"N{digest[:6]}"

    def topic(self, topic: str) -> str | None:
        """Return the name a topic gets; None for one that is left out."""
        if not is_canonical(topic) or kind_of(topic) in LEFT_OUT:
            return None
        kind, _, name = topic.partition(".")
        return f"{kind}.{self.alias(name)}" if kind in NAMED and name else topic

    def batch(self, batch: RecordBatch) -> RecordBatch | None:
        """Return records in disguise; None for those of a topic that is left out."""
        topic = self.topic(batch.topic)
        if topic is None:
            return None
        columns = {name: self._column(name, one, batch) for name, one in batch.columns.items()}
        kept = {name: one for name, one in columns.items() if one is not None}
        return replace(
            batch,
            topic=topic,
            columns={**kept, **self._turned(kept)},
            time_ns=None if batch.time_ns is None else batch.time_ns + self.shift_ns,
            validity_time_ns=None if batch.validity_time_ns is None else batch.validity_time_ns + self.shift_ns,
            device_time_ns=self._device_time(batch.device_time_ns),
        )

    def zero(self, time_ns: int) -> RecordBatch:
        """Return an event at flight time zero.

        It keeps zero in place when the topic that began first is left out.
        """
        at = np.array([time_ns + self.shift_ns])
        name = Column(np.array([ZERO_EVENT]))
        unknown = Column(np.zeros(1, dtype=np.int64), np.zeros(1, dtype=bool))
        return RecordBatch("event", np.zeros(1, dtype=np.int64), unknown, {"name": name}, at)

    def damage(self, damage: Damage) -> Damage:
        """Return damage without texts."""
        return replace(damage, place="", what=damage.kind, topic=self.topic(damage.topic) or "")

    def _device_time(self, column: Column) -> Column:
        """Return the recorder's own time: moved where it is a date."""
        if self.start_utc_ns is None:
            return column
        values = column.values.astype(np.int64)
        return Column(np.where(self._is_date(values), values + self.shift_ns, values), column.present)

    def _is_date(self, time_ns: Int64Array | FloatArray) -> BoolArray:
        """Tell whether times count from 1970: those of the flight's years."""
        return np.asarray(np.abs(time_ns - (self.start_utc_ns or 0)) < DATE_NS)

    def _column(self, name: str, column: Column, batch: RecordBatch) -> Column | None:
        if column.values.dtype.kind == "U":
            return self._text(name, column, kind_of(batch.topic))
        if name in COLUMNS_LEFT_OUT:
            return None
        if name == "longitude_deg":
            return Column(wrap_180(column.values.astype(np.float64) + self.shift_deg), column.present)
        if name == "transmission_time_s" and self.start_utc_ns is not None:
            seconds = column.values.astype(np.float64)
            return Column(
                np.where(self._is_date(seconds * NS_PER_S), seconds + self.shift_ns / NS_PER_S, seconds), column.present
            )
        if name == MAGNETIC_HEADING:
            known = self.change_deg.get(batch.topic)
            if known is None or batch.time_ns is None:
                return None
            change = np.interp(batch.time_ns, *known)
            return Column(wrap_360(column.values.astype(np.float64) + change), column.present)
        return column

    def _text(self, name: str, column: Column, kind: str) -> Column | None:
        texts = column.values.astype(np.str_)
        if name in WORDS:
            return column
        if kind == "event":
            return Column(np.array([self.alias(str(one)) for one in texts], dtype=np.str_), column.present)
        if kind == "guidance" and name == "source":  # what guides decides what it can be a reference for
            return Column(np.where(np.char.find(texts, "GPS") >= 0, "GPS", "localizer"), column.present)
        return None

    def _turned(self, columns: Mapping[str, Column]) -> dict[str, Column]:
        """Return positions and covariances about the earth's centre, turned about its axis."""
        names = [f"position_{axis}_m" for axis in XYZ]
        if not all(name in columns for name in names):
            return {}
        place = np.stack([columns[name].values.astype(np.float64) for name in names])
        angle = np.where(np.linalg.norm(place, axis=0) > ON_EARTH_M, np.deg2rad(self.shift_deg), 0.0)
        turn = np.zeros((len(angle), 3, 3))
        turn[:, 0, 0] = turn[:, 1, 1] = np.cos(angle)
        turn[:, 1, 0], turn[:, 2, 2] = np.sin(angle), 1.0
        turn[:, 0, 1] = -turn[:, 1, 0]
        moved = np.einsum("nij,jn->in", turn, place)
        out = {name: Column(values, columns[name].present) for name, values in zip(names, moved, strict=True)}
        pairs = {f"covariance_{XYZ[i]}{XYZ[j]}_m2": (i, j) for i in range(3) for j in range(i, 3)}
        if all(name in columns for name in pairs):
            spread = np.zeros((len(angle), 3, 3))
            for name, (i, j) in pairs.items():
                spread[:, i, j] = spread[:, j, i] = columns[name].values
            spread = turn @ spread @ turn.transpose(0, 2, 1)
            out |= {name: Column(spread[:, i, j], columns[name].present) for name, (i, j) in pairs.items()}
        return out

    def info(self, info: "StoreInfo") -> "StoreInfo":
        """Return facts of the flight without names, places, dates and free text."""
        facts = {}
        for name, value in info.metadata.items():
            fact = self._fact(name, value)
            facts.update({} if fact is None else dict([fact]))
        if info.metadata.get("aircraft"):
            facts["aircraft"] = self.alias(info.metadata["aircraft"].strip())
        start_ns = None if info.start_ns is None else info.start_ns + self.shift_ns
        bare: list[Any] = [{**entry, "place": "", "what": entry.get("kind", "")} for entry in info.damages]
        return replace(
            info,
            source_name="",
            source_sha256="",
            reader=info.reader.partition(" ")[0],
            configuration={},
            metadata={**facts, ANONYMOUS: "longitudes turned, dates moved, names and texts replaced or left out"},
            start_ns=start_ns,
            clock=Clock(is_absolute=info.clock.is_absolute, is_counting=info.clock.is_counting),
            ledger=self._ledger(info.ledger, start_ns if info.has_utc else None),
            findings=(),
            remarks=(),
            damages=bare,
        )

    def _fact(self, name: str, value: str) -> tuple[str, str] | None:
        """Return a fact of the head of the log that may be kept, else None.

        It has a known key with a number or a known word.
        """
        if name in _FACTS:
            known = _FACTS[name](value)
            return (name, known) if known else None
        code, _, path = name.partition(".")
        topic, _, column = path.rpartition(".")
        shown = self.topic(topic)
        if code not in ("derived", HEADING_IS_TRACK) or shown is None:
            return None
        if column not in {one.name for one in TOPICS[kind_of(topic)]}:
            return None
        origin = next((word for word in ORIGINS if word in value.lower()), "another signal")
        return f"{code}.{shown}.{column}", origin if code == "derived" else code

    def _ledger(self, ledger: Ledger, start_utc_ns: int | None) -> Ledger:
        """Return the damage that only the log could tell, without texts and places."""
        spans = (self._span(one, start_utc_ns) for one in ledger.spans)
        return Ledger(
            spans=tuple(one for one in spans if one is not None),
            damages=tuple(
                replace(one, place="", what=one.kind, topic=self.topic(one.topic) or "") for one in ledger.damages
            ),
            thresholds=ledger.thresholds,
        )

    def _span(self, span: DamagedSpan, start_utc_ns: int | None) -> DamagedSpan | None:
        topic = self.topic(span.topic) if span.topic else ""
        if topic is None:
            return None
        start = "" if start_utc_ns is None else utc_ns_to_iso(start_utc_ns + round(span.start_s * NS_PER_S))
        return replace(span, topic=topic, start=start)


def disguise_of(mcap: Path, info: "StoreInfo", seed: int | None) -> Disguise:
    """Return the disguise of a flight, with the change of its magnetic headings."""
    plain = Disguise() if seed is None else Disguise(seed)
    plain = replace(plain, start_utc_ns=info.start_ns if info.has_utc else None)
    if plain.start_utc_ns is None:
        return plain
    flight = _positions_of(mcap, info)
    changes = {topic: _change(flight, topic, plain) for topic in flight.topics() if flight[topic].has(MAGNETIC_HEADING)}
    return replace(plain, change_deg={topic: change for topic, change in changes.items() if change is not None})


def _positions_of(mcap: Path, info: "StoreInfo") -> Flight:
    from groundstation.store.reader import StorePart, read
    from groundstation.tables.assemble import flight_from_batches

    everything = np.iinfo(np.int64)
    part = StorePart(everything.min, everything.max, lambda topic: kind_of(topic) in ("ins", "gnss"))
    batches = (item for item in read(mcap, part) if isinstance(item, RecordBatch))
    return flight_from_batches(batches, metadata={}, has_utc=info.has_utc, source_name="", rows=info.ledger.rows)


def _change(flight: Flight, topic: str, disguise: Disguise) -> tuple[Int64Array, FloatArray] | None:
    """Return declination of the true places minus that of the new ones, over time.

    None where it cannot be known.
    """
    try:
        table = positions_for(flight, flight[topic])
        latitude, longitude = table.values("latitude_deg"), table.values("longitude_deg")
        altitude = table.values("altitude_ellipsoid_m")
        altitude = np.where(np.isfinite(altitude), altitude, table.values("altitude_msl_m"))
        assert disguise.start_utc_ns is not None
        before = declination_along(latitude, longitude, altitude, disguise.start_utc_ns)
        moved = wrap_180(longitude + disguise.shift_deg)
        after = declination_along(latitude, moved, altitude, disguise.start_utc_ns + disguise.shift_ns)
    except NotAssessableError:
        return None
    return table.time_ns, wrap_180(before.values_deg - after.values_deg)

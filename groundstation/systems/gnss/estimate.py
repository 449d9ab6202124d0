"""Reception of all receivers of a flight."""

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import FloatArray
from groundstation.base.errors import NotAssessableError
from groundstation.base.findings import Finding
from groundstation.base.signals import kind_of, topics_of_kind
from groundstation.results.figures import FigureData
from groundstation.results.roles import Delay, Delays
from groundstation.systems.gnss.answer import WITHOUT_FIX, WITHOUT_RECORD, GnssReceiver, GnssReception
from groundstation.systems.gnss.arrays import (
    GnssAveraging,
    GnssMissing,
    GnssPairs,
    GnssQuality,
    GnssStandstill,
    GnssStates,
)
from groundstation.systems.gnss.judge import Judged, judge, judge_pair, worst_of
from groundstation.systems.gnss.motion import Steps, steps_of
from groundstation.systems.gnss.pairs import ComparedReceivers, compare
from groundstation.systems.gnss.series import ReceiverRows, series_of
from groundstation.systems.gnss.settings import GnssSettings
from groundstation.systems.gnss.spells import (
    Spells,
    logged_s,
    losses_of,
    seconds_after_first_fix,
    spells_of,
    states_of,
)
from groundstation.systems.gnss.standstill import Stood, longest_of, standstills_of
from groundstation.systems.gnss.texts import finding_of, has_heading_source, texts_of
from groundstation.systems.gnss.wording_answer import never_had, sentence_of
from groundstation.tables.phases import Phases
from groundstation.tables.sources import sources_of_kind
from groundstation.tables.table import Flight

NO_GNSS = "no GNSS in the log"
MOST_ROWS = 20_000  # of a figure for each receiver; longer ones are thinned
TAIL = 0.05  # share of the time beyond ``*_low`` and ``*_high``
OTHER_SENSORS = ("ins", "baro", "magnetometer", "electric", "air", "odometry")
NEVER_ZERO = ("satellites_used", "satellites_tracked", "hdop", "pdop")  # zero throughout beside a fix: not filled in


class One(NamedTuple):
    """A receiver with the workings behind its answer."""

    rows: ReceiverRows
    spells: Spells
    stood: Stood | None
    steps: Steps
    answer: GnssReceiver


class Reception(NamedTuple):
    """Answer and findings."""

    answer: GnssReception
    findings: tuple[Finding, ...]


def topics_of(flight: Flight) -> tuple[str, ...]:
    """Topics of receivers that have rows, in the order of their names."""
    return tuple(topic for topic in topics_of_kind("gnss", flight.topics()) if len(flight[topic]))


def reception_of(
    flight: Flight, phases: Phases, delays: Delays | None = None, *, settings: GnssSettings | None = None
) -> Reception:
    """Assess the reception of every receiver, and of each pair of them.

    Raises
    ------
    NotAssessableError
        When the log has no row of a receiver.
    """
    settings = settings or GnssSettings()
    topics = topics_of(flight)
    if not topics:
        raise NotAssessableError("gnss", NO_GNSS)
    others_s = _others_s(flight)
    found = [_one(flight, topic, phases, delays, others_s, settings) for topic in topics]
    pairs = [
        pair
        for place, first in enumerate(found)
        for second in found[place + 1 :]
        if (pair := compare(first.rows, second.rows, settings)) is not None
    ]
    main = max(found, key=lambda one: one.answer.fix_share * float(one.rows.held_s.sum()))
    if main.answer.first_fix_s is None:
        main = found[0]
    judged = [
        reason
        for one in found
        for reason in judge(one.answer, one.rows, settings, one is main or main.answer.first_fix_s is None)
    ]
    judged += [reason for pair in pairs for reason in judge_pair(pair.answer)]
    texts = texts_of(flight)
    answer = GnssReception(
        grade=worst_of(judged, main.answer),
        sentence=_sentence([one.answer for one in found], main.answer),
        reasons=tuple(_named(reason, len(found)) for reason in judged if reason.grade != "good"),
        main=main.rows.topic,
        receivers=tuple(one.answer for one in found),
        pairs=tuple(pair.answer for pair in pairs),
        texts=texts,
        has_heading_source=has_heading_source(flight),
        settings=asdict(settings),
        figures=_figures(found, pairs),
    )
    return Reception(answer, (*(reason.finding for reason in judged), *(finding_of(one) for one in texts)))


def _named(reason: Judged, receivers: int) -> str:
    return f"{reason.topic}: {reason.text}" if receivers > 1 else reason.text


def _sentence(every: Sequence[GnssReceiver], main: GnssReceiver) -> str:
    """Return the sentence of the main receiver, and that another one never had a fix."""
    if len(every) == 1:
        return sentence_of(main)
    dead = [one for one in every if one.first_fix_s is None and one is not main]
    others = "".join(f"; {one.topic}: {never_had(one).replace('GNSS never', 'never')}" for one in dead)
    return f"{main.topic}: {sentence_of(main)}{others}"


def _others_s(flight: Flight) -> tuple[FloatArray, ...]:
    """Return the times of the rows of each other sensor, sorted."""
    topics = [topic for topic in flight.topics() if kind_of(topic) in OTHER_SENSORS and len(flight[topic])]
    return tuple(np.sort(flight.time_s(topic), kind="stable") for topic in topics)


def _one(
    flight: Flight,
    topic: str,
    phases: Phases,
    delays: Delays | None,
    others_s: Sequence[FloatArray],
    settings: GnssSettings,
) -> One:
    rows = series_of(flight, topic, settings)
    spells = spells_of(rows, others_s)
    states = states_of(rows, spells)
    each = standstills_of(rows, phases, settings)
    stood = longest_of(each)
    steps = steps_of(rows, settings)
    with_fix = np.flatnonzero(rows.has_fix)
    used, tracked = _values(rows, "satellites_used"), _values(rows, "satellites_tracked")
    cn0, hdop, pdop = _values(rows, "cn0_dbhz"), _values(rows, "hdop"), _values(rows, "pdop")
    age = rows.values("age_of_corrections_s")
    delay = _delay(flight, topic, delays)
    answer = GnssReceiver(
        topic=topic,
        start_s=float(rows.time_s[0]),
        end_s=float(rows.time_s[-1]),
        rows=rows.rows,
        rate_hz=1.0 / rows.step_s if np.isfinite(rows.step_s) else None,
        repeated_rows=rows.rows - len(rows.time_s),
        missed_epochs=rows.missed,
        is_kind_logged=rows.table.has("fix"),
        placeless_rows=rows.placeless,
        states=states,
        first_fix_s=float(rows.time_s[with_fix[0]]) if with_fix.size else None,
        fix_share=_share_with_fix(rows, spells),
        lost_s=seconds_after_first_fix(rows, spells, WITHOUT_FIX),
        silent_s=seconds_after_first_fix(rows, spells, WITHOUT_RECORD),
        losses=losses_of(rows, spells, settings),
        satellites_used=_quantile(rows, used, 0.5) if with_fix.size else _most(rows, "satellites_used"),
        satellites_used_low=_quantile(rows, used, TAIL),
        satellites_tracked=_quantile(rows, tracked, 0.5) if with_fix.size else _most(rows, "satellites_tracked"),
        cn0_dbhz=_quantile(rows, cn0, 0.5),
        cn0_low_dbhz=_quantile(rows, cn0, TAIL),
        hdop=_quantile(rows, hdop, 0.5),
        hdop_high=_quantile(rows, hdop, 1.0 - TAIL),
        pdop=_quantile(rows, pdop, 0.5),
        pdop_high=_quantile(rows, pdop, 1.0 - TAIL),
        age_of_corrections_s=_quantile(rows, age, 0.5),
        age_of_corrections_high_s=_quantile(rows, age, 1.0 - TAIL),
        horizontal_sigma_m=_quantile(rows, rows.values("horizontal_sigma_m"), 0.5),
        vertical_sigma_m=_quantile(rows, rows.values("vertical_sigma_m"), 0.5),
        velocity_sigma_mps=_quantile(rows, rows.values("velocity_sigma_mps"), 0.5),
        standstill=None if stood is None else stood.answer,
        motion=steps.answer,
        jumps=steps.jumps,
        jumps_found=steps.jumps_found,
        behind_ins_s=None if delay is None else delay.latency_s,
        behind_ins_sigma_s=None if delay is None else delay.sigma_s,
        standstills=tuple(one.answer for one in each),
        hdop_of=rows.hdop_of,
    )
    shown = next((one for one in each if one.answer is answer.told_standstill), None)
    return One(rows, spells, shown, steps, answer)


def _share_with_fix(rows: ReceiverRows, spells: Spells) -> float:
    whole_s = logged_s(spells)
    return float(rows.held_s[rows.has_fix].sum()) / whole_s if whole_s > 0.0 else float(rows.has_fix.mean())


def _values(rows: ReceiverRows, name: str) -> FloatArray:
    """Values while there is a fix.

    None where a driver that does not know them leaves zero throughout.
    """
    values = rows.values(name)
    known = values[np.isfinite(values)]
    return np.full(len(values), np.nan) if name in NEVER_ZERO and not known.any() else values


def _most(rows: ReceiverRows, name: str) -> float | None:
    values = rows.table.values(name)
    return float(np.nanmax(values)) if np.isfinite(values).any() else None


def _quantile(rows: ReceiverRows, values: FloatArray, share: float) -> float | None:
    """Value below which the rows stand for a share of the known time.

    None where nothing is known.
    """
    known = np.flatnonzero(np.isfinite(values))
    if not known.size:
        return None
    order = known[np.argsort(values[known], kind="stable")]
    held = rows.held_s[order]
    if not held.sum() > 0.0:
        held = np.ones(len(order))
    passed = np.cumsum(held)
    at = int(np.searchsorted(passed, share * passed[-1]))
    return float(values[order[min(at, len(order) - 1)]])


def _delay(flight: Flight, topic: str, delays: Delays | None) -> Delay | None:
    """Return the delay behind the first INS by which it was observed."""
    if delays is None:
        return None
    found = (delays.observed(ins, topic) for ins in sources_of_kind(flight, "ins"))
    return next((one for one in found if one is not None), None)


def _figures(found: Sequence[One], pairs: Sequence[ComparedReceivers]) -> tuple[FigureData, ...]:
    figures: list[FigureData] = [
        GnssStates(
            topic=np.concatenate([np.full(len(one.spells.state), one.rows.topic) for one in found]),
            start_s=np.concatenate([one.spells.start_s for one in found]),
            end_s=np.concatenate([one.spells.end_s for one in found]),
            state=np.concatenate([one.spells.state for one in found]),
        ),
        _quality(found),
    ]
    places = [_missing(one.rows) for one in found if one.rows.missed]
    if places:
        figures.append(GnssMissing(**{name: np.concatenate([one[name] for one in places]) for name in places[0]}))
    stood = [(one.rows, one.stood) for one in found if one.stood is not None]
    if stood:
        figures += [_standstill(stood), _averaging(stood)]
    if pairs:
        figures.append(_pairs(pairs))
    return tuple(figures)


def _missing(rows: ReceiverRows) -> dict[str, NDArray[Any]]:
    """Return the places where epochs of a receiver are missing, by column."""
    missing = np.zeros(0) if rows.missing is None else rows.missing.astype(np.float64)
    at = np.flatnonzero(missing)
    return {
        "topic": np.full(len(at), rows.topic),
        "after_s": rows.time_s[at],
        "next_s": rows.time_s[at + 1],
        "epochs": missing[at],
    }


def _thinned(count: int) -> slice:
    return slice(None, None, max(-(-count // MOST_ROWS), 1))


def _quality(found: Sequence[One]) -> GnssQuality:
    kept = [_thinned(len(one.rows.time_s)) for one in found]
    each = list(zip(found, kept, strict=True))

    def column(name: str) -> FloatArray:
        return np.concatenate([_values(one.rows, name)[rows] for one, rows in each])

    return GnssQuality(
        topic=np.concatenate([np.full(len(one.rows.time_s[rows]), one.rows.topic) for one, rows in each]),
        time_s=np.concatenate([one.rows.time_s[rows] for one, rows in each]),
        satellites_used=np.concatenate([one.rows.table.values("satellites_used")[rows] for one, rows in each]),
        satellites_tracked=column("satellites_tracked"),
        cn0_dbhz=column("cn0_dbhz"),
        hdop=column("hdop"),
        pdop=column("pdop"),
        age_of_corrections_s=column("age_of_corrections_s"),
        horizontal_sigma_m=column("horizontal_sigma_m"),
        vertical_sigma_m=column("vertical_sigma_m"),
        velocity_sigma_mps=column("velocity_sigma_mps"),
        position_step_m=np.concatenate([np.hypot(*one.steps.beyond_m[rows].T) for one, rows in each]),
    )


def _standstill(stood: Sequence[tuple[ReceiverRows, Stood]]) -> GnssStandstill:
    kept = [(rows, one, _thinned(len(one.rows))) for rows, one in stood]
    offset = np.concatenate([one.offset_m[some] for _rows, one, some in kept])
    return GnssStandstill(
        topic=np.concatenate([np.full(len(one.rows[some]), rows.topic) for rows, one, some in kept]),
        time_s=np.concatenate([rows.time_s[one.rows[some]] for rows, one, some in kept]),
        north_m=offset[:, 0],
        east_m=offset[:, 1],
        up_m=offset[:, 2],
    )


def _averaging(stood: Sequence[tuple[ReceiverRows, Stood]]) -> GnssAveraging:
    whole = [one.scatter_m[:1].repeat(len(one.averaged_s)) for _rows, one in stood]
    steps = [one.averaged_s / one.averaged_s[:1] if len(one.averaged_s) else one.averaged_s for _rows, one in stood]
    return GnssAveraging(
        topic=np.concatenate([np.full(len(one.averaged_s), rows.topic) for rows, one in stood]),
        averaged_s=np.concatenate([one.averaged_s for _rows, one in stood]),
        scatter_m=np.concatenate([one.scatter_m for _rows, one in stood]),
        without_memory_m=np.concatenate([w / np.sqrt(s) for w, s in zip(whole, steps, strict=True)]),
    )


def _pairs(pairs: Sequence[ComparedReceivers]) -> GnssPairs:
    kept = [(one, _thinned(len(one.time_s))) for one in pairs]
    place = np.concatenate([one.place_m[rows] for one, rows in kept])
    velocity = np.concatenate([one.velocity_mps[rows] for one, rows in kept])
    return GnssPairs(
        pair=np.concatenate(
            [np.full(len(one.time_s[rows]), f"{one.answer.second} from {one.answer.first}") for one, rows in kept]
        ),
        time_s=np.concatenate([one.time_s[rows] for one, rows in kept]),
        north_m=place[:, 0],
        east_m=place[:, 1],
        up_m=place[:, 2],
        distance_m=np.hypot(place[:, 0], place[:, 1]),
        north_mps=velocity[:, 0],
        east_mps=velocity[:, 1],
    )

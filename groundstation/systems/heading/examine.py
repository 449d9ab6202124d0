"""Shortfalls of a flight for a heading correction, by the gates that need no estimate."""

from itertools import groupby

import numpy as np

from groundstation.methods.taxi.samples import HEADING_AND_VELOCITY, TaxiSamples
from groundstation.results.roles import Delays
from groundstation.systems.analysis import Shortfall
from groundstation.systems.heading.gates_answer import GATES
from groundstation.systems.heading.settings import HeadingRequest, HeadingSettings
from groundstation.systems.heading.standstill import find_standstill
from groundstation.systems.heading.taxi import delay_of, straight_taxi
from groundstation.systems.heading.verdict import JudgedValues, build_gates
from groundstation.systems.heading.wording import told
from groundstation.systems.known import Known
from groundstation.tables.headings import true_heading
from groundstation.tables.phases import ground_mask
from groundstation.tables.sources import choose_pair
from groundstation.tables.table import Flight

Spans = tuple[tuple[float, float], ...]


def examine_heading(flight: Flight, known: Known, settings: HeadingSettings) -> tuple[Shortfall, ...]:
    """Judge the straight taxi of a flight by the gates of the data alone.

    Precision and steadiness are not looked at.

    Raises
    ------
    NotAssessableError
        Where nothing can be estimated, with the reason that the estimate would give.
    """
    if known.intervals_problem:
        raise known.intervals_problem
    request = HeadingRequest(intervals=known.intervals)
    topics = choose_pair(flight, HEADING_AND_VELOCITY, request.ins_topic, request.gnss_topic)
    delay = delay_of(topics, known.answer_meeting(Delays), known.aircraft, settings)
    samples = straight_taxi(
        *(flight, *topics),
        settings=settings,
        request=request,
        on_ground=lambda time_ns: ground_mask(flight, time_ns),
        heading=lambda topic: true_heading(flight, topic),
        phases=known.phases,
        gnss_latency_s=delay.latency_s if delay else 0.0,
    )
    standstill, taxi = find_standstill(samples, settings).answer, taxi_spans(samples)
    stood = () if standstill is None else ((standstill.start_s, standstill.end_s),)
    shown: dict[str, Spans] = {"standstill": stood, "taxi": taxi}
    gates = build_gates(samples, standstill, JudgedValues(taxi_seconds=_seconds(samples, taxi)), settings)
    return tuple(
        Shortfall(told((gate,)), () if gate.value is None else shown[GATES[gate.name].from_data_alone])
        for gate in gates
        if GATES[gate.name].from_data_alone and gate.required and gate.state != "passed"
    )


def taxi_spans(samples: TaxiSamples) -> Spans:
    """Flight seconds of the straight segments used."""
    used = np.flatnonzero(samples.is_used)
    runs = [list(rows) for _, rows in groupby(used, key=lambda row: samples.segment[row])]
    return tuple((float(samples.time_s[rows[0]]), float(samples.time_s[rows[-1]])) for rows in runs)


def _seconds(samples: TaxiSamples, taxi: Spans) -> float:
    return float(sum(end_s - start_s + samples.interval_s for start_s, end_s in taxi))

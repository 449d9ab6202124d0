"""Shortfalls of a flight for a heading correction, by the gates that need no estimate."""

from itertools import groupby

import numpy as np

from groundstation.methods.taxi.samples import TaxiSamples
from groundstation.results.roles import Delays
from groundstation.systems.analysis import Shortfall
from groundstation.systems.heading.answer import seconds_of_segments
from groundstation.systems.heading.gates_answer import GATES
from groundstation.systems.heading.settings import HeadingRequest, HeadingSettings
from groundstation.systems.heading.taxi import taxi_of_flight
from groundstation.systems.heading.verdict import JudgedValues, build_gates
from groundstation.systems.heading.wording import told
from groundstation.systems.known import Known
from groundstation.tables.headings import true_heading
from groundstation.tables.phases import ground_mask
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
    found = taxi_of_flight(
        flight,
        settings=settings,
        aircraft=known.aircraft,
        request=HeadingRequest(intervals=known.intervals),
        on_ground=lambda time_ns: ground_mask(flight, time_ns),
        heading=lambda topic: true_heading(flight, topic),
        latencies=known.answer_meeting(Delays),
        phases=known.phases,
    )
    samples, standstill = found.samples, found.standstill.answer
    taxi = taxi_spans(samples)
    stood = () if standstill is None else ((standstill.start_s, standstill.end_s),)
    shown: dict[str, Spans] = {"standstill": stood, "taxi": taxi}
    values = JudgedValues(taxi_seconds=seconds_of_segments(taxi, samples.interval_s))
    gates = build_gates(samples, standstill, values, settings)
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

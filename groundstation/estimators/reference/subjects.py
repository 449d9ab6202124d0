"""What is judged: the recorded GNSS and INS, and what the estimators made of them, as tables of canonical fields."""

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from groundstation.base.angles import FloatArray, wrap_360
from groundstation.base.errors import NotAssessableError
from groundstation.base.records import Column, Int64Array
from groundstation.base.signals import topics_of_kind
from groundstation.base.units import NS_PER_S
from groundstation.estimators.inertial.estimate import Estimation
from groundstation.estimators.inertial.figures import moved
from groundstation.estimators.inertial.model import POSITION, VELOCITY
from groundstation.estimators.known import Known
from groundstation.results.heading import HeadingResult
from groundstation.tables.epochs import distinct_epochs
from groundstation.tables.headings import true_heading
from groundstation.tables.table import Flight, Table


def subjects_of(flight: Flight, known: Known) -> Iterator[tuple[str, Table]]:
    """Name and table of everything that may be judged, in the order it is shown."""
    for topic in topics_of_kind("gnss", flight.topics()):
        table = flight[topic].trusted()
        moving = distinct_epochs(table)
        yield topic, moving if len(moving) >= 2 else table
    for topic in topics_of_kind("ins", flight.topics()):
        yield topic, _ins(flight, topic)
    estimation = known.workings_of(Estimation)
    if estimation is not None:
        yield from _corrected(estimation, flight.start_ns)
    heading = known.answer(HeadingResult)
    if heading is not None and heading.ins_topic in flight:
        corrected = wrap_360(_true_heading(flight, heading.ins_topic) - heading.error_deg)
        sigma = np.full(len(corrected), heading.standard_error_deg)
        columns = {"true_heading_deg": corrected, "true_heading_sigma_deg": sigma}
        yield "heading", _table(flight[heading.ins_topic].time_ns, columns)


def _ins(flight: Flight, topic: str) -> Table:
    """An INS that navigates, its heading from true north."""
    table = flight[topic]
    heading = _true_heading(flight, topic)
    columns = {**table.columns, "true_heading_deg": Column(heading, np.isfinite(heading))}
    return replace(table, columns=columns).trusted()


def _true_heading(flight: Flight, topic: str) -> FloatArray:
    try:
        return true_heading(flight, topic).values_deg
    except NotAssessableError:
        return np.full(len(flight[topic]), np.nan)


def _corrected(estimation: Estimation, start_ns: int) -> Iterator[tuple[str, Table]]:
    """The INS less its errors as filtered (forecast where GNSS was absent) and as smoothed, with the sigmas claimed."""
    compared, run, smoothed = estimation.compared, estimation.run, estimation.smoothed
    time_ns = start_ns + np.round(run.epochs.time_s * NS_PER_S).astype(np.int64)
    variance = np.stack([np.square(run.sigma(channel)) for channel in range(2)], axis=2)
    states = {
        "corrected": (estimation.corrected_error_m, run.x[:, VELOCITY], variance),
        "smoothed": (smoothed.x[:, POSITION], smoothed.x[:, VELOCITY], smoothed.variance),
    }
    for name, (position_m, velocity_mps, variances) in states.items():
        latitude, longitude = moved(compared, position_m)
        horizontal = np.sqrt(np.sum(variances[:, POSITION], axis=1))
        if name == "corrected":  # forecast by another method than the filter's own, which claims nothing of it
            horizontal = np.where(run.epochs.has_gnss, horizontal, np.nan)
        columns = {
            "latitude_deg": latitude,
            "longitude_deg": longitude,
            "velocity_north_mps": compared.velocity_mps[:, 0] - velocity_mps[:, 0],
            "velocity_east_mps": compared.velocity_mps[:, 1] - velocity_mps[:, 1],
            "horizontal_sigma_m": horizontal,
            "velocity_sigma_mps": np.sqrt(np.sum(variances[:, VELOCITY], axis=1)),
        }
        yield name, _table(time_ns, columns)


def _table(time_ns: Int64Array, columns: Mapping[str, FloatArray]) -> Table:
    """Fields of an INS, by whose names angles are known as such where they are interpolated."""
    order = np.argsort(time_ns, kind="stable")
    found = {name: Column(values[order], np.isfinite(values[order])) for name, values in columns.items()}
    index = np.arange(len(time_ns), dtype=np.int64)
    return Table("ins", time_ns[order], found, index, Column(time_ns[order]))

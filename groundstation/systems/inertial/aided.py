"""Comparison of an INS that GNSS corrects, or may, with GNSS alone; nothing is estimated.

It shows INS minus GNSS and what the INS's own filter logged. Against the GNSS that corrects it an INS cannot show its
own errors: tilt and drift are taken out before anyone sees them, and a model of an INS left alone would find states
with small sigmas that mean nothing.
"""

from dataclasses import replace

import numpy as np

from groundstation.base.findings import Finding
from groundstation.base.quantiles import NORMAL_95
from groundstation.base.signals import topics_of_kind
from groundstation.results.answer import Answers
from groundstation.systems.inertial.answer import CHANNELS, Difference, FilterOfIns, InertialResult, OwnInnovation
from groundstation.systems.inertial.departures import departures, findings_of
from groundstation.systems.inertial.differences import InsDifferences, differences
from groundstation.systems.inertial.figures import differences_figure, own_innovations_figure, plain_track_figure
from groundstation.systems.inertial.judged_answer import judged_filter
from groundstation.systems.inertial.kind import LEAST_AIDED_S, WHY_NOT
from groundstation.systems.inertial.model import FloatArray
from groundstation.systems.inertial.settings import InertialSettings
from groundstation.tables.filter_of_ins import filter_of_ins
from groundstation.tables.gaps import seconds_covered
from groundstation.tables.own_filter import OwnInnovations, own_innovations
from groundstation.tables.sources import AIDED, UNKNOWN
from groundstation.tables.table import Flight

ANY_JUMP_M = 1e5  # no jump is too large to be shown
UNITS = (("position", "m"), ("velocity", "mps"))
CODES = {AIDED: "inertial.gnss_aided", UNKNOWN: "inertial.unknown_kind"}


def compare_aided(
    flight: Flight,
    kind: tuple[str, str],
    *,
    settings: InertialSettings,
    excluded_s: tuple[tuple[float, float], ...] = (),
    answers: Answers | None = None,
) -> tuple[InertialResult, tuple[Finding, ...]]:
    """Describe INS minus GNSS of an aided INS, and the innovations its own filter logged.

    The INS is one that GNSS corrects, or may. Jumps are shown as they are: which of the two jumped cannot be told, and
    no filter has to be spared them.

    Parameters
    ----------
    flight : Flight
    kind : (str, str)
        ``AIDED`` or ``UNKNOWN``, and why.
    settings : InertialSettings
    excluded_s : tuple of (float, float)
        Flight seconds in which GNSS is not used.
    answers : mapping, optional
        Answers before this one: one may know the errors of the INS.

    Returns
    -------
    InertialResult
        Without channels, rates and outages.
    findings : tuple of Finding
        Those of the comparison, and that nothing is estimated.
    """
    least_s = min(settings.least_gnss_s, LEAST_AIDED_S) if kind[0] == AIDED else settings.least_gnss_s
    shown = replace(settings, jump_m=ANY_JUMP_M, least_gnss_s=least_s)
    compared = differences(flight, settings=shown, excluded_s=excluded_s)
    epochs, own = compared.epochs, own_innovations(flight)
    figures = (differences_figure(compared), plain_track_figure(compared))
    result = InertialResult(
        ins_topic=compared.ins_topic,
        gnss_topic=compared.gnss_topic,
        kind=kind[0],
        kind_reason=kind[1],
        epochs=int(np.count_nonzero(epochs.has_gnss)),
        gnss_seconds=seconds_covered(epochs.time_s[epochs.has_gnss], settings.outage_s),
        other_ins=tuple(name for name in topics_of_kind("ins", flight.topics()) if name != compared.ins_topic),
        differences=_differences(compared),
        own_filter="" if own is None else own.topic.removeprefix("raw."),
        own_innovations=() if own is None else _innovations(own),
        departures=departures(flight, compared, own) if kind[0] == AIDED else (),
        filter_of_ins=FilterOfIns(**vars(filter_of_ins(flight, compared.ins_topic))),
        figures=figures if own is None else (*figures, own_innovations_figure(flight, own)),
    )
    code, says = CODES[kind[0]], WHY_NOT[kind[0]]
    judged = judged_filter(answers or {}, compared.ins_topic)
    left_out = "errors and forecast are not estimated" if judged is None else judged.sentence
    text = f"{says} ({kind[1]}): INS minus GNSS is shown, {left_out}"
    position = result.difference("position")
    left = findings_of(
        result.departures, result.filter_of_ins, None if position is None else position.median, compared.ins_topic
    )
    return result, (*compared.findings, Finding("info", code, text, compared.ins_topic), *left)


def _differences(compared: InsDifferences) -> tuple[Difference, ...]:
    rows = []
    for (quantity, unit), values in zip(UNITS, (compared.epochs.position_m, compared.epochs.velocity_mps), strict=True):
        for axis, along in (*zip(CHANNELS, values.T, strict=True), ("horizontal", np.hypot(*values.T))):
            known = along[np.isfinite(along)]
            if len(known):
                rows.append(Difference(quantity, axis, unit, len(known), float(np.mean(known)), *_sizes(known)))
    return tuple(rows)


def _sizes(values: FloatArray) -> tuple[float, float, float]:
    """Median, 95 % and largest of the magnitudes."""
    median, p95, largest = np.quantile(np.abs(values), (0.5, 0.95, 1.0)).tolist()
    return median, p95, largest


def _innovations(own: OwnInnovations) -> tuple[OwnInnovation, ...]:
    rows = []
    for place, (quantity, unit) in enumerate(UNITS):
        for channel, axis in enumerate(CHANNELS):
            innovation, variance, gate = (
                values[:, place, channel] for values in (own.innovation, own.variance, own.gate_ratio)
            )
            used = np.isfinite(innovation)
            if not used.any():
                continue
            with_sigma, with_gate = used & (variance > 0.0), used & np.isfinite(gate)
            inside = np.abs(innovation[with_sigma]) <= NORMAL_95 * np.sqrt(variance[with_sigma])
            rows.append(
                OwnInnovation(
                    *(quantity, axis, unit, int(used.sum())),
                    mean=float(np.mean(innovation[used])),
                    median=float(np.median(np.abs(innovation[used]))),
                    p95=float(np.quantile(np.abs(innovation[used]), 0.95)),
                    sigma=float(np.sqrt(np.median(variance[with_sigma]))) if with_sigma.any() else None,
                    share_inside95=float(np.mean(inside)) if with_sigma.any() else None,
                    share_rejected=float(np.mean(gate[with_gate] > 1.0)) if with_gate.any() else None,
                )
            )
    return tuple(rows)

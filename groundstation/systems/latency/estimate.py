"""Latencies of the sensors of a flight behind its INS, from ordinary motion."""

from collections.abc import Mapping
from dataclasses import asdict, replace

import numpy as np

from groundstation.base.errors import NotAssessableError
from groundstation.base.words import counted
from groundstation.methods.intervals import BOUND95
from groundstation.methods.lag.fit import DelayFit, fit_delay
from groundstation.methods.lag.settings import LatencySettings
from groundstation.methods.lag.windows import cut_windows, too_few_windows
from groundstation.results.figures import FigureData
from groundstation.systems.latency.answer import Latencies, Latency, Quantity
from groundstation.systems.latency.arrays import LatencySearch
from groundstation.systems.latency.signals import NotComparableError, compare, pairs_of
from groundstation.tables.sources import AIDED, is_mostly_aided
from groundstation.tables.table import Flight, Table

Pair = tuple[str, str, Quantity]
MOTIONS: Mapping[Quantity, str] = {
    "velocity": "turns, accelerations",
    "altitude": "climbs, descents and level-offs",
    "field": "turns, rolls",
    "attitude": "turns, rolls",
}


def estimate_latencies(
    flight: Flight, *, settings: LatencySettings | None = None, kinds: Mapping[str, str] | None = None
) -> Latencies:
    """Estimate how much later than the INS each sensor shows the motion, by time stamps.

    Parameters
    ----------
    flight : Flight
    settings : LatencySettings, optional
    kinds : mapping of INS topic to kind, optional
        ``gnss_aided`` where system 2 found that GNSS corrects the INS; its own mode counts too.

    Returns
    -------
    Latencies
        One row for each pair of sensors that show the same motion; not observable is an answer.

    Raises
    ------
    NotAssessableError
        When the log has no pair.

    Notes
    -----
    GNSS velocity is compared with INS velocity, pressure altitude with INS vertical speed added up, the magnetic field
    with a constant one turned by the attitude, a second INS with the first. See :func:`fit_delay` for the method.
    A sensor that filters its output shows its filter's delay too. An INS that GNSS corrects follows GNSS slowly; motion
    of seconds is its gyros' and accelerometers' own. The interval is widened by ``aided_sigma_s``, because the filter
    may hide part of the latency of GNSS.
    """
    settings = settings or LatencySettings()
    pairs = pairs_of(flight)
    if not pairs:
        raise NotAssessableError("latency", "no INS with another sensor that shows the same motion")
    rows, figures = [], []
    for pair in pairs:
        row, fit = _assessed(flight, pair, settings, kinds or {})
        rows.append(row)
        if fit is not None:
            figures.append((row, fit))
    return Latencies(tuple(rows), asdict(settings), _figure(figures))


def _assessed(
    flight: Flight, pair: Pair, settings: LatencySettings, kinds: Mapping[str, str]
) -> tuple[Latency, DelayFit | None]:
    try:
        compared = compare(flight, pair, settings)
    except NotComparableError as reason:
        return Latency(*pair, "not_observable", str(reason)), None
    windows = cut_windows(compared.reference, compared.time_s, compared.values, settings)
    if windows is None:
        return Latency(*pair, "not_observable", too_few_windows(settings)), None
    fit = fit_delay(compared.reference, windows, compared.prior_sigma, settings)
    return _row(pair, fit, compared.unit, settings, _is_aided(flight[pair[0]], kinds)), fit


def _row(pair: Pair, fit: DelayFit, unit: str, settings: LatencySettings, is_aided: bool) -> Latency:
    reason, hidden_s = _why_not(pair[2], fit, settings), 0.0
    row = Latency(
        *pair,
        "not_observable",
        reason,
        samples=fit.samples,
        windows=fit.windows,
        effective_windows=fit.freedom,
        motion=fit.motion,
        residual=fit.residual,
        unit=unit,
        explained=fit.explained,
    )
    if reason:
        return row
    rests_on = f"{MOTIONS[pair[2]]} in {counted(fit.windows, 'window')} of {settings.window_s:g} s"
    if is_aided and pair[2] == "velocity":
        hidden_s = settings.aided_sigma_s
        rests_on += f"; GNSS corrects this INS, whose filter may hide {hidden_s:g} s of latency"
    half_s = float(np.hypot(fit.half_width_s, BOUND95 * hidden_s))
    return replace(
        row,
        state="observed",
        reason=rests_on,
        latency_s=fit.delay_s,
        sigma_s=float(np.hypot(fit.sigma_s, hidden_s)),
        confidence95_s=(fit.delay_s - half_s, fit.delay_s + half_s),
    )


def _why_not(quantity: Quantity, fit: DelayFit, settings: LatencySettings) -> str:
    """Return why a fit is no observation; empty when it is one."""
    half_s = max(fit.half_width_s, BOUND95 * fit.modelled_sigma_s)  # so that a lucky scatter does not pass
    if fit.freedom < settings.freedom_min or not half_s <= settings.half_width_max_s:
        return (
            f"too little motion ({MOTIONS[quantity]}): 95 % interval of +- {half_s:.2g} s, limit "
            f"{settings.half_width_max_s:g} s, on {fit.freedom:.1f} effective windows, limit "
            f"{settings.freedom_min:g}"
        )
    if fit.explained < settings.explained_min:
        return f"noise, or not the same motion: the reference explains {fit.explained:.0%} of what the other shows"
    if not fit.is_converged:
        return f"no minimum within {settings.search_s:g} s either way"
    return ""


def _is_aided(unit: Table, kinds: Mapping[str, str]) -> bool:
    return kinds.get(unit.topic) == AIDED or is_mostly_aided(unit)


def _figure(fits: list[tuple[Latency, DelayFit]]) -> tuple[FigureData, ...]:
    """Residual against delay of every pair, in one table."""
    if not fits:
        return ()
    searched = LatencySearch(
        reference=np.concatenate([np.full(len(fit.search_s), row.reference) for row, fit in fits]),
        other=np.concatenate([np.full(len(fit.search_s), row.other) for row, fit in fits]),
        quantity=np.concatenate([np.full(len(fit.search_s), row.quantity) for row, fit in fits]),
        latency_s=np.concatenate([fit.search_s for _, fit in fits]),
        residual=np.concatenate([fit.search_residual for _, fit in fits]),
    )
    return (searched,)

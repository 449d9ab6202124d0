"""Shortfalls of a flight for an estimate of INS errors, by comparison with GNSS alone."""

from contextlib import suppress
from dataclasses import replace

import numpy as np

from groundstation.base.errors import NotAssessableError
from groundstation.methods.roles import InsKinds
from groundstation.systems.analysis import Shortfall
from groundstation.systems.inertial.differences import InsDifferences, differences
from groundstation.systems.inertial.kind import LEAST_AIDED_S, WHY_NOT, kind_of, stated_kind
from groundstation.systems.inertial.settings import InertialSettings
from groundstation.systems.known import Known
from groundstation.tables.gaps import seconds_covered
from groundstation.tables.sources import AIDED, UNAIDED, said_of
from groundstation.tables.table import Flight

LEAST_COVERED = 0.95  # of the time of the INS: more without GNSS is worth a word
LISTED = 5  # outages


def compared_with_kind(
    flight: Flight, known: Known, settings: InertialSettings
) -> tuple[InsDifferences, tuple[str, str]]:
    """Return INS minus GNSS of a flight, and whether GNSS corrects the INS, with the reason.

    An INS that GNSS corrects is compared even over 20 s: nothing of it is estimated.

    Raises
    ------
    NotAssessableError
        As :func:`groundstation.systems.inertial.differences.differences`.
    """
    try:
        return _with_kind(flight, known, settings)
    except NotAssessableError:
        short = replace(settings, least_gnss_s=min(settings.least_gnss_s, LEAST_AIDED_S))
        with suppress(NotAssessableError):
            compared, kind = _with_kind(flight, known, short)
            if kind[0] == AIDED:
                return compared, kind
        raise


def _with_kind(flight: Flight, known: Known, settings: InertialSettings) -> tuple[InsDifferences, tuple[str, str]]:
    compared = differences(flight, settings=settings, excluded_s=known.excluded_s)
    said = said_of(flight, compared.ins_topic, "ins_kind")
    return compared, kind_of(compared, settings, stated_kind(known.aircraft.ins_kind, {"ins_kind": said}))


def offered(known: Known) -> InsKinds:
    """Return the kind of the INS that the inertial analysis compares with GNSS.

    None where it compares none.
    """

    def find(flight: Flight) -> dict[str, str]:
        try:
            compared, (kind, _reason) = compared_with_kind(flight, known, known.settings_of(InertialSettings))
        except NotAssessableError:
            return {}
        return {compared.ins_topic: kind}

    return InsKinds(find)


def examine_inertial(flight: Flight, known: Known, settings: InertialSettings) -> tuple[Shortfall, ...]:
    """Report what of INS and GNSS falls short for an estimate.

    The INS must be left alone, GNSS be there throughout, and one Schuler period be covered.

    Raises
    ------
    NotAssessableError
        Where nothing can be compared, with the reason that the estimate would give.
    """
    compared, (kind, reason) = compared_with_kind(flight, known, settings)
    if kind != UNAIDED:
        return (Shortfall(f"{WHY_NOT[kind]} ({reason}): INS minus GNSS is shown, errors are not estimated"),)
    found = []
    time_s, has_gnss = compared.epochs.time_s, compared.epochs.has_gnss
    covered_s = seconds_covered(time_s[has_gnss], settings.outage_s)
    whole_s = seconds_covered(time_s, settings.outage_s)
    if covered_s < LEAST_COVERED * whole_s:
        text = f"GNSS for {covered_s:.0f} of {whole_s:.0f} s of the INS"
        found.append(Shortfall(text, _longest_outages(time_s, time_s[has_gnss], settings.outage_s)))
    if covered_s < settings.schuler_fit_s:
        text = f"{covered_s / 60.0:.0f} min with GNSS; one Schuler period ({settings.schuler_fit_s / 60.0:.1f} min) "
        found.append(Shortfall(text + "is needed to separate tilt from drift: until then sigmas depend on the class"))
    return tuple(found)


def _longest_outages(time_s: np.ndarray, gnss_s: np.ndarray, least_s: float) -> tuple[tuple[float, float], ...]:
    """The longest outages of GNSS in order of time, those at either end among them."""
    edges = np.concatenate([time_s[:1], gnss_s, time_s[-1:]])
    long = np.flatnonzero(np.diff(edges) > least_s)
    kept = np.sort(long[np.argsort(-np.diff(edges)[long], kind="stable")][:LISTED])
    return tuple((float(edges[row]), float(edges[row + 1])) for row in kept)

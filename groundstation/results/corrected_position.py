"""Corrected position of an unaided INS with its sigmas, as pages and recordings draw it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groundstation.base.ellipse import ELLIPSE_95, magnified
from groundstation.results.flight import FlightResults
from groundstation.systems.inertial.arrays import InertialStates, InertialTrack

FloatArray = NDArray[np.float64]
SHOWN_ALONG = 8  # ellipses of a track
LARGEST_SIGMA_M = 1e7  # more is no position on Earth


@dataclass(frozen=True)
class CorrectedPosition:
    """INS minus its estimated error, with the sigmas north and east, arrays of shape (n,).

    The errors north and east are uncorrelated.
    """

    time_s: FloatArray
    latitude_deg: FloatArray
    longitude_deg: FloatArray
    sigma_north_m: FloatArray
    sigma_east_m: FloatArray

    def along(self) -> NDArray[np.int64]:
        """Rows whose ellipses are drawn along a track, evenly spread."""
        return np.unique(np.linspace(0, len(self.time_s) - 1, SHOWN_ALONG).round().astype(np.int64))

    def larger(self, side_m: float) -> int:
        """Return the factor by which the 95 % ellipses are enlarged on a map of a given side."""
        half_m = ELLIPSE_95 * np.hypot(self.sigma_north_m, self.sigma_east_m)[self.along()]
        return magnified(side_m, float(np.median(half_m)))


def corrected_position(results: FlightResults) -> CorrectedPosition | None:
    """The rows with a place and sigmas; None of an INS that was not corrected."""
    track, states = results.rows_of(InertialTrack), results.rows_of(InertialStates)
    if track is None or states is None or len(track) != len(states):
        return None
    if track.corrected_latitude_deg is None or track.corrected_longitude_deg is None:
        return None
    columns = [track.time_s, track.corrected_latitude_deg, track.corrected_longitude_deg]
    columns += [states.north.position_sigma_m, states.east.position_sigma_m]
    known = np.isfinite(columns).all(axis=0) & (np.abs(columns[3:]) < LARGEST_SIGMA_M).all(axis=0)
    return CorrectedPosition(*(column[known] for column in columns)) if known.any() else None

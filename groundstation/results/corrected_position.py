"""Corrected position of an unaided INS, as pages and recordings draw it, and its tracks."""

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.ellipse import ELLIPSE_95, fits, magnified
from groundstation.results.flight import FlightResults

FloatArray = NDArray[np.float64]
SHOWN_ALONG = 8  # ellipses of a track


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

    def drawn_on(self, side_m: float) -> tuple[NDArray[np.int64], int]:
        """Return rows along a track with an ellipse on a map of that side, and its enlargement.

        Ellipses of 95 % that are wider than the map have no room on it.
        """
        rows = self.along()
        half_m = ELLIPSE_95 * np.hypot(self.sigma_north_m, self.sigma_east_m)[rows]
        seen = fits(side_m, half_m)
        return rows[seen], magnified(side_m, half_m[seen])


@dataclass(frozen=True)
class MadeTrack:
    """Track that an analysis made of an INS, arrays of shape (n,), every row with a place.

    ``title`` says for people how it was made. The sigmas are None where the track has none.
    """

    name: str
    title: str
    time_s: FloatArray
    latitude_deg: FloatArray
    longitude_deg: FloatArray
    sigma_north_m: FloatArray | None = None
    sigma_east_m: FloatArray | None = None


class BestTrack:
    """Role of an answer that corrects the position of an INS along the flight."""

    ins_topic: str

    def tracks(self, results: FlightResults) -> tuple[MadeTrack, ...]:
        """Return the tracks made of the INS, each with its own rows."""
        raise NotImplementedError

    def best_track(self, results: FlightResults) -> CorrectedPosition | None:
        """The rows with a place and sigmas; None of an INS that was not corrected."""
        raise NotImplementedError


def corrected_position(results: FlightResults) -> CorrectedPosition | None:
    """The corrected position of the flight; None of an INS that was not corrected."""
    tracks = (one.best_track(results) for one in results.answers.values() if isinstance(one, BestTrack))
    return next((track for track in tracks if track is not None), None)

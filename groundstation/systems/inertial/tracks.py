"""Tracks of the INS less its errors: as filtered and forecast, and as smoothed."""

from collections.abc import Iterator

import numpy as np

from groundstation.base.units import NS_PER_S
from groundstation.systems.inertial.differences import InsDifferences
from groundstation.systems.inertial.figures import moved
from groundstation.systems.inertial.filter import ChannelsRun, SmoothedErrors
from groundstation.systems.inertial.model import POSITION, VELOCITY, FloatArray
from groundstation.tables.table import Table
from groundstation.tables.tracks import ins_table


def corrected_tracks(
    compared: InsDifferences, run: ChannelsRun, smoothed: SmoothedErrors, corrected_error_m: FloatArray, start_ns: int
) -> Iterator[tuple[str, Table]]:
    """Yield the tracks of the INS less its errors, as filtered and as smoothed, with sigmas.

    Where GNSS was absent the filtered errors are forecast.
    """
    time_ns = start_ns + np.round(run.epochs.time_s * NS_PER_S).astype(np.int64)
    variance = np.stack([np.square(run.sigma(channel)) for channel in range(2)], axis=2)
    states = {
        "corrected": (corrected_error_m, run.x[:, VELOCITY], variance),
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
        yield name, ins_table(time_ns, columns)

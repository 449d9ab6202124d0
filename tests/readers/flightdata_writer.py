"""Writes small recordings as FlightDataAnalyzer does, and damaged ones."""

from pathlib import Path
from typing import Any

import h5py
import numpy as np

START_UTC_S = 1_356_894_546


def write_flightdata(path: Path, parameters: dict[str, dict[str, Any]], **root: Any) -> Path:
    """A recording: per parameter ``data``, and where not the usual ``mask``, ``frequency``, ``offset``, ``units``,
    ``lfl``."""
    with h5py.File(path, "w") as file:
        file.attrs["start_timestamp"] = np.int32(root.get("start", START_UTC_S))
        file.attrs["duration"] = np.int32(root.get("duration", 100))
        series = file.create_group("series")
        for name, told in parameters.items():
            group = series.create_group(name)
            data = np.asarray(told["data"], dtype=np.float64)
            mask = np.asarray(told.get("mask", np.zeros(len(data), dtype=bool)))
            for part, values in (("data", data), ("mask", mask)):
                group.create_dataset(part, data=values, chunks=(max(len(values), 1),), compression="gzip")
            group.attrs["name"] = name
            group.attrs["frequency"] = told.get("frequency", 1.0)
            group.attrs["supf_offset"] = told.get("offset", 0.0)
            for key in ("units", "lfl"):
                if key in told:
                    group.attrs[key] = told[key]
    return path

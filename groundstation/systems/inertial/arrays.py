"""Arrays of the inertial analysis; errors are INS minus truth, times flight seconds."""

from typing import Literal

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.results.arrays.typed import Arrays, Flags, Floats, Part, column

_TIME = {"time_s": 2}


StateName = Literal["position", "velocity", "tilt", "drift", "drift_rate", "random_drift"]


@dataclass(frozen=True)
class StateSeries:
    """One state over time, shapes (n,): estimated, its sigma, measured and smoothed."""

    value: Floats
    sigma: Floats
    measured: Floats
    smoothed: Floats


class StatesOfChannel(Part):
    """Estimated states of one channel with sigmas, the measurements, and the smoothed errors."""

    measured_position_m: Floats = column("measured_{}_position_m")
    measured_velocity_mps: Floats = column("measured_{}_velocity_mps")
    position_m: Floats
    position_sigma_m: Floats
    velocity_mps: Floats
    velocity_sigma_mps: Floats
    tilt_arcsec: Floats
    tilt_sigma_arcsec: Floats
    drift_dph: Floats
    drift_sigma_dph: Floats
    drift_rate_dphph: Floats
    drift_rate_sigma_dphph: Floats
    random_drift_dph: Floats
    random_drift_sigma_dph: Floats
    smoothed_position_m: Floats = column("smoothed_{}_position_m")
    smoothed_velocity_mps: Floats = column("smoothed_{}_velocity_mps")
    normalised_innovation: Floats

    def state(self, name: str) -> StateSeries:
        """Return a state with its sigma; NaN throughout where it was not measured or smoothed."""
        unknown = np.full(len(self.position_m), np.nan)
        measured = {"position": self.measured_position_m, "velocity": self.measured_velocity_mps}
        smoothed = {"position": self.smoothed_position_m, "velocity": self.smoothed_velocity_mps}
        value, sigma = {
            "position": (self.position_m, self.position_sigma_m),
            "velocity": (self.velocity_mps, self.velocity_sigma_mps),
            "tilt": (self.tilt_arcsec, self.tilt_sigma_arcsec),
            "drift": (self.drift_dph, self.drift_sigma_dph),
            "drift_rate": (self.drift_rate_dphph, self.drift_rate_sigma_dphph),
            "random_drift": (self.random_drift_dph, self.random_drift_sigma_dph),
        }[name]
        return StateSeries(value, sigma, measured.get(name, unknown), smoothed.get(name, unknown))


class InertialStates(Arrays, figure="inertial_states", digits={**_TIME, "*_dph": 5, "*_dphph": 5}):
    """States of both channels over time."""

    time_s: Floats
    is_forecast: Flags
    is_gnss_used: Flags
    north: StatesOfChannel
    east: StatesOfChannel


class ObservabilityOfChannel(Part):
    """Ratio of each state's sigma to what it would be without GNSS."""

    position: Floats
    velocity: Floats
    tilt: Floats
    drift: Floats
    drift_rate: Floats
    random_drift: Floats

    def states(self) -> dict[StateName, Floats]:
        """Observability by the name of the state."""
        return {
            "position": self.position,
            "velocity": self.velocity,
            "tilt": self.tilt,
            "drift": self.drift,
            "drift_rate": self.drift_rate,
            "random_drift": self.random_drift,
        }


class InertialObservability(Arrays, figure="inertial_observability", digits=_TIME):
    """Observability of the states of both channels over time."""

    time_s: Floats
    north: ObservabilityOfChannel
    east: ObservabilityOfChannel


class InertialTrack(Arrays, figure="inertial_track", digits={**_TIME, "*_deg": 7}):
    """Tracks of the INS, of GNSS, and of the INS minus its estimated and its smoothed error.

    The last two are known where the filter ran.
    """

    time_s: Floats
    ins_latitude_deg: Floats
    ins_longitude_deg: Floats
    gnss_latitude_deg: Floats
    gnss_longitude_deg: Floats
    corrected_latitude_deg: Floats | None = None
    corrected_longitude_deg: Floats | None = None
    reference_latitude_deg: Floats | None = None
    reference_longitude_deg: Floats | None = None
    ins_error_m: Floats | None = None
    corrected_error_m: Floats | None = None


class DifferencesOfChannel(Part):
    """INS minus GNSS of one channel."""

    position_m: Floats
    velocity_mps: Floats


class InertialDifferences(Arrays, figure="inertial_differences", digits=_TIME):
    """INS minus GNSS over time."""

    time_s: Floats
    north: DifferencesOfChannel
    east: DifferencesOfChannel


class OwnInnovationsOfChannel(Part):
    """Innovations of one channel of the INS's own filter, with its sigma where it logs one."""

    position_m: Floats
    position_sigma_m: Floats
    velocity_mps: Floats
    velocity_sigma_mps: Floats

    def of(self, quantity: str) -> tuple[Floats, Floats]:
        """Innovations of ``position`` or ``velocity`` and their sigma."""
        if quantity == "position":
            return self.position_m, self.position_sigma_m
        return self.velocity_mps, self.velocity_sigma_mps


class InertialOwnInnovations(Arrays, figure="inertial_own_innovations", digits=_TIME):
    """Innovations of the INS's own filter over time."""

    time_s: Floats
    north: OwnInnovationsOfChannel
    east: OwnInnovationsOfChannel

"""Noise parameters by INS class (TOML in ins_classes/): gyros, GNSS, initial errors."""

import math
from dataclasses import field, replace
from itertools import product
from typing import Literal

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import SettingsError
from groundstation.base.shipped_toml import ShippedToml
from groundstation.base.toml_settings import number, settings_from, trusted

RADPS_PER_DPH = math.pi / 180.0 / 3600.0
RADPS2_PER_DPHPH = RADPS_PER_DPH / 3600.0
S_PER_H = 3600.0
DEFAULT_CLASS = "navigation"
ScaleName = Literal["separate", "bank", "coupled"]
_CLASSES = ShippedToml("groundstation.methods", "ins_classes", "ins_class")


@dataclass(frozen=True)
class GnssNoise:
    """GNSS error as the filter takes it: white plus a part correlated over time.

    The correlated part is not modelled by a state: the measurement variance is inflated to white^2 + 2 tau / T
    sigma^2 (T the interval of the epochs), the white noise with the same power at low frequencies, where the INS errors
    are. With ``is_inflated`` false the variance is white^2 + sigma^2, as if every sample told something new.
    """

    position_white_m: float = number(3.0, 0.0, 10_000.0)
    position_correlated_m: float = number(3.0, 0.0, 10_000.0)
    position_correlation_s: float = number(300.0, 0.0, 100_000.0)
    velocity_white_mps: float = number(0.05, 0.0, 100.0)
    velocity_correlated_mps: float = number(0.03, 0.0, 100.0)
    velocity_correlation_s: float = number(60.0, 0.0, 100_000.0)
    is_inflated: bool = True

    def averaged(self, samples: float) -> "GnssNoise":
        """Return the noise of means of samples: the white part falls, the correlated part stays."""
        root = math.sqrt(samples)
        return replace(
            self,
            position_white_m=self.position_white_m / root,
            velocity_white_mps=self.velocity_white_mps / root,
        )

    def variances(self, interval_s: float) -> tuple[float, float]:
        """Variances of position and velocity, m^2 and m^2/s^2, for epochs ``interval_s`` apart."""
        return (
            _variance(
                self.position_white_m,
                self.position_correlated_m,
                self.position_correlation_s if self.is_inflated else 0.0,
                interval_s,
            ),
            _variance(
                self.velocity_white_mps,
                self.velocity_correlated_mps,
                self.velocity_correlation_s if self.is_inflated else 0.0,
                interval_s,
            ),
        )


def _variance(white: float, correlated: float, correlation_s: float, interval_s: float) -> float:
    return white**2 + correlated**2 * max(1.0, 2.0 * correlation_s / interval_s)


@dataclass(frozen=True)
class Calibration:
    """Factors on the filter's forecast sigma at each horizon, and their weight.

    ``scale`` belongs to ``horizon_min``; found on simulated flights of the class. ``bank_scale`` is that of the bank's
    mixture, ``coupled_scale`` that of the coupled model; left out, they are one. ``weight`` is what it counts against
    the outages replayed in the past of the flight at hand: so many independent ones.
    """

    horizon_min: tuple[float, ...] = (1.0, 5.0, 10.0, 30.0, 60.0, 90.0, 120.0)
    scale: tuple[float, ...] = (1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0)
    bank_scale: tuple[float, ...] = ()
    coupled_scale: tuple[float, ...] = ()
    weight: float = number(5.0, 0.1, 1000.0)

    def __post_init__(self) -> None:
        for name in ("bank_scale", "coupled_scale"):
            object.__setattr__(self, name, getattr(self, name) or (1.0,) * len(self.horizon_min))
        for name, scale in (
            ("scale", self.scale),
            ("bank_scale", self.bank_scale),
            ("coupled_scale", self.coupled_scale),
        ):
            if len(scale) != len(self.horizon_min) or not scale:
                expected = f"one for each of {len(self.horizon_min)} horizons"
                raise SettingsError(name, f"{len(scale)} numbers", expected)
            if min(scale) <= 0.0:
                raise SettingsError(name, f"{min(scale):g}", "positive numbers")
        if any(low >= high for low, high in zip(self.horizon_min, self.horizon_min[1:], strict=False)):
            raise SettingsError("horizon_min", str(list(self.horizon_min)), "growing numbers")

    def at(self, lead_s: FloatArray, of: ScaleName = "separate") -> FloatArray:
        """Return the scale at other lead times.

        It is linear in the logarithm of the lead, and held beyond the ends.
        """
        scale = {"separate": self.scale, "bank": self.bank_scale, "coupled": self.coupled_scale}[of]
        lead_min = np.maximum(np.asarray(lead_s, dtype=np.float64) / 60.0, 1e-3)
        return np.asarray(np.interp(np.log(lead_min), np.log(self.horizon_min), scale))


@dataclass(frozen=True)
class BankFactors:
    """Factors on the noise of a class for the sets of a bank; every combination is a set.

    ``random_drift`` and ``random_drift_correlation`` go together, one to one.
    """

    drift: tuple[float, ...] = (0.35, 1.2)
    tilt_walk: tuple[float, ...] = (0.5, 1.4)
    velocity_walk: tuple[float, ...] = (0.6, 1.5)
    random_drift: tuple[float, ...] = (0.5, 1.2)
    random_drift_correlation: tuple[float, ...] = (0.5, 1.0)

    def sets(self, noise: "InsNoise") -> tuple["InsNoise", ...]:
        """The noise sets of a class."""
        random_drifts = zip(self.random_drift, self.random_drift_correlation, strict=True)
        return tuple(
            replace(
                noise,
                drift_dph=drift * noise.drift_dph,
                tilt_walk_deg_per_sqrt_h=tilt * noise.tilt_walk_deg_per_sqrt_h,
                velocity_walk_mps_per_sqrt_s=velocity * noise.velocity_walk_mps_per_sqrt_s,
                random_drift_dph=size * noise.random_drift_dph,
                random_drift_correlation_s=correlation * noise.random_drift_correlation_s,
            )
            for drift, tilt, velocity, (size, correlation) in product(
                self.drift, self.tilt_walk, self.velocity_walk, tuple(random_drifts)
            )
        )


@dataclass(frozen=True)
class InsNoise:
    """Noise parameters of an INS class.

    They are initial sigmas, then what the white noises add per square root of time. ``random_drift_dph`` and
    ``random_drift_correlation_s`` are the stationary sigma and correlation time (1 / beta) of the random drift. Two are
    of the coupled model alone: ``azimuth_deg`` is the initial sigma of the azimuth, ``accelerometer_ug`` that of
    accelerometer biases, which turn with the body where ``is_strapdown``.
    """

    name: str = DEFAULT_CLASS
    title: str = ""
    position_m: float = number(30.0, 0.0, 1e6)
    velocity_mps: float = number(1.0, 0.0, 1e3)
    tilt_rad: float = number(2e-4, 0.0, 1.0)
    drift_dph: float = number(0.01, 0.0, 1e5)
    drift_rate_dphph: float = number(0.001, 0.0, 1e5)
    random_drift_dph: float = number(0.003, 0.0, 1e5)
    random_drift_correlation_s: float = number(3600.0, 1.0, 1e9)
    azimuth_deg: float = number(0.1, 0.0, 180.0)
    accelerometer_ug: float = number(50.0, 0.0, 1e6)
    is_strapdown: bool = True
    velocity_walk_mps_per_sqrt_s: float = number(3e-3, 0.0, 100.0)
    tilt_walk_deg_per_sqrt_h: float = number(0.002, 0.0, 100.0)
    drift_walk_dph_per_sqrt_h: float = number(0.0, 0.0, 1e5)
    drift_rate_walk_dphph_per_sqrt_h: float = number(0.0, 0.0, 1e5)
    gnss: GnssNoise = field(default_factory=GnssNoise)
    calibration: Calibration = field(default_factory=Calibration)
    bank: BankFactors = field(default_factory=BankFactors)

    @property
    def beta_per_s(self) -> float:
        """Inverse correlation time of the random drift."""
        return 1.0 / self.random_drift_correlation_s

    def initial_variances(self) -> FloatArray:
        """Variances at the start, shape (6,), SI units."""
        sigmas = (
            self.position_m,
            self.velocity_mps,
            self.tilt_rad,
            self.drift_dph * RADPS_PER_DPH,
            self.drift_rate_dphph * RADPS2_PER_DPHPH,
            self.random_drift_dph * RADPS_PER_DPH,
        )
        return np.asarray(np.square(np.array(sigmas)))

    def densities(self) -> FloatArray:
        """Power spectral densities that enter the states, shape (6,), SI units squared per second."""
        return np.array(
            [
                0.0,
                self.velocity_walk_mps_per_sqrt_s**2,
                math.radians(self.tilt_walk_deg_per_sqrt_h) ** 2 / S_PER_H,
                (self.drift_walk_dph_per_sqrt_h * RADPS_PER_DPH) ** 2 / S_PER_H,
                (self.drift_rate_walk_dphph_per_sqrt_h * RADPS2_PER_DPHPH) ** 2 / S_PER_H,
                2.0 * self.beta_per_s * (self.random_drift_dph * RADPS_PER_DPH) ** 2,
            ]
        )


def class_names() -> tuple[str, ...]:
    """Names of the shipped INS classes.

    Examples
    --------
    >>> "navigation" in class_names()
    True
    """
    return _CLASSES.names()


def load_class(name: str) -> InsNoise:
    """Noise parameters of a shipped class, or of a file ``*.toml`` of the user.

    Raises
    ------
    SettingsError
        For an unknown name, and for a file with a wrong key or value.

    Examples
    --------
    >>> load_class("navigation").name
    'navigation'
    """
    file = _CLASSES.read(name)
    table = {"name": file.name} | file.table
    return trusted(InsNoise, table) if file.is_shipped else settings_from(InsNoise, table, file.where)


def choose_class(asked_for: str, aircraft_class: str = "", logged_class: str = "") -> tuple[InsNoise, str]:
    """Choose the noise parameters, and tell who chose them.

    They are those of the settings, else of the aircraft file, else of the log, else navigation. A log may name any INS:
    of its names only those of shipped classes are taken.

    Raises
    ------
    SettingsError
        For a class that does not exist.
    """
    if asked_for != "auto":
        return load_class(asked_for), "settings"
    if aircraft_class:
        return load_class(aircraft_class), "aircraft file"
    if logged_class.lower() in class_names():
        return load_class(logged_class), "log"
    return load_class(DEFAULT_CLASS), "default"

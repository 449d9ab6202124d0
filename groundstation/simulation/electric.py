"""Electric current near the magnetometer: a base load, and loads switched on and off."""

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.records import Column
from groundstation.base.units import NS_PER_S
from groundstation.simulation.readings import TopicReadings, every, quantised
from groundstation.simulation.scenario import ElectricSettings
from groundstation.simulation.trajectory import Trajectory


def current_a(time_s: FloatArray, settings: ElectricSettings | None) -> FloatArray:
    """Return the true current at times in log seconds, shape (n,).

    It is the base load and the loads that are on; 0 without a system.

    Examples
    --------
    >>> from groundstation.simulation.scenario import Load
    >>> settings = ElectricSettings(base_a=5.0, loads=(Load(10.0, 20.0, 30.0),))
    >>> current_a(np.array([9.9, 10.0, 20.0]), settings).tolist()
    [5.0, 35.0, 5.0]
    """
    if settings is None:
        return np.zeros(len(time_s))
    current = np.full(len(time_s), settings.base_a)
    for load in settings.loads:
        current += load.current_a * ((time_s >= load.from_s) & (time_s < load.to_s))
    return current


def electric_readings(trajectory: Trajectory, settings: ElectricSettings, rng: np.random.Generator) -> TopicReadings:
    """Return the current as the recorder has it: with noise, rounded."""
    time_ns = trajectory.time_ns[every(trajectory, settings.rate_hz)]
    noise = settings.noise_a * rng.standard_normal(len(time_ns))
    values = quantised(current_a(time_ns / NS_PER_S, settings) + noise, settings.resolution_a)
    return TopicReadings("electric", time_ns, {"current_a": Column(values)}, {"current_a": settings.resolution_a})

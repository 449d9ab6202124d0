"""Whole simulated flight: true motion and every sensor, on the rows of one log."""

from collections.abc import Mapping
from dataclasses import field, replace
from types import MappingProxyType

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Column, Int64Array
from groundstation.base.units import NS_PER_S
from groundstation.simulation.deviation import scenario_deviation
from groundstation.simulation.electric import electric_readings
from groundstation.simulation.faults import apply_faults
from groundstation.simulation.flight_errors import flight_errors
from groundstation.simulation.landing_aids import adf_readings, radio_altimeter_readings
from groundstation.simulation.magnetometer import magnetometer_readings
from groundstation.simulation.onboard import onboard_readings
from groundstation.simulation.readings import TopicReadings, every, generator
from groundstation.simulation.scenario import Scenario
from groundstation.simulation.sensors import (
    air_readings,
    baro_readings,
    discrete_readings,
    event_readings,
    gnss_readings,
    ins_readings,
    truth_readings,
)
from groundstation.simulation.trajectory import Trajectory, fly
from groundstation.tables.table import Flight, Table


@dataclass(frozen=True)
class Simulated:
    """A simulated flight.

    Parameters
    ----------
    scenario : Scenario
        With the seed that was used.
    trajectory : Trajectory
        True motion on the internal grid.
    flight : Flight
        All topics with ``truth``, without the scenario's faults.
    resolution : mapping of ``<topic>.<field>`` to float
        Step of each rounded field: the CSV prints as many decimals.
    """

    scenario: Scenario
    trajectory: Trajectory
    flight: Flight
    resolution: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "resolution", MappingProxyType(dict(self.resolution)))

    @property
    def metadata(self) -> Mapping[str, str]:
        """Metadata of the flight."""
        return self.flight.metadata

    @property
    def damaged(self) -> Flight:
        """Return the flight with the scenario's faults, as the recorder wrote it."""
        return apply_faults(self.flight, self.scenario.faults)


def simulate(scenario: Scenario, seed: int | None = None) -> Simulated:
    """Fly a scenario. The same scenario and seed give the same flight.

    Parameters
    ----------
    scenario : Scenario
    seed : int, optional
        Instead of the scenario's own.

    Raises
    ------
    SettingsError
        When a leg cannot follow the one before it, or a sensor lacks a date.

    Examples
    --------
    >>> from groundstation.simulation.scenario import load_scenario
    >>> flight = simulate(load_scenario("taxi-short")).flight
    >>> "truth" in flight, flight["gnss"].has("velocity_north_mps", "velocity_east_mps")
    (True, True)
    """
    scenario = scenario if seed is None else replace(scenario, seed=seed)
    trajectory = fly(scenario, generator(scenario.seed, "motion"))
    readings = _all_readings(scenario, trajectory)
    resolution = {f"{part.topic}.{name}": step for part in readings for name, step in part.resolution.items()}
    return Simulated(scenario, trajectory, _assemble(scenario, readings), resolution)


def scenario_truth(simulated: Simulated) -> dict[str, float]:
    """Return the true values that an analysis of the flight should find, by name.

    They are in degrees and metres. ``heading_error_deg`` is INS heading minus nose at log second 0 (azimuth error +
    mounting); ``taxi_difference_deg`` what heading minus track shows there on straights (sideslip added);
    ``drift_deg_per_h`` its drift, the mean one where the errors are those of an INS class. ``deviation_a_deg`` to
    ``deviation_e_deg`` are the coefficients A to E of the magnetometer levelled with the INS (heading shown minus
    magnetic heading) in level flight, NaN where iron outweighs the field.
    """
    scenario = simulated.scenario
    ins, gnss = scenario.ins, scenario.gnss
    azimuth_deg, drift_dph = ins.azimuth_error_deg, ins.azimuth_drift_dph
    if ins.error_model == "full":
        motion = simulated.trajectory.at(every(simulated.trajectory, ins.rate_hz))
        heading = flight_errors(motion, ins, scenario.seed).heading_deg
        azimuth_deg = float(heading[0]) - ins.boresight_deg
        drift_dph = float(heading[-1] - heading[0]) / max(float(np.ptp(motion.time_ns)) / NS_PER_S / 3600.0, 1e-9)
    return {
        "azimuth_error_deg": azimuth_deg,
        "boresight_deg": ins.boresight_deg,
        "sideslip_deg": scenario.ground.sideslip_deg,
        "heading_error_deg": azimuth_deg + ins.boresight_deg,
        "taxi_difference_deg": azimuth_deg + ins.boresight_deg + scenario.ground.sideslip_deg,
        "drift_deg_per_h": drift_dph,
        "parking_heading_deg": scenario.parking_heading_deg,
        "reference_heading_deg": scenario.reference_heading_deg,
        "antenna_forward_m": gnss.antenna_forward_m,
        "antenna_right_m": gnss.antenna_right_m,
        "latency_s": gnss.latency_s,
    } | _magnetic_truth(simulated)


def _magnetic_truth(simulated: Simulated) -> dict[str, float]:
    deviation = scenario_deviation(simulated.scenario, simulated.trajectory)
    if deviation is None:
        return {}
    letters = {f"deviation_{letter.lower()}_deg": value for letter, value in deviation.coefficients_deg.items()}
    return letters | {"declination_deg": deviation.declination_deg, "horizontal_nt": deviation.horizontal_nt}


def _all_readings(scenario: Scenario, trajectory: Trajectory) -> list[TopicReadings]:
    seed = scenario.seed
    ins = ins_readings(trajectory, scenario.ins, generator(seed, "ins"), seed)
    gnss = gnss_readings(trajectory, scenario.gnss, generator(seed, "gnss"))
    readings = [
        ins.only(scenario.ins.fields),
        gnss.only(scenario.gnss.fields),
        discrete_readings(trajectory, scenario.discrete),
        truth_readings(trajectory, scenario.truth),
    ]
    if scenario.onboard is not None:
        readings.append(onboard_readings(trajectory, ins, gnss, scenario.onboard))
    if scenario.magnetometer is not None:
        rng = generator(seed, "magnetometer")
        readings.append(magnetometer_readings(trajectory, scenario, scenario.magnetometer, rng))
    if scenario.electric is not None:
        readings.append(electric_readings(trajectory, scenario.electric, generator(seed, "electric")))
    if scenario.baro is not None:
        readings.append(baro_readings(trajectory, scenario.baro, generator(seed, "baro")))
    if scenario.air is not None:
        readings.append(air_readings(trajectory, scenario.air, scenario.wind, generator(seed, "air")))
    if scenario.adf is not None:
        readings += adf_readings(trajectory, scenario.adf, scenario.runway, generator(seed, "adf"))
    if scenario.radio_altimeter is not None:
        rng = generator(seed, "radio_altimeter")
        readings.append(radio_altimeter_readings(trajectory, scenario.radio_altimeter, scenario.runway, rng))
    if scenario.events:
        readings.append(event_readings(trajectory, scenario.events))
    return readings


def _assemble(scenario: Scenario, readings: list[TopicReadings]) -> Flight:
    """Put readings into tables whose rows know their row of the log.

    Samples recorded at one time share a row, unless repeated.
    """
    utc_of_zero_ns = scenario.start_utc_ns
    zero_ns = utc_of_zero_ns or 0
    row_times: Int64Array = np.unique(np.concatenate([part.time_ns for part in readings]))
    tables = {
        part.topic: Table(
            topic=part.topic,
            time_ns=part.time_ns + zero_ns,
            columns=part.columns,
            record_index=np.searchsorted(row_times, part.time_ns).astype(np.int64),
            device_time_ns=Column(part.time_ns),
        )
        for part in readings
    }
    return Flight(
        tables=tables,
        metadata=_metadata(scenario),
        start_ns=zero_ns,
        has_utc=utc_of_zero_ns is not None,
        source_name=f"{scenario.name}.csv",
    )


def _metadata(scenario: Scenario) -> dict[str, str]:
    found = {"aircraft": scenario.aircraft, "flight": scenario.flight, "start_utc": scenario.start_utc}
    if scenario.reference.logged:
        found["reference.parking_heading_deg"] = f"{scenario.reference_heading_deg:.4f}"
        found["reference.parking_heading_sigma_deg"] = f"{scenario.reference.sigma_deg:.4f}"
    if scenario.ins.error_model == "full":
        found["ins_class"] = scenario.ins.ins_class
    found |= {"datum": "WGS-84", "notes": scenario.log.notes}
    return {key: value for key, value in found.items() if value}

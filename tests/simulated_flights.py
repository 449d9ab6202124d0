"""Small scenarios that the simulation's tests share."""

from typing import Any

from groundstation.simulation.scenario import Scenario, scenario_from_table

AIRPORT = {"latitude_deg": 55.97, "longitude_deg": 37.41, "altitude_ellipsoid_m": 200.0}
QUIET_GROUND = {"sway_sigma_deg": 0.0, "steering_sigma_deg": 0.0}
QUIET_INS = {
    "heading_noise_deg": 0.0,
    "attitude_noise_deg": 0.0,
    "velocity_noise_mps": 0.0,
    "velocity_error_mps": [0.0, 0.0],
    "tilt_arcsec": [0.0, 0.0],
    "drift_dph": [0.0, 0.0],
    "position_error_m": [0.0, 0.0],
}
QUIET_GNSS = {
    "velocity_white_mps": 0.0,
    "velocity_correlated_mps": 0.0,
    "position_white_m": 0.0,
    "position_correlated_m": 0.0,
}
TAXI_LEGS = [
    {"kind": "parked", "duration_s": 20},
    {"kind": "taxi", "length_m": 200, "speed_mps": 9},
    {"kind": "ground_turn", "angle_deg": 100},
    {"kind": "taxi", "length_m": 250, "speed_mps": 11},
    {"kind": "parked", "duration_s": 5},
]
FLIGHT_LEGS = [
    *TAXI_LEGS,
    {"kind": "take_off"},
    {"kind": "climb_to", "altitude_m": 700, "airspeed_mps": 70},
    {"kind": "air_turn", "angle_deg": 120, "bank_deg": 20},
    {"kind": "air_turn", "angle_deg": -120, "bank_deg": 20},
    {"kind": "fly", "duration_s": 30, "airspeed_mps": 60, "climb_rate_mps": 1.0},
    {"kind": "landing", "runway_altitude_m": 180},
    {"kind": "taxi", "length_m": 150, "speed_mps": 8},
    {"kind": "parked", "duration_s": 5},
]


def scenario(**changes: Any) -> Scenario:
    """A taxi with everything at its default but for ``changes`` (TOML tables by name)."""
    table: dict[str, Any] = {"airport": AIRPORT, "legs": TAXI_LEGS, "start_utc": "2026-05-04T06:00:00Z"}
    return scenario_from_table(table | changes, "test", "test.toml")


def quiet(**changes: Any) -> Scenario:
    """The same without any error but those that ``changes`` put in."""
    ins, gnss = QUIET_INS | changes.pop("ins", {}), QUIET_GNSS | changes.pop("gnss", {})
    return scenario(**{"ins": ins, "gnss": gnss, "ground": QUIET_GROUND} | changes)

"""Landing aids of a simulated flight: direction finder on beacons, radio altimeter.

The runway is where the flight lands: its course is the track at touchdown, its threshold lies a stated distance before
the touchdown and to a stated side of it, so that a scenario lands off the centre line without flying otherwise.
"""

import numpy as np

from groundstation.base.angles import FloatArray, direction_of, wrap_180
from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import SettingsError
from groundstation.base.geodesy import curvature_radii_m
from groundstation.base.records import Column
from groundstation.simulation.landing_settings import AdfSettings, RadioAltimeterSettings, RunwayOfLanding
from groundstation.simulation.processes import gauss_markov
from groundstation.simulation.readings import TopicReadings, every, quantised
from groundstation.simulation.scenario import Scenario
from groundstation.simulation.trajectory import Trajectory


@dataclass(frozen=True)
class RunwayPlaces:
    """Trajectory in the frame of its runway, shape (n,): along, right, up.

    With it goes the heading off the course.
    """

    along_m: FloatArray
    right_m: FloatArray
    up_m: FloatArray
    off_course_deg: FloatArray
    course_deg: float


def runway_places(trajectory: Trajectory, runway: RunwayOfLanding) -> RunwayPlaces:
    """The trajectory about the threshold of its last landing.

    Raises
    ------
    SettingsError
        When it never lands.
    """
    touched = np.flatnonzero(trajectory.airborne[:-1] & ~trajectory.airborne[1:])
    if not len(touched):
        raise SettingsError("legs", "no landing", "a leg of kind landing, for the runway of the landing aids")
    k = int(touched[-1]) + 1
    course_deg = float(direction_of(trajectory.velocity_north_mps[k], trajectory.velocity_east_mps[k]))
    meridian, normal = (float(radius) for radius in curvature_radii_m(trajectory.latitude_deg[k]))
    height = float(trajectory.altitude_m[k])
    north = np.deg2rad(trajectory.latitude_deg - trajectory.latitude_deg[k]) * (meridian + height)
    parallel = (normal + height) * np.cos(np.deg2rad(trajectory.latitude_deg[k]))
    east = np.deg2rad(wrap_180(trajectory.longitude_deg - trajectory.longitude_deg[k])) * parallel
    sine, cosine = np.sin(np.deg2rad(course_deg)), np.cos(np.deg2rad(course_deg))
    return RunwayPlaces(
        north * cosine + east * sine + runway.threshold_before_touchdown_m,
        east * cosine - north * sine - runway.threshold_right_m,
        trajectory.altitude_m - height,
        wrap_180(trajectory.heading_deg - course_deg),
        course_deg,
    )


def site_of(trajectory: Trajectory, scenario: Scenario) -> str:
    """Site file (TOML) of the runway and the beacons of a scenario that has any, else empty."""
    if scenario.adf is None:
        return ""
    course_deg = runway_places(trajectory, scenario.runway).course_deg
    lines = ["[[runways]]", 'name = "landing"', f"true_bearing_deg = {course_deg:.4f}"]
    for beacon in scenario.adf.beacons:
        lines += ["", "[[beacons]]", f'name = "{beacon.name}"', f"before_threshold_m = {beacon.before_threshold_m:g}"]
        lines.append(f"right_m = {beacon.right_m:g}")
    return "\n".join((*lines, ""))


def adf_readings(
    trajectory: Trajectory, settings: AdfSettings, runway: RunwayOfLanding, rng: np.random.Generator
) -> list[TopicReadings]:
    """Relative bearings of every beacon, one topic each; none beyond the range."""
    index = every(trajectory, settings.rate_hz)
    places, motion = runway_places(trajectory, runway), trajectory.at(index)
    readings = []
    for beacon in settings.beacons:
        ahead = -beacon.before_threshold_m - places.along_m[index]
        aside = beacon.right_m - places.right_m[index]
        error = settings.sigma_deg * rng.standard_normal(len(index))
        error += gauss_markov(
            rng, (len(index),), 1.0 / settings.rate_hz, settings.correlated_deg, settings.correlation_s
        )
        bearing = wrap_180(np.rad2deg(np.arctan2(aside, ahead)) - places.off_course_deg[index] + error)
        bearing = wrap_180(-bearing) if settings.is_reversed else bearing
        columns = {
            "relative_bearing_deg": Column(
                quantised(bearing, settings.resolution_deg), np.hypot(ahead, aside) < settings.longest_range_m
            )
        }
        step = {"relative_bearing_deg": settings.resolution_deg}
        readings.append(TopicReadings(f"adf.{beacon.name}", motion.time_ns, columns, step))
    return readings


def radio_altimeter_readings(
    trajectory: Trajectory, settings: RadioAltimeterSettings, runway: RunwayOfLanding, rng: np.random.Generator
) -> TopicReadings:
    """Return the height above the ground, which rises before the threshold.

    From the threshold on, the ground is the runway.
    """
    index = every(trajectory, settings.rate_hz)
    places, motion = runway_places(trajectory, runway), trajectory.at(index)
    ground = settings.rise_m_per_km * np.maximum(-places.along_m[index], 0.0) / 1000.0
    height = places.up_m[index] - ground + settings.sigma_m * rng.standard_normal(len(index))
    columns = {"height_m": Column(quantised(height, settings.resolution_m), height <= settings.highest_m)}
    return TopicReadings("radio_altimeter", motion.time_ns, columns, {"height_m": settings.resolution_m})

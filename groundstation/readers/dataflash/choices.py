"""Choice among several sources of a canonical field, and the remarks on it."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from groundstation.base.records import Remark
from groundstation.readers import imu
from groundstation.readers.dataflash import rules
from groundstation.readers.dataflash.overview import DataflashOverview, States, Unit
from groundstation.readers.dataflash.rules import FieldRule

_EKF_OF_TYPE = {2.0: "NKF", 3.0: "XKF"}  # parameter AHRS_EKF_TYPE
_SECOND_CORE = {"1": "6", "2": "7"}  # old firmware logged the second core under these numbers


@dataclass(frozen=True, eq=False)
class Choices:
    """Sources of the canonical topics of a log.

    Parameters
    ----------
    sensor_topics : mapping of sensor to topic
    imu_topics : mapping of sensor to topic
        Records of increments, or of samples.
    rates : tuple of sensors
        Whose angular rates and accelerations are those of ``ins``.
    ekf : str
        ``XKF``, ``NKF``, ``EKF``: the filter in use; empty when none is, or none is logged.
    ekf_topic : str
        ``ins``; or ``ins.2`` where the first filter was only the second estimate, as AHR2 is then.
    ekf_velocity, ekf_wind : mapping of sensor to core
        Records of the filter, and the core that wrote them; None where the filter has but one.
    primary_core : States
    yaw : FieldRule
        What the autopilot's yaw is: true heading, or magnetic where no declination is set.
    yaw_origin : str
    mode : str
        Mode of ``ins``.
    vehicle : str
    """

    sensor_topics: Mapping[Unit, str]
    imu_topics: Mapping[Unit, str]
    rates: tuple[Unit, ...]
    ekf: str
    ekf_topic: str
    ekf_velocity: Mapping[Unit, int | None]
    ekf_wind: Mapping[Unit, int | None]
    primary_core: States
    yaw: FieldRule
    yaw_origin: str
    mode: str
    vehicle: str

    def remarks(self, found: DataflashOverview, fields: Mapping[str, Iterable[str]]) -> list[Remark]:
        """Return the remarks on the canonical topics that have records.

        ``fields`` has the fields of each topic.
        """
        given = {topic: set(names) for topic, names in fields.items()}
        remarks = []
        for topic in sorted(given):
            known = tuple(name for name in ("velocity_north_mps", "velocity_east_mps") if name in given[topic])
            if topic.startswith("gnss") and known:
                remarks.append(Remark("derived", "from GPS speed and course over ground", topic, known))
            if self.yaw.field in given[topic]:
                origin = self.yaw_origin if topic == "ins" else "yaw of AHR2, the autopilot's second estimate"
                remarks.append(Remark("derived", origin, topic, (self.yaw.field,)))
            if topic.startswith("magnetometer"):
                text = "in body axes, the autopilot's calibration (offsets, soft iron, motors) already applied"
                remarks.append(Remark("converted", f"field {text}; parameters COMPASS_* tell it", topic))
            if topic.startswith("baro"):
                text = "from measured pressure by the standard atmosphere (BARO.Alt counts from power-up, kept as raw)"
                remarks.append(Remark("derived", text, topic, ("pressure_altitude_m",)))
            if topic.startswith("radio_altimeter"):
                text = "distance of a downward range finder along its axis, not corrected for tilt"
                remarks.append(Remark("derived", text, topic, ("height_m",)))
            if topic.startswith("imu"):
                remarks.append(self._of_imu(topic, given[topic]))
        if "discrete" in given:
            text = "state of the land detector (EV land complete, not landed), repeated at each ATT record"
            remarks.append(Remark("derived", text, "discrete", ("weight_on_wheels",)))
        if "velocity_north_mps" in given.get(self.ekf_topic, ()):
            fields_of = tuple(f"velocity_{axis}_mps" for axis in ("north", "east", "down"))
            origin = f"velocity of {self.ekf}1, the core in use" if self.ekf else "velocity of EKF1, not in use"
            remarks.append(Remark("derived", origin, self.ekf_topic, fields_of))
        return remarks

    def _of_imu(self, topic: str, fields: set[str]) -> Remark:
        """Return the remark on the source of a unit."""
        names = " and ".join(sorted({unit[0] for unit, fed in self.imu_topics.items() if fed == topic}))
        told = tuple(sorted(fields - {"is_integral"}))
        what = "increments of the autopilot" if "interval_s" in fields else imu.POINT_SAMPLES
        return Remark("derived", f"{names}: {what}", topic, told)


def choose(found: DataflashOverview, vehicle: str) -> Choices:
    """Choose sources by the parameters, and by what has records."""
    ekf = _filter_in_use(found)
    is_second = not ekf and found.parameters.get("AHRS_EKF_USE") == 0.0 and "AHRS_EKF_TYPE" not in found.parameters
    yaw, origin = _yaw(found, ekf)
    rates = next((kinds for kinds in (("IMU",), ("GYR", "ACC")) if any(kind in found.types for kind in kinds)), ())
    return Choices(
        sensor_topics=_sensor_topics(found),
        imu_topics=_imu_topics(found),
        rates=tuple(min(units, key=_instance) for name in rates if (units := _units_of(found, name))),
        ekf=ekf,
        ekf_topic="ins.2" if is_second else "ins",
        ekf_velocity=_cores(found, "EKF" if is_second else ekf, "1"),
        ekf_wind=_cores(found, ekf, "2"),
        primary_core=found.primary_core.get(f"{ekf}4", States()),
        yaw=yaw,
        yaw_origin=origin,
        mode="gnss_aided" if found.has_fix else "attitude",
        vehicle=vehicle,
    )


def _instance(unit: Unit) -> int:
    return unit[1] or 0


def _units_of(found: DataflashOverview, name: str) -> list[Unit]:
    return [unit for unit in found.sensors if unit[0] == name and _instance(unit) < rules.MOST_SENSORS]


def _sensor_topics(found: DataflashOverview) -> dict[Unit, str]:
    """Topic of each sensor: the kind alone where there is one sensor, else numbered from 1."""
    topics: dict[Unit, str] = {}
    for kind, groups in rules.SENSOR_TYPES.items():
        for names in groups:
            units = [unit for name in names for unit in sorted(_units_of(found, name), key=_instance)]
            if units:
                numbered = len(units) > 1
                topics |= {unit: f"{kind}.{at + 1}" if numbered else kind for at, unit in enumerate(units)}
                break
    return topics


def _imu_topics(found: DataflashOverview) -> dict[Unit, str]:
    """Return the topic of each unit, from the best source that the logger did not thin out.

    Gyros and accelerometers that are logged apart feed one topic, by their number.
    """
    counts = [max((found.counts.get(types[0], 0) for types in group), default=0) for group in rules.IMU_TYPES]
    place = imu.first_whole(counts)
    if place is None:
        return {}
    topics: dict[Unit, str] = {}
    several = [
        [unit for name in types for unit in sorted(_units_of(found, name), key=_instance)]
        for types in rules.IMU_TYPES[place]
    ]
    most = max(map(len, several))
    for units in several:
        topics |= {unit: f"imu.{at}" if most > 1 else "imu" for at, unit in enumerate(units, start=1)}
    return topics


def _filter_in_use(found: DataflashOverview) -> str:
    """Return the Kalman filter that the parameters name, if it has records.

    Without parameters it is the newest filter that has records.
    """
    kind, used = found.parameters.get("AHRS_EKF_TYPE"), found.parameters.get("AHRS_EKF_USE")
    if kind is not None:
        candidates = [_EKF_OF_TYPE[kind]] if kind in _EKF_OF_TYPE else []
    elif used is not None:
        candidates = ["EKF"] if used else []
    else:
        candidates = ["XKF", "NKF", "EKF"]
    return next((name for name in candidates if f"{name}1" in found.types), "")


def _cores(found: DataflashOverview, ekf: str, number: str) -> dict[Unit, int | None]:
    """Return the core of each unit of a filter's records ``number``.

    The core is told by the instance field, or by the type's number.
    """
    if not ekf:
        return {}
    if f"{ekf}4" not in found.primary_core:
        return dict.fromkeys(_units_of(found, f"{ekf}{number}")[:1])
    first = {unit: _instance(unit) for unit in _units_of(found, f"{ekf}{number}")}
    second = {unit: 1 for unit in _units_of(found, f"{ekf}{_SECOND_CORE[number]}") if unit[1] is None}
    return {**first, **second}


def _yaw(found: DataflashOverview, ekf: str) -> tuple[FieldRule, str]:
    """Return the meaning of the yaw of ATT, by the parameters that set its declination."""
    names = {"XKF": "EKF3", "NKF": "EKF2", "EKF": "the EKF"}
    origin = f"yaw of ATT ({names.get(ekf, 'DCM or a filter that is not logged')})"
    automatic, fixed_rad = found.parameters.get("COMPASS_AUTODEC"), found.parameters.get("COMPASS_DEC")
    if (automatic is None and not fixed_rad) or (fixed_rad is None and not automatic):
        return rules.TRUE_YAW, f"{origin}; the log does not tell which declination is in it"
    if found.parameters.get("COMPASS_USE") == 0.0:
        return rules.TRUE_YAW, f"{origin}, without a compass: aligned by GPS course"
    declination = "not logged" if fixed_rad is None else f"{math.degrees(fixed_rad):+.2f} deg"
    if automatic:
        return (
            rules.TRUE_YAW,
            f"{origin} with compass, declination by the autopilot's own table (COMPASS_DEC {declination})",
        )
    if fixed_rad:
        return rules.TRUE_YAW, f"{origin} with compass, declination set by hand to {declination}"
    return rules.MAGNETIC_YAW, f"{origin} with compass, no declination set (COMPASS_AUTODEC 0, COMPASS_DEC 0): magnetic"

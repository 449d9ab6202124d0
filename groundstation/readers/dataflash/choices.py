"""Choice among several sources of a canonical field, and the remarks on it."""

import math
from collections.abc import Iterable, Mapping

import numpy as np

from groundstation.base.ardupilot_codes import ESTIMATORS
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray, Int64Array, Remark
from groundstation.readers import imu
from groundstation.readers.dataflash import rules
from groundstation.readers.dataflash.overview import DataflashOverview, States, Unit
from groundstation.readers.dataflash.rules import FieldRule

_EKF_OF_TYPE = {2.0: "NKF", 3.0: "XKF"}  # parameter AHRS_EKF_TYPE
_NUMBERS = {"EKF": 1, "NKF": 2, "XKF": 3}  # of ATT.AEKF
_DCM, _SIMULATOR = 0, 10
_TITLES = {_SIMULATOR: "the simulator's truth, no estimate", 11: "an external AHRS"}
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
        ``XKF``, ``NKF``, ``EKF``: the filter whose velocity is taken; empty when none is logged.
    ekf_flew : bool or None
        Whether it gave the attitude; None where it did so at times, and ATT.AEKF tells when. While it does not, it is
        the second estimate, ``ins.2``, as AHR2 is then.
    ekf_velocity, ekf_wind : mapping of sensor to core
        Records of the filter, and the core that wrote them; None where the filter has but one.
    primary_core, attitude_by : States
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
    ekf_flew: bool | None
    ekf_velocity: Mapping[Unit, int | None]
    ekf_wind: Mapping[Unit, int | None]
    primary_core: States
    attitude_by: States
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
        fields_of = tuple(f"velocity_{axis}_mps" for axis in ("north", "east", "down"))
        for topic, is_used in (("ins", True), ("ins.2", False)):
            if "velocity_north_mps" in given.get(topic, ()):
                origin = f"velocity of {self.ekf}1, {self._use(is_used)}"
                remarks.append(Remark("derived", origin, topic, fields_of))
        return remarks

    def _use(self, is_used: bool) -> str:
        if self.ekf_flew is None:
            return f"the core in use, while {'it' if is_used else 'another estimator'} gave the attitude"
        return "the core in use" if is_used else "not in use"

    def flies(self, record_index: Int64Array) -> BoolArray:
        """Tell at which records the filter gave the attitude, shape (n,)."""
        if self.ekf_flew is not None:
            return np.full(len(record_index), self.ekf_flew)
        return np.asarray(self.attitude_by.at(record_index, before=self.attitude_by.first) == _NUMBERS[self.ekf])

    def _of_imu(self, topic: str, fields: set[str]) -> Remark:
        """Return the remark on the source of a unit."""
        names = " and ".join(sorted({unit[0] for unit, fed in self.imu_topics.items() if fed == topic}))
        told = tuple(sorted(fields - {"is_integral"}))
        what = "increments of the autopilot" if "interval_s" in fields else imu.POINT_SAMPLES
        return Remark("derived", f"{names}: {what}", topic, told)


def choose(found: DataflashOverview, vehicle: str) -> Choices:
    """Choose sources by the parameters, and by what has records."""
    ekf, ekf_flew = _filter(found)
    yaw, origin = _yaw(found, ekf if ekf_flew else "")
    rates = next((kinds for kinds in (("IMU",), ("GYR", "ACC")) if any(kind in found.types for kind in kinds)), ())
    return Choices(
        sensor_topics=_sensor_topics(found),
        imu_topics=_imu_topics(found),
        rates=tuple(min(units, key=_instance) for name in rates if (units := _units_of(found, name))),
        ekf=ekf,
        ekf_flew=ekf_flew,
        ekf_velocity=_cores(found, ekf, "1"),
        ekf_wind={} if ekf_flew is False else _cores(found, ekf, "2"),
        primary_core=found.primary_core.get(f"{ekf}4", States()),
        attitude_by=found.attitude_by,
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


def _filter(found: DataflashOverview) -> tuple[str, bool | None]:
    """Return the Kalman filter whose velocity is taken, and whether it gave the attitude.

    ATT.AEKF tells it record by record: a plane flies by DCM until its filter is ready. Else it is the filter that the
    parameters name, if it has records; without parameters the newest that has. DCM's velocity is not logged: where it
    flew, that of the filter beside it is taken, as the second estimate.
    """
    kind, used = found.parameters.get("AHRS_EKF_TYPE"), found.parameters.get("AHRS_EKF_USE")
    told = {_EKF_OF_TYPE.get(kind, "")} if kind is not None else {"EKF"} if used is not None else set(_NUMBERS)
    numbers = set(found.attitude_by.values.tolist())
    logged = sorted((name for name in _NUMBERS if f"{name}1" in found.types), key=_NUMBERS.__getitem__, reverse=True)
    logged.sort(key=lambda name: (_NUMBERS[name] not in numbers, name not in told))
    if not logged:
        return "", False
    if not numbers:
        return logged[0], logged[0] in told and used != 0.0
    flew = _NUMBERS[logged[0]] in numbers
    return logged[0], None if flew and len(numbers) > 1 else flew


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


def _attitude_numbers(found: DataflashOverview, ekf: str) -> list[int]:
    """Return the estimators that gave the attitude, the one of the parameters last.

    None where the log is silent.
    """
    kind = found.parameters.get("AHRS_EKF_TYPE")
    told = (
        _DCM
        if found.parameters.get("AHRS_EKF_USE") == 0.0
        else None
        if kind is None or not math.isfinite(kind)
        else int(kind)
    )
    logged = set(found.attitude_by.values.tolist())
    if logged:
        return sorted(logged, key=lambda one: (one == told, one))
    if ekf:
        return [_NUMBERS[ekf]]
    return [told] if told in (_DCM, _SIMULATOR) else []


def _yaw(found: DataflashOverview, ekf: str) -> tuple[FieldRule, str]:
    """Return the meaning of the yaw of ATT, by the parameters that set its declination."""
    numbers = _attitude_numbers(found, ekf)
    titles = [_TITLES.get(one, ESTIMATORS.get(one, f"estimator {one}")) for one in numbers]
    origin = f"yaw of ATT ({' and '.join(titles) or 'DCM or a filter that is not logged'})"
    if numbers == [_SIMULATOR]:
        return rules.TRUE_YAW, origin
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

"""Evidence of PX4's estimator.

Test ratios, rejections, resets, biases, faults, and one estimator against another.
"""

from collections.abc import Iterator, Mapping

import numpy as np

from groundstation.systems.health.evidence import ZERO, Evidence, FloatArray, blank
from groundstation.systems.health.px4_topics import (
    Topic,
    counted,
    estimators,
    evidence_of,
    largest,
    newest,
    topic,
    topics,
)
from groundstation.tables.table import Flight

# What is measured, with the fields that hold its test ratio, the first that the log has and that is ever above zero:
# a ratio that stays zero is of a sensor that the filter does not use.
RATIOS: Mapping[str, tuple[tuple[str, tuple[str, ...]], ...]] = {
    "GNSS and vision velocity": (
        ("estimator_status", ("vel_test_ratio",)),
        ("estimator_aid_src_gnss_vel", ("test_ratio[0]", "test_ratio[1]", "test_ratio[2]")),
        ("estimator_innovation_test_ratios", ("gps_hvel[0]", "gps_hvel[1]", "gps_vvel")),
    ),
    "horizontal position": (
        ("estimator_status", ("pos_test_ratio",)),
        ("estimator_aid_src_gnss_pos", ("test_ratio[0]", "test_ratio[1]")),
        ("estimator_innovation_test_ratios", ("gps_hpos[0]", "gps_hpos[1]")),
    ),
    "height": (
        ("estimator_status", ("hgt_test_ratio",)),
        ("estimator_aid_src_baro_hgt", ("test_ratio",)),
        ("estimator_innovation_test_ratios", ("baro_vpos", "gps_vpos", "rng_vpos")),
    ),
    "magnetic field": (
        ("estimator_status", ("mag_test_ratio",)),
        ("estimator_aid_src_mag", ("test_ratio[0]", "test_ratio[1]", "test_ratio[2]")),
        ("estimator_innovation_test_ratios", ("mag_field[0]", "mag_field[1]", "mag_field[2]")),
    ),
    "heading": (
        ("estimator_status", ("hdg_test_ratio",)),
        ("estimator_aid_src_mag_heading", ("test_ratio",)),
        ("estimator_aid_src_gnss_yaw", ("test_ratio",)),
        ("estimator_innovation_test_ratios", ("heading",)),
    ),
    "airspeed": (
        ("estimator_status", ("tas_test_ratio",)),
        ("estimator_aid_src_airspeed", ("test_ratio",)),
        ("estimator_innovation_test_ratios", ("airspeed",)),
    ),
    "height above ground": (
        ("estimator_status", ("hagl_test_ratio",)),
        ("estimator_aid_src_terrain_range_finder", ("test_ratio",)),
        ("estimator_innovation_test_ratios", ("hagl",)),
    ),
    "sideslip": (("estimator_status", ("beta_test_ratio",)), ("estimator_innovation_test_ratios", ("beta",))),
    "optical flow": (
        ("estimator_aid_src_optical_flow", ("test_ratio[0]", "test_ratio[1]")),
        ("estimator_innovation_test_ratios", ("flow[0]", "flow[1]")),
    ),
}
# Bits of estimator_status.innovation_check_flags. PX4 up to 1.10 (topic ekf2_innovations) had one bit for velocity.
BITS_UP_TO_1_10 = (
    *("velocity", "horizontal position", "height", "magnetic field X", "magnetic field Y", "magnetic field Z"),
    *("heading", "airspeed", "sideslip", "height above ground", "optical flow X", "optical flow Y"),
)
BITS_FROM_1_11 = ("horizontal velocity", "vertical velocity", *BITS_UP_TO_1_10[1:])
REJECTED: Mapping[str, str] = {
    "reject_hor_vel": "horizontal velocity",
    "reject_ver_vel": "vertical velocity",
    "reject_hor_pos": "horizontal position",
    "reject_ver_pos": "height",
    "reject_mag_x": "magnetic field X",
    "reject_mag_y": "magnetic field Y",
    "reject_mag_z": "magnetic field Z",
    "reject_yaw": "heading",
    "reject_airspeed": "airspeed",
    "reject_sideslip": "sideslip",
    "reject_hagl": "height above ground",
    "reject_optflow_x": "optical flow X",
    "reject_optflow_y": "optical flow Y",
}
GNSS_CHECKS = (  # bits of estimator_status.gps_check_fail_flags that hold in flight; the drifts need standstill
    *("fix", "satellites", "PDOP", "horizontal accuracy", "vertical accuracy", "speed accuracy"),
)
RESETS: Mapping[str, str] = {
    "reset_count_vel_ne": "horizontal velocity",
    "reset_count_vel_d": "vertical velocity",
    "reset_count_pos_ne": "horizontal position",
    "reset_count_pod_d": "height",
    "reset_count_quat": "attitude and heading",
}
RESETS_OF_OUTPUT: Mapping[str, str] = {
    "vxy_reset_counter": "horizontal velocity",
    "vz_reset_counter": "vertical velocity",
    "xy_reset_counter": "horizontal position",
    "z_reset_counter": "height",
    "heading_reset_counter": "attitude and heading",
}
OF_HEADING = ("reset_count_quat",)
ALIGNED_IN_FLIGHT, ALIGNED_NS = 23, 1_000_000_000  # bit of control_mode_flags, and how near a reset of that is
OUTPUT = (("output_angle_rad", "rad"), ("output_velocity_mps", "m/s"), ("output_position_m", "m"))


def estimator_evidence(flight: Flight) -> Iterator[Evidence]:
    """Yield what the estimator logs of itself.

    Of several it is the one that flew the aircraft at the time.
    """
    yield from _ratios(flight)
    yield from _rejected(flight)
    yield from _gnss_checks(flight)
    yield from _resets(flight)
    yield from _biases(flight)
    yield from _output(flight)
    yield from _faults(flight)
    yield from _against_each_other(flight)


def is_aligned(flight: Flight) -> bool:
    """Tell whether the filter ever ran.

    A log in which its flags stay zero is of one that did not.
    """
    found = [one for one in topics(flight, "estimator_status") if one.has("control_mode_flags")]
    return not found or any(bool((one.values("control_mode_flags") > 0.0).any()) for one in found)


def _shown(one: Topic, rows: np.ndarray, value: FloatArray) -> FloatArray:
    """Return a value where this estimator flew the aircraft."""
    return np.where(rows, value, np.nan)


def _ratios(flight: Flight) -> Iterator[Evidence]:
    ratios = list(_ratios_found(flight))
    yield from ratios
    one = next(topics(flight, "estimator_status"), None)
    if not ratios and one is not None:
        fields = [
            field for places in RATIOS.values() for name, fields in places if name == one.name for field in fields
        ]
        if any(one.has(field) for field in fields):
            yield blank("innovations", one.name, one.time_ns, f"the ratios of {one.name} are {ZERO}")


def _ratios_found(flight: Flight) -> Iterator[Evidence]:
    for sensor, places in RATIOS.items():
        for name, fields in places:
            found = []
            for one, rows in estimators(flight, name):
                value = _shown(one, rows, largest(one, fields))
                if bool((np.nan_to_num(value) > 0.0).any()):
                    field = fields[0] if len(fields) == 1 else fields[0].partition("[")[0]
                    found.append(evidence_of("innovations", "test_ratio", sensor, one, field, value))
            if found:
                yield from found
                break


def _rejected(flight: Flight) -> Iterator[Evidence]:
    flags = [(one, rows) for one, rows in estimators(flight, "estimator_status_flags") if one.has("reject_hor_pos")]
    for one, rows in flags:
        for field, sensor in REJECTED.items():
            if one.has(field):
                value = _shown(one, rows, one.values(field))
                yield evidence_of("innovations", "rejected", sensor, one, field, value)
    if flags or not is_aligned(flight):
        return
    bits = BITS_UP_TO_1_10 if topic(flight, "ekf2_innovations") else BITS_FROM_1_11
    for one, rows in estimators(flight, "estimator_status"):
        if one.has("innovation_check_flags"):
            for bit, sensor in enumerate(bits):
                value = _shown(one, rows, _bit(one.values("innovation_check_flags"), bit))
                yield evidence_of("innovations", "rejected", sensor, one, "innovation_check_flags", value)


def _bit(flags: FloatArray, place: int) -> FloatArray:
    known = np.isfinite(flags)
    set_ = (np.where(known, flags, 0.0).astype(np.int64) >> place) & 1
    return np.where(known, set_, np.nan)


def _gnss_checks(flight: Flight) -> Iterator[Evidence]:
    if not is_aligned(flight) or topic(flight, "vehicle_gps_position", "sensor_gps") is None:
        return
    for one, rows in estimators(flight, "estimator_status"):
        if one.has("gps_check_fail_flags"):
            flags = one.values("gps_check_fail_flags")
            for bit, sensor in enumerate(GNSS_CHECKS):
                value = _shown(one, rows, _bit(flags, bit))
                yield evidence_of("gnss", "gnss_checks_failed", sensor, one, "gps_check_fail_flags", value)


def resets_of(one: Topic, field: str) -> tuple[np.ndarray, np.ndarray]:
    """Return the rows in which a counter of resets rises, and those by design.

    PX4 aligns heading and magnetic field once in flight (bit 23 of control_mode_flags): that is no fault.
    """
    value = counted(one.values(field))
    known = np.flatnonzero(np.isfinite(value))
    rows = known[1:][np.diff(value[known]) > 0.0]
    if field not in OF_HEADING or not one.has("control_mode_flags"):
        return rows, np.zeros(len(rows), dtype=bool)
    aligned = _bit(one.values("control_mode_flags"), ALIGNED_IN_FLIGHT)
    begun = one.time_ns[1:][np.diff(aligned) > 0.0]
    near = np.abs(one.time_ns[rows][:, None] - begun[None, :]) <= ALIGNED_NS
    return rows, near.any(axis=1)


def _resets_counted(one: Topic, field: str) -> FloatArray:
    """Return how many resets there were so far that are not by design."""
    rows, is_by_design = resets_of(one, field)
    steps = np.zeros(len(one.table))
    steps[rows[~is_by_design]] = np.diff(counted(one.values(field)), prepend=0.0)[rows[~is_by_design]]
    return np.where(np.isfinite(one.values(field)), np.cumsum(np.nan_to_num(steps, nan=1.0)), np.nan)


def _resets(flight: Flight) -> Iterator[Evidence]:
    counted_any = False
    for one, rows in estimators(flight, "estimator_status"):
        for field, sensor in RESETS.items():
            if one.has(field):
                counted_any = True
                value = _shown(one, rows, _resets_counted(one, field))
                yield evidence_of("resets", "resets", sensor, one, field, value)
    position = topic(flight, "vehicle_local_position")
    if counted_any or position is None or not is_aligned(flight):
        return
    for field, sensor in RESETS_OF_OUTPUT.items():
        if position.has(field):
            yield evidence_of("resets", "resets", sensor, position, field, counted(position.values(field)))
    attitude = topic(flight, "vehicle_attitude")
    if attitude is not None and attitude.has("quat_reset_counter") and not position.has("heading_reset_counter"):
        value = counted(attitude.values("quat_reset_counter"))
        yield evidence_of("resets", "resets", "attitude and heading", attitude, "quat_reset_counter", value)


def _biases(flight: Flight) -> Iterator[Evidence]:
    found = estimators(flight, "estimator_sensor_bias")
    for one, rows in found:
        for field, quantity, unit in (
            ("gyro_bias", "gyro_bias_radps", "rad/s"),
            ("accel_bias", "accel_bias_mps2", "m/s2"),
        ):
            if one.has(f"{field}[0]"):
                value = _shown(one, rows, np.linalg.norm(one.vector(field), axis=1))
                yield evidence_of("imu", quantity, "", one, field, value, unit)
    if found or not is_aligned(flight):
        return
    for one, rows in estimators(flight, "estimator_status"):  # up to 1.10: changes in one step of the filter
        if one.has("states[10]"):
            for first, quantity, unit in ((10, "delta_angle_bias_rad", "rad"), (13, "delta_velocity_bias_mps", "m/s")):
                parts = np.column_stack([one.values(f"states[{first + axis}]") for axis in range(3)])
                value = _shown(one, rows, np.linalg.norm(parts, axis=1))
                yield evidence_of("imu", quantity, "", one, f"states[{first}]", value, unit)


def _output(flight: Flight) -> Iterator[Evidence]:
    if not is_aligned(flight):
        return
    for name in ("estimator_status", "ekf2_innovations"):
        found = [(one, rows) for one, rows in estimators(flight, name) if one.has("output_tracking_error[0]")]
        for one, rows in found:
            for place, (quantity, unit) in enumerate(OUTPUT):
                field = f"output_tracking_error[{place}]"
                yield evidence_of("timing", quantity, "", one, field, _shown(one, rows, one.values(field)), unit)
        if found:
            break
    for one, rows in estimators(flight, "estimator_status"):
        if one.has("time_slip"):
            slip = one.values("time_slip")
            moved = np.abs(slip - slip[np.isfinite(slip)][0])
            yield evidence_of("timing", "time_slip_s", "", one, "time_slip", _shown(one, rows, moved), "s")


def _faults(flight: Flight) -> Iterator[Evidence]:
    if not is_aligned(flight):
        return
    for one, rows in estimators(flight, "estimator_status"):
        if one.has("filter_fault_flags"):
            value = _shown(one, rows, np.sign(one.values("filter_fault_flags")))
            yield evidence_of("faults", "fault", "filter", one, "filter_fault_flags", value)


def _against_each_other(flight: Flight) -> Iterator[Evidence]:
    """Yield each further estimator against the one that flew the aircraft."""
    selector = topic(flight, "estimator_selector_status")
    if selector is None or not selector.has("primary_instance"):
        return
    primary = selector.values("primary_instance")
    for name, quantity, unit, field, size in (
        ("estimator_attitude", "attitude_difference_deg", "deg", "q", 4),
        ("estimator_local_position", "position_difference_m", "m", "", 3),
    ):
        every = {one.instance: one for one in topics(flight, name)}
        for one in every.values():
            flown = np.full((len(one.table), size), np.nan)
            row = np.maximum(np.searchsorted(selector.time_ns, one.time_ns, side="right") - 1, 0)
            for other in every.values():
                mine = (primary[row] == other.instance) & (other.instance != one.instance)
                if mine.any():
                    flown[mine] = newest(other, _state(other, field), one.time_ns[mine])
            if np.isfinite(flown).any():
                value = _apart(_state(one, field), flown, is_attitude=bool(field))
                yield evidence_of("resets", quantity, f"estimator {one.instance}", one, field or "x", value, unit)


def _state(one: Topic, field: str) -> FloatArray:
    if field:
        return one.vector(field, 4)
    placed = np.column_stack([one.values(axis) for axis in ("x", "y", "z")])
    if "xy_valid" in one.table.columns:  # one that is not valid counts from anywhere
        placed[one.values("xy_valid") != 1.0] = np.nan
    return placed


def _apart(mine: FloatArray, flown: FloatArray, *, is_attitude: bool) -> FloatArray:
    if not is_attitude:
        return np.asarray(np.linalg.norm(mine - flown, axis=1))
    with np.errstate(invalid="ignore"):
        cosine = np.abs(np.sum(mine * flown, axis=1)) / (np.linalg.norm(mine, axis=1) * np.linalg.norm(flown, axis=1))
        return np.asarray(np.rad2deg(2.0 * np.arccos(np.clip(cosine, 0.0, 1.0))))

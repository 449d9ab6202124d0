"""Mounting of an inertial unit: found in whatever way the case stands, refused where the unit is not sound."""

from dataclasses import replace

import numpy as np
import pytest

import groundstation
from groundstation.base.errors import SettingsError
from groundstation.base.records import Column
from groundstation.base.toml_settings import settings_from
from groundstation.simulation.imu.families import Family
from groundstation.simulation.imu.settings import MountingSettings as SimulatedMounting
from groundstation.systems.known import AircraftData
from groundstation.systems.trajectory.axis_turns import angle_between_deg, from_angles
from groundstation.systems.trajectory.inputs import GnssFixes, ImuIncrements
from groundstation.systems.trajectory.mounting import NOT_SHOWN, LoggedMounting, Mounting, find_mounting
from groundstation.systems.trajectory.mounting_logged import logged_mounting
from groundstation.systems.trajectory.mounting_settings import MountingSettings
from groundstation.tables.table import Flight, Table
from tests.real_logs import real_log
from tests.systems.trajectory.units import (
    G_MPS2,
    KINDS,
    MIRRORS,
    TURNS,
    drive_0708,
    of_flight,
    reference_drive,
    scaled,
    simulated,
    turned,
)

SEEDS = range(20)
MOVING: tuple[Family, ...] = ("drive", "uav")
EVERY: tuple[Family, ...] = ("drive", "uav", "hover")
LEFT_HANDED, OTHER_AXES = "axes are left-handed", "gyros turn about other axes"
SMALL_DEG = (2.0, -3.0, 4.0)
SMALL_SEEN_DEG = 1.5  # camber, slip and squat of the car that is simulated, and errors of its unit
ANGLE_SEEN_DEG = 2.5  # the same, of all three together
SLIP_DEG = 6.0  # crab and incidence of the aeroplane that is simulated


def found(pair: tuple[ImuIncrements, GnssFixes], family: Family, **more: object) -> Mounting:
    return find_mounting(*pair, vehicle=KINDS[family], **more)  # type: ignore[arg-type]


# Found


@pytest.mark.slow
@pytest.mark.parametrize("family", MOVING)
def test_every_turn_is_found(family: Family) -> None:
    imu, gnss = simulated(family)
    for turn in TURNS:
        mounting = found((turned(imu, turn), gnss), family)
        assert mounting.source == "found", mounting.words
        assert np.array_equal(mounting.body_from_case, turn.T)


@pytest.mark.parametrize("angles_deg", [(180.0, 0.0, 90.0), (0.0, 90.0, 0.0), (-90.0, 0.0, 180.0)])
def test_turn_is_that_of_the_simulation(angles_deg: tuple[float, float, float]) -> None:
    """Truth: the simulation turns the case by the same angles, with code of its own."""
    mounting = found(simulated("drive", mounting=SimulatedMounting(axes_deg=angles_deg)), "drive")
    assert mounting.source == "found"
    assert np.allclose(mounting.body_from_case, from_angles(angles_deg), atol=1e-9)


def test_small_angles_are_measured() -> None:
    """They are left to the estimator: what is found is the axis turn, with what is off."""
    mounting = found(simulated("drive", mounting=SimulatedMounting(small_deg=SMALL_DEG)), "drive")
    assert np.array_equal(mounting.body_from_case, np.eye(3))
    assert mounting.evidence.measured_deg == pytest.approx(SMALL_DEG, abs=SMALL_SEEN_DEG)


def test_case_at_an_angle_is_measured() -> None:
    """A case at 45 degrees is near no axis turn: small angles would be wrong."""
    mounting = found(simulated("drive", mounting=SimulatedMounting(axes_deg=(0.0, 0.0, 45.0))), "drive")
    assert mounting.source == "found" and "show the case at roll" in mounting.words
    assert angle_between_deg(mounting.body_from_case, from_angles((0.0, 0.0, 45.0))) < ANGLE_SEEN_DEG


def test_looks_agree() -> None:
    """Speeding up, turning and the gyros are looks of their own; each goes along with GNSS."""
    evidence = found(simulated("drive"), "drive").evidence
    assert min(evidence.along, evidence.across, evidence.turning) > 0.8
    assert evidence.turning_ratio == pytest.approx(1.0, abs=0.1)
    assert evidence.next_turn_deg - evidence.off_square_deg > 60.0
    in_the_air = found(simulated("uav"), "uav").evidence
    assert in_the_air.turning > 0.8 and np.isnan(in_the_air.across)  # a bank takes the force to the side away
    assert in_the_air.off_square_deg < SLIP_DEG


def test_time_and_lost_samples_change_nothing() -> None:
    imu, gnss = simulated("drive")
    later = replace(imu, time_s=imu.time_s + 1e5), replace(gnss, time_s=gnss.time_s + 1e5)
    assert np.array_equal(found(later, "drive").body_from_case, np.eye(3))
    kept = np.random.default_rng(3).uniform(size=len(gnss)) > 1.0 / 3.0
    fewer = {name: getattr(gnss, name)[kept] for name in gnss.__dataclass_fields__}
    assert found((imu, GnssFixes(**fewer)), "drive").source == "found"


def test_latency_of_gnss_is_seen() -> None:
    imu, gnss = simulated("drive")
    late = found((imu, replace(gnss, time_s=gnss.time_s + 0.4)), "drive")
    assert late.source == "found" and late.evidence.lag_s == pytest.approx(0.4, abs=0.11)


@pytest.mark.parametrize(("family", "source"), [("drive", "found"), ("uav", "found"), ("hover", "case")])
def test_vehicle_of_unknown_kind(family: Family, source: str) -> None:
    """Wheels show themselves by force to the side in turns, an aeroplane by its nose that goes with the track."""
    imu, gnss = simulated(family)
    mounting = find_mounting(turned(imu, TURNS[11]), gnss, vehicle=None)
    assert mounting.source == source
    assert np.array_equal(mounting.body_from_case, TURNS[11].T if source == "found" else np.eye(3))


def test_receiver_without_vertical_velocity() -> None:
    imu, gnss = simulated("drive")
    flat = gnss.velocity_mps.copy()
    flat[:, 2] = np.nan
    mounting = found((turned(imu, TURNS[5]), replace(gnss, velocity_mps=flat)), "drive")
    assert mounting.source == "found" and np.array_equal(mounting.body_from_case, TURNS[5].T)


def test_receiver_without_velocities() -> None:
    """Those of its positions, where these are good enough."""
    imu, gnss = simulated("drive", precise=True)
    none = replace(gnss, velocity_mps=np.full(gnss.velocity_mps.shape, np.nan))
    mounting = found((turned(imu, TURNS[9]), none), "drive")
    assert mounting.source == "found" and np.array_equal(mounting.body_from_case, TURNS[9].T)


# Not told


def test_multicopter_shows_no_forward() -> None:
    imu, gnss = simulated("hover")
    mounting = found((turned(imu, TURNS[7]), gnss), "hover")
    assert mounting.source == "case" and np.array_equal(mounting.body_from_case, np.eye(3))
    assert mounting.evidence.spans >= 10 and not mounting.refused  # the unit itself is proven sound


def test_who_walks_shows_no_forward() -> None:
    imu, gnss = simulated("drive")
    mounting = find_mounting(imu, gnss, vehicle="walks")
    assert mounting.source == "case" and "carried" in mounting.words


def test_standing_shows_nothing_but_down() -> None:
    imu, gnss = simulated("drive", duration_s=SHORT)
    standing = replace(gnss, velocity_mps=np.random.default_rng(1).normal(0.0, 0.05, gnss.velocity_mps.shape))
    mounting = found((turned(imu, from_angles((-90.0, 0.0, 0.0))), standing), "drive")
    assert mounting.source == "case" and "too little motion" in mounting.words
    assert "y axis points down" in mounting.words


SHORT = 30.0  # of the drives that are simulated: they stand longer


@pytest.mark.parametrize("count", [0, 1, 2])
def test_nothing_to_look_at(count: int) -> None:
    imu, gnss = simulated("drive")
    no_fixes = GnssFixes(**{name: getattr(gnss, name)[:count] for name in gnss.__dataclass_fields__})
    assert found((imu, no_fixes), "drive").source == "case"
    fields = {name: getattr(imu, name) for name in imu.__dataclass_fields__ if name != "is_integral"}
    few = ImuIncrements(**{name: values[:count] for name, values in fields.items()})
    assert found((few, gnss), "drive").source == "refused"
    unknown = {name: np.full(getattr(gnss, name).shape, np.nan) for name in ("velocity_mps", "latitude_deg")}
    assert found((imu, replace(gnss, **unknown)), "drive").source == "case"


# Refused


@pytest.mark.parametrize(
    ("family", "axis"),
    [
        pytest.param(family, axis, marks=() if axis == often else pytest.mark.slow)
        for family, often in zip(EVERY, "xyz", strict=True)
        for axis in "xyz"
    ],
)
def test_mirrored_axis_is_refused(family: Family, axis: str) -> None:
    mounting = found(simulated(family, mounting=SimulatedMounting(mirrored=axis)), family)  # type: ignore[arg-type]
    assert mounting.source == "refused" and LEFT_HANDED in mounting.refused


@pytest.mark.parametrize("every", [12, pytest.param(4, marks=pytest.mark.slow)])
@pytest.mark.parametrize("family", EVERY)
def test_swapped_axes_of_both_sensors_are_refused(family: Family, every: int) -> None:
    imu, gnss = simulated(family)
    for mirror in MIRRORS[::every]:
        assert LEFT_HANDED in found((turned(imu, mirror), gnss), family).refused


GYROS = {
    "x reversed": np.diag([-1.0, 1.0, 1.0]),
    "y reversed": np.diag([1.0, -1.0, 1.0]),
    "z reversed": np.diag([1.0, 1.0, -1.0]),
    "all reversed": -np.eye(3),
    "x and z swapped": np.eye(3)[[2, 1, 0]],
    "turned by a third": np.eye(3)[[1, 2, 0]],
}


@pytest.mark.slow
@pytest.mark.parametrize("family", EVERY)
@pytest.mark.parametrize("change", GYROS)
def test_axes_of_gyros_alone_are_refused(family: Family, change: str) -> None:
    """A car whose gyro about forward or right is reversed shows it by its slopes, squat and lean."""
    imu, gnss = simulated(family, duration_s=600.0)
    mounting = found((turned(imu, np.eye(3), GYROS[change]), gnss), family)
    assert mounting.source == "refused"
    assert OTHER_AXES in mounting.refused or LEFT_HANDED in mounting.refused


@pytest.mark.slow
def test_bias_of_an_axis_without_force_is_no_mirror() -> None:
    """To the side of an aeroplane there is nothing but the accelerometer's bias, whose sign may fit better reversed."""
    for seed in (4, 8):
        mounting = found(simulated("uav", seed, 600.0, "consumer"), "uav")
        assert mounting.source == "found" and not mounting.doubt and mounting.evidence.margin > 100.0


def test_signs_of_gravity_are_refused() -> None:
    """A driver that gives +9.8 along the axis that points down at rest has all signs of its accelerometers reversed."""
    imu, gnss = simulated("drive")
    assert "signs of gravity" in found((turned(imu, -np.eye(3), np.eye(3)), gnss), "drive").refused


@pytest.mark.parametrize("family", EVERY)
@pytest.mark.parametrize(
    ("forces", "rates", "reason"),
    [
        (1.0 / G_MPS2, 1.0, "in g, not in m/s2"),
        (G_MPS2, 1.0, "multiplied by g twice"),
        (0.001, 1.0, "gravity has been taken off"),
        (2.0, 1.0, "wrong units, scale or a bias"),
        (1.0, 180.0 / np.pi, "degrees taken for radians"),
        (1.0, np.pi / 180.0, "radians taken for degrees"),
    ],
)
def test_wrong_units_are_refused(family: Family, forces: float, rates: float, reason: str) -> None:
    imu, gnss = simulated(family)
    mounting = found((scaled(imu, forces, rates), gnss), family)
    assert mounting.source == "refused" and reason in mounting.refused


def test_what_is_likelier_unsound_is_a_doubt() -> None:
    """Too little turning about an axis to refuse it is no reason for silence."""
    imu, gnss = simulated("drive", 3)
    mounting = found((turned(imu, np.eye(3), GYROS["y reversed"]), gnss), "drive")
    assert -5.0 < mounting.evidence.margin < -1.5
    assert mounting.source == "found" and mounting.doubt.startswith(f"maybe its {OTHER_AXES}")
    assert not found((imu, gnss), "drive").doubt


@pytest.mark.parametrize("family", EVERY)
def test_unit_of_another_vehicle_is_refused(family: Family) -> None:
    imu, _ = simulated(family, seed=11)
    mounting = found((imu, simulated(family)[1]), family)
    assert mounting.source == "refused" and "another vehicle" in mounting.refused


@pytest.mark.parametrize("later_s", [-40.0, 5.0])
def test_unit_of_another_time_is_refused(later_s: float) -> None:
    imu, gnss = simulated("drive")
    mounting = found((replace(imu, time_s=imu.time_s + later_s), gnss), "drive")
    assert mounting.source == "refused" and "another time" in mounting.refused


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (np.eye(3)[[1, 0, 2]], "north and east are swapped"),
        (np.diag([-1.0, 1.0, 1.0]), "north is reversed"),
        (np.diag([1.0, 1.0, -1.0]), "velocity down is reversed"),
    ],
)
def test_wrong_velocities_are_refused(change: np.ndarray, reason: str) -> None:
    imu, gnss = simulated("uav")
    mounting = found((imu, replace(gnss, velocity_mps=gnss.velocity_mps @ change.T)), "uav")
    assert mounting.source == "refused" and reason in mounting.refused


# Stated and logged


def test_stated_mounting_is_taken() -> None:
    pair = simulated("drive", mounting=SimulatedMounting(axes_deg=(180.0, 0.0, 180.0), small_deg=SMALL_DEG))
    mounting = found(pair, "drive", stated=(180.0, 0.0, 180.0))
    assert mounting.source == "stated" and mounting.words.startswith("stated in the aircraft file: roll 180")
    assert np.allclose(mounting.body_from_case, from_angles((180.0, 0.0, 180.0)))


def test_stated_mounting_against_motion_is_refused() -> None:
    mounting = found(simulated("drive"), "drive", stated=(0.0, 0.0, 90.0))
    assert mounting.source == "refused"
    assert "stated at roll 0, pitch 0, yaw 90 deg, but gravity and" in mounting.refused


def test_stated_mounting_does_not_hide_a_mirrored_axis() -> None:
    pair = simulated("drive", mounting=SimulatedMounting(mirrored="y"))
    assert LEFT_HANDED in found(pair, "drive", stated=(0.0, 0.0, 0.0)).refused
    assert LEFT_HANDED in found(pair, "drive", logged=LoggedMounting(np.eye(3), "body axes")).refused


def test_logged_mounting_is_taken_with_a_doubt_where_motion_shows_another() -> None:
    logged = LoggedMounting(np.eye(3), "the autopilot turns its samples into body axes")
    imu, gnss = simulated("drive")
    good = found((imu, gnss), "drive", logged=logged)
    assert (good.source, good.words, good.doubt) == ("logged", logged.words, "")
    backwards = found((turned(imu, from_angles((0.0, 0.0, 180.0)).T), gnss), "drive", logged=logged)
    assert backwards.source == "logged" and "x back, y left, z down" in backwards.doubt


def test_logged_mounting_of_a_multicopter_is_taken() -> None:
    logged = LoggedMounting(np.eye(3), "body axes")
    assert found(simulated("hover"), "hover", logged=logged).source == "logged"


def flight_with(topic: str, columns: dict[str, dict[str, float] | str]) -> Flight:
    """Flight with a table of parameters."""
    names = next(one for one in columns.values() if not isinstance(one, str))
    made = {}
    for name, one in columns.items():
        told = (
            [one] * len(names) if isinstance(one, str) else list(one) if name.lower() == "name" else list(one.values())
        )
        made[name] = Column(np.array(told))
    time_ns = np.arange(len(names), dtype=np.int64)
    table = Table(topic, time_ns, made, time_ns, Column(time_ns))
    return Flight({topic: table}, {}, 0, False, "made.bin")


def test_board_rotation_is_never_applied_again() -> None:
    """Samples of both autopilots are logged in body axes; only ArduPilot's trim stands between them and the vehicle."""
    px4 = {"SENS_BOARD_ROT": 4.0, "SENS_BOARD_Y_OFF": -2.0}
    mounting = logged_mounting(flight_with("raw.ulog.parameters", {"name": px4, "value": px4, "kind": "value"}))
    assert mounting is not None and np.array_equal(mounting.body_from_case, np.eye(3))
    assert mounting.words.endswith("(SENS_BOARD_ROT 4, fine 0.0, -2.0, 0.0 deg)")
    trim = {"AHRS_ORIENTATION": 8.0, "AHRS_TRIM_X": np.deg2rad(1.0), "AHRS_TRIM_Y": np.deg2rad(-2.0)}
    ardupilot = logged_mounting(flight_with("raw.PARM", {"Name": trim, "Value": trim}))
    assert ardupilot is not None and np.allclose(ardupilot.body_from_case, from_angles((1.0, -2.0, 0.0)))
    assert "AHRS_ORIENTATION 8, trim 1.00, -2.00, 0.00 deg" in ardupilot.words
    assert logged_mounting(Flight({}, {}, 0, False, "a.csv")) is None


def test_trim_of_ardupilot_is_between_samples_and_logged_attitude() -> None:
    """At rest the attitude by the accelerometers, less the trim, is the attitude that the log has."""
    log = groundstation.open(real_log("dataflash/erle_plane_4-12-2014_329.BIN")).flight
    logged = logged_mounting(log)
    assert logged is not None
    (imu, _), time_s = of_flight(log), log.time_s("ins")
    rest = (imu.time_s > 10.0) & (imu.time_s < 60.0)
    body = logged.body_from_case @ np.median(imu.delta_velocity_mps[rest] / imu.interval_s[rest, None], axis=0)
    by_force = np.rad2deg([np.arctan2(-body[1], -body[2]), np.arctan2(body[0], np.hypot(*body[1:]))])
    parked = (time_s > 10.0) & (time_s < 60.0)
    filters = [float(np.nanmedian(log["ins"].values(name)[parked])) for name in ("roll_deg", "pitch_deg")]
    assert by_force == pytest.approx(filters, abs=0.3)  # without the trim 0.7 and 1.1 deg off


def test_aircraft_file_states_three_angles() -> None:
    assert settings_from(AircraftData, {"imu_mounting_deg": [180, 0, 180]}, "a.toml").imu_mounting_deg == (180, 0, 180)
    with pytest.raises(SettingsError, match="found 2 values, expected 3"):
        settings_from(AircraftData, {"imu_mounting_deg": [180, 0]}, "a.toml")
    with pytest.raises(SettingsError, match=r"within \[-360, 360\]"):
        AircraftData(imu_mounting_deg=(0.0, 0.0, 400.0))


def test_limits_are_settings() -> None:
    strict = MountingSettings(spans_min=1000)
    assert "too little motion" in found(simulated("drive"), "drive", settings=strict).words
    with pytest.raises(SettingsError, match="margin_min"):
        MountingSettings(margin_min=0.0)


# Recorded logs


def test_reference_drive() -> None:
    mounting = find_mounting(*reference_drive(), vehicle="rolls")
    assert mounting.source == "found" and np.array_equal(mounting.body_from_case, np.eye(3))
    assert mounting.evidence.margin > 50.0 and mounting.evidence.next_turn_deg > 80.0
    assert min(mounting.evidence.along, mounting.evidence.across, mounting.evidence.turning) > 0.85


def test_drive_with_the_case_upside_down_and_backwards() -> None:
    """Its author's mounting is about roll 180, yaw 180."""
    mounting = find_mounting(*drive_0708(), vehicle="rolls")
    assert mounting.source == "found"
    assert np.allclose(mounting.body_from_case, from_angles((180.0, 0.0, 180.0)), atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("drive", [reference_drive, drive_0708])
def test_recorded_drives_turned_and_spoiled(drive: object) -> None:
    imu, gnss = drive()  # type: ignore[operator]
    as_found = find_mounting(imu, gnss, vehicle="rolls").body_from_case
    for turn in TURNS[::5]:
        mounting = find_mounting(turned(imu, turn), gnss, vehicle="rolls")
        assert np.allclose(mounting.body_from_case, as_found @ turn.T)
    for mirror in MIRRORS[::8]:
        assert LEFT_HANDED in find_mounting(turned(imu, mirror), gnss, vehicle="rolls").refused
    for name, change in GYROS.items():
        assert OTHER_AXES in find_mounting(turned(imu, np.eye(3), change), gnss, vehicle="rolls").refused, name
    assert "degrees" in find_mounting(scaled(imu, 1.0, 57.3), gnss, vehicle="rolls").refused


def test_unit_of_another_recorded_vehicle() -> None:
    imu, _ = reference_drive()
    _, gnss = drive_0708()
    assert "another vehicle" in find_mounting(imu, gnss, vehicle="rolls").refused


@pytest.mark.parametrize(
    ("name", "vehicle", "words"),
    [
        ("dataflash/TestLog2_REENCODED_plane.BIN", "flies", "x forward, y right, z down"),
        ("dataflash/erle_plane_4-12-2014_329.BIN", "flies", "attitude is that of the case: a craft that may move"),
        ("foreign/robot_localization_husky_test1.bag", "rolls", "its y axis points down"),
        ("ulog/px4_rs_6ba1abc7.ulg", "flies", "too little motion"),
        ("ulog/sample_px4_events.ulg", "flies", "too little motion"),
    ],
)
def test_recorded_logs(name: str, vehicle: str, words: str) -> None:
    pair = of_flight(groundstation.open(real_log(name)).flight)
    mounting = find_mounting(*pair, vehicle=vehicle)  # type: ignore[arg-type]
    assert words in mounting.words and not mounting.refused


# Many


@pytest.mark.slow
@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("imu_class", ["mems", "consumer"])
@pytest.mark.parametrize("family", MOVING)
def test_many(family: Family, imu_class: str, seed: int) -> None:
    """Turns are found; mirrored, other and scaled axes are refused, whatever the motion and the errors."""
    imu, gnss = simulated(family, seed, 600.0, imu_class)
    for turn in TURNS[seed % 6 :: 6]:
        mounting = found((turned(imu, turn), gnss), family)
        assert mounting.source == "found" and not mounting.doubt
        assert np.array_equal(mounting.body_from_case, turn.T)
    for mirror in MIRRORS[seed % 8 :: 8]:
        reason = found((turned(imu, mirror), gnss), family).refused  # one to the side of an aeroplane is as the gyros'
        assert LEFT_HANDED in reason or (family == "uav" and OTHER_AXES in reason)
    for name, change in GYROS.items():
        mounting = found((turned(imu, np.eye(3), change), gnss), family)
        is_level = family == "drive" and name in ("x reversed", "y reversed")  # a car hardly turns about these
        assert mounting.source == "refused" or (is_level and (mounting.doubt or mounting.words.endswith(NOT_SHOWN)))
    assert "degrees taken" in found((scaled(imu, 1.0, 57.3), gnss), family).refused
    assert "in g" in found((scaled(imu, 1.0 / G_MPS2), gnss), family).refused
    other, _ = simulated(family, seed + 1000, 600.0, imu_class)
    assert "another vehicle" in found((other, gnss), family).refused

"""Errors of an INS along a true trajectory, by the linear phi-angle model.

The frame is north-east-down; the vertical channel is damped. It is the truth behind the tests of system 2 and holds
what the six-state filter leaves out (Earth and transport rate, azimuth, turns, body-fixed sensors, deflection of the
vertical).

Signs: error = INS - truth. The computed attitude is (I - [phi x]) n_from_b, so that the heading error is -phi_D; the
channels' tilt is -phi_E (north) and +phi_N (east), positive where it makes the velocity error fall.

Source: Titterton and Weston, Strapdown Inertial Navigation Technology, 2nd ed. 2004, section 12.3 (attitude, velocity
and position errors in the local geographic frame); the same in Groves, Principles of GNSS, Inertial, and Multisensor
Integrated Navigation Systems, 2nd ed. 2013, section 14.2.4, with the opposite sign of the attitude error.
"""

from dataclasses import fields

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.compile import compiled
from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import SettingsError
from groundstation.base.geodesy import EARTH_RATE_RADPS, ECCENTRICITY_SQUARED, FLATTENING, SEMI_MAJOR_M
from groundstation.base.gravity import GEODETIC_RATIO, GRAVITY_EQUATOR_MPS2, SOMIGLIANA
from groundstation.base.records import frozen

NORTH, EAST = 0, 1
LONGEST_STEP_S = 1.0

_A, _E2, _F, _GE, _K, _M = (
    SEMI_MAJOR_M,
    ECCENTRICITY_SQUARED,
    FLATTENING,
    GRAVITY_EQUATOR_MPS2,
    SOMIGLIANA,
    GEODETIC_RATIO,
)


@dataclass(frozen=True)
class TrueMotion:
    """True motion of f flights at n common times.

    Parameters
    ----------
    time_s : ndarray, shape (n,)
        Increasing.
    latitude_deg, altitude_m, velocity_north_mps, velocity_east_mps, velocity_down_mps : ndarray, shape (f, n)
    heading_deg, roll_deg : ndarray, shape (f, n)
        Heading of the nose, and roll; pitch is taken as level.
    """

    time_s: FloatArray
    latitude_deg: FloatArray
    altitude_m: FloatArray
    velocity_north_mps: FloatArray
    velocity_east_mps: FloatArray
    velocity_down_mps: FloatArray
    heading_deg: FloatArray
    roll_deg: FloatArray

    def __post_init__(self) -> None:
        for item in fields(self):
            value = np.asarray(getattr(self, item.name), dtype=np.float64)
            object.__setattr__(self, item.name, frozen(value if item.name == "time_s" else np.atleast_2d(value)))


@dataclass(frozen=True)
class SensorErrors:
    """Sources of the errors of f flights: sensors, gravity, initial state.

    Parameters
    ----------
    gyro_radps, gyro_white_radps : ndarray, shape (f, n, 3)
        Error of each gyro (forward, right, down) without and of its white noise, held from each time to the next.
    accelerometer_mps2 : ndarray, shape (f, n, 3)
        The same of the accelerometers, noise included.
    gyro_scale, accelerometer_scale : ndarray, shape (f, 3, 3)
        Scale factor (diagonal) and cross-axis errors: error = scale @ (body rate, specific force less gravity level).
    deflection_mps2 : ndarray, shape (f, n, 2)
        Horizontal gravity that the INS does not know, north and east, with the sign of its effect on the velocity.
    position_m, velocity_mps, tilt_rad : ndarray, shape (f, 2)
        At the start, north and east channel.
    azimuth_rad : ndarray, shape (f,)
        Heading error at the start.
    """

    gyro_radps: FloatArray
    gyro_white_radps: FloatArray
    accelerometer_mps2: FloatArray
    gyro_scale: FloatArray
    accelerometer_scale: FloatArray
    deflection_mps2: FloatArray
    position_m: FloatArray
    velocity_mps: FloatArray
    tilt_rad: FloatArray
    azimuth_rad: FloatArray

    def __post_init__(self) -> None:
        for item in fields(self):
            object.__setattr__(self, item.name, frozen(getattr(self, item.name)))

    @classmethod
    def none(cls, flights: int, epochs: int) -> "SensorErrors":
        """No error at all."""
        return cls(
            gyro_radps=np.zeros((flights, epochs, 3)),
            gyro_white_radps=np.zeros((flights, epochs, 3)),
            accelerometer_mps2=np.zeros((flights, epochs, 3)),
            gyro_scale=np.zeros((flights, 3, 3)),
            accelerometer_scale=np.zeros((flights, 3, 3)),
            deflection_mps2=np.zeros((flights, epochs, 2)),
            position_m=np.zeros((flights, 2)),
            velocity_mps=np.zeros((flights, 2)),
            tilt_rad=np.zeros((flights, 2)),
            azimuth_rad=np.zeros(flights),
        )


@dataclass(frozen=True)
class InsErrors:
    """Errors of an INS, INS minus truth; channels (last axis) north, east.

    Parameters
    ----------
    position_m, velocity_mps, tilt_rad, drift_radps : ndarray, shape (f, n, 2)
        Position in metres on the local tangent: d_lat (M + h), d_lon (N + h) cos(lat). ``drift_radps`` is the whole
        effective drift of the channel, tilt' - velocity / R, but for white noise.
    azimuth_rad : ndarray, shape (f, n)
        Heading error, -phi_D.
    """

    position_m: FloatArray
    velocity_mps: FloatArray
    tilt_rad: FloatArray
    drift_radps: FloatArray
    azimuth_rad: FloatArray

    def __post_init__(self) -> None:
        for item in fields(self):
            object.__setattr__(self, item.name, frozen(getattr(self, item.name)))


def normal_gravity_mps2(latitude_deg: float, altitude_m: float) -> float:
    """Normal gravity of WGS-84, m/s^2.

    Source: NIMA TR8350.2, 3rd ed. 2000, equations 4-1 (Somigliana) and 4-3 (altitude, to the second order).

    Examples
    --------
    >>> round(normal_gravity_mps2(45.0, 0.0), 5), round(normal_gravity_mps2(0.0, 1000.0), 5)
    (9.8062, 9.77724)
    """
    return float(_gravity(np.sin(np.deg2rad(latitude_deg)) ** 2, altitude_m))


def propagate(
    motion: TrueMotion, sensors: SensorErrors, *, earth_rate: bool = True, body_fixed: bool = True
) -> InsErrors:
    """Propagate INS errors along true trajectories.

    Between two times the inputs are held at their means, the specific force being the exact mean of the step
    (change of velocity / step), and the linear equations are solved with the classical Runge-Kutta rule at steps of
    1 s or less, whose error is (0.00124)^5 a step in the Schuler oscillation.

    Parameters
    ----------
    motion : TrueMotion
    sensors : SensorErrors
    earth_rate : bool
        False: a world that does not turn.
    body_fixed : bool
        False: sensors on a platform slaved to north, axes north, east, down; it feels no turn.

    Returns
    -------
    InsErrors

    Raises
    ------
    SettingsError
        When the motion has fewer than two times.

    It ignores vertical errors, pitch, the share of Earth and transport rate in scale factor errors, the change of the
    radii of curvature with the position error.
    """
    shape = motion.latitude_deg.shape
    if shape[1] < 2:
        raise SettingsError("true motion", f"{shape[1]} times", "two or more")
    state = np.zeros((*shape, 7))
    drift = np.zeros((*shape, 2))
    latitude_rad = np.deg2rad(motion.latitude_deg)
    meridian, parallel = _tangent_radii_m(latitude_rad, motion.altitude_m)
    state[:, 0, 0] = sensors.position_m[:, NORTH] / meridian[:, 0]
    state[:, 0, 1] = sensors.position_m[:, EAST] / parallel[:, 0]
    state[:, 0, 2:4] = sensors.velocity_mps
    state[:, 0, 4], state[:, 0, 5] = sensors.tilt_rad[:, EAST], -sensors.tilt_rad[:, NORTH]
    state[:, 0, 6] = -sensors.azimuth_rad
    velocity = motion.velocity_north_mps, motion.velocity_east_mps, motion.velocity_down_mps
    # read-only whatever they were: the loop is compiled for each kind of array
    time_s, altitude_m, north_mps, east_mps, down_mps = (
        frozen(np.ascontiguousarray(part)) for part in (motion.time_s, motion.altitude_m, *velocity)
    )
    _propagate(
        time_s,
        latitude_rad,
        altitude_m,
        north_mps,
        east_mps,
        down_mps,
        np.deg2rad(motion.heading_deg),
        np.deg2rad(motion.roll_deg),
        sensors.gyro_radps,
        sensors.gyro_white_radps,
        sensors.accelerometer_mps2,
        sensors.gyro_scale,
        sensors.accelerometer_scale,
        sensors.deflection_mps2,
        EARTH_RATE_RADPS if earth_rate else 0.0,
        body_fixed,
        state,
        drift,
    )
    return InsErrors(
        position_m=np.stack([state[..., 0] * meridian, state[..., 1] * parallel], axis=-1),
        velocity_mps=state[..., 2:4].copy(),
        tilt_rad=np.stack([-state[..., 5], state[..., 4]], axis=-1),
        drift_radps=drift,
        azimuth_rad=-state[..., 6],
    )


def _tangent_radii_m(latitude_rad: FloatArray, altitude_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Metres per radian of latitude and of longitude."""
    denominator = 1.0 - _E2 * np.sin(latitude_rad) ** 2
    prime_vertical = _A / np.sqrt(denominator)
    meridian = prime_vertical * (1.0 - _E2) / denominator
    return meridian + altitude_m, (prime_vertical + altitude_m) * np.cos(latitude_rad)


@compiled
def _gravity(sine_squared, altitude_m):  # type: ignore[no-untyped-def]
    surface = _GE * (1.0 + _K * sine_squared) / np.sqrt(1.0 - _E2 * sine_squared)
    ratio = altitude_m / _A
    return surface * (1.0 - 2.0 * (1.0 + _F + _M - 2.0 * _F * sine_squared) * ratio + 3.0 * ratio * ratio)


@compiled
def _rates(x, c, out):  # type: ignore[no-untyped-def]
    """Fill the derivative of [d_lat, d_lon, v_N, v_E, phi_N, phi_E, phi_D].

    c holds what is constant in a step.
    """
    sine, cosine, tangent, meridian, normal = c[0], c[1], c[2], c[3], c[4]
    north, east, down = c[5], c[6], c[7]
    f_n, f_e, f_d = c[8], c[9], c[10]
    earth = c[11]
    w_n, w_e, w_d = c[12], c[13], c[14]
    # errors of Earth and transport rate
    ie_n, ie_d = -earth * sine * x[0], -earth * cosine * x[0]
    en_n, en_e = x[3] / normal, -x[2] / meridian
    en_d = -x[3] * tangent / normal - east / (normal * cosine * cosine) * x[0]
    both_n, both_e, both_d = 2.0 * ie_n + en_n, en_e, 2.0 * ie_d + en_d
    coriolis_d = w_d - earth * sine  # down part of 2 Earth rate + transport rate
    out[0] = x[2] / meridian
    out[1] = (x[3] + east * tangent * x[0]) / (normal * cosine)
    out[2] = f_e * x[6] - f_d * x[5] + coriolis_d * x[3] - (both_e * down - both_d * east) + c[15]
    out[3] = f_d * x[4] - f_n * x[6] - coriolis_d * x[2] - (both_d * north - both_n * down) + c[16]
    out[4] = -(w_e * x[6] - w_d * x[5]) + ie_n + en_n - c[17]
    out[5] = -(w_d * x[4] - w_n * x[6]) + en_e - c[18]
    out[6] = -(w_n * x[5] - w_e * x[4]) + ie_d + en_d - c[19]


@compiled
def _runge_kutta(x, c, step_s, k1, k2, k3, k4, y):  # type: ignore[no-untyped-def]
    _rates(x, c, k1)
    for i in range(7):
        y[i] = x[i] + 0.5 * step_s * k1[i]
    _rates(y, c, k2)
    for i in range(7):
        y[i] = x[i] + 0.5 * step_s * k2[i]
    _rates(y, c, k3)
    for i in range(7):
        y[i] = x[i] + step_s * k3[i]
    _rates(y, c, k4)
    for i in range(7):
        x[i] += step_s / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i])


@compiled
def _propagate(  # type: ignore[no-untyped-def]
    time_s,
    latitude_rad,
    altitude_m,
    north_mps,
    east_mps,
    down_mps,
    heading_rad,
    roll_rad,
    gyro,
    gyro_white,
    accelerometer,
    gyro_scale,
    accelerometer_scale,
    deflection,
    earth,
    body_fixed,
    state,
    drift,
):
    flights, epochs = latitude_rad.shape
    c, x, white = np.zeros(20), np.zeros(7), np.zeros(3)
    k1, k2, k3, k4, y = np.zeros(7), np.zeros(7), np.zeros(7), np.zeros(7), np.zeros(7)
    rate, force = np.zeros(3), np.zeros(3)
    for flight in range(flights):
        for k in range(epochs):
            start, end = k, k + 1
            if k == epochs - 1:  # the last drift: inputs of the last step
                start, end = k - 1, k
            dt = time_s[end] - time_s[start]
            latitude = 0.5 * (latitude_rad[flight, start] + latitude_rad[flight, end])
            altitude = 0.5 * (altitude_m[flight, start] + altitude_m[flight, end])
            north = 0.5 * (north_mps[flight, start] + north_mps[flight, end])
            east = 0.5 * (east_mps[flight, start] + east_mps[flight, end])
            down = 0.5 * (down_mps[flight, start] + down_mps[flight, end])
            sine, cosine = np.sin(latitude), np.cos(latitude)
            tangent = sine / cosine
            denominator = 1.0 - _E2 * sine * sine
            normal = _A / np.sqrt(denominator)
            meridian = normal * (1.0 - _E2) / denominator + altitude
            normal += altitude
            gravity = _gravity(sine * sine, altitude)
            transport_n, transport_e, transport_d = east / normal, -north / meridian, -east * tangent / normal
            cor_n, cor_e, cor_d = 2.0 * earth * cosine + transport_n, transport_e, transport_d - 2.0 * earth * sine
            f_n = (north_mps[flight, end] - north_mps[flight, start]) / dt + cor_e * down - cor_d * east
            f_e = (east_mps[flight, end] - east_mps[flight, start]) / dt + cor_d * north - cor_n * down
            f_d = (down_mps[flight, end] - down_mps[flight, start]) / dt + cor_n * east - cor_e * north - gravity
            # axes of the sensors: forward (cos h, sin h, 0), right and down turned by the bank
            turn, sin_h, cos_h, sin_r, cos_r = 0.0, 0.0, 1.0, 0.0, 1.0
            rate[0] = 0.0
            if body_fixed:
                turn = heading_rad[flight, end] - heading_rad[flight, start]
                turn -= 2.0 * np.pi * np.rint(turn / (2.0 * np.pi))
                heading = heading_rad[flight, start] + 0.5 * turn
                roll = 0.5 * (roll_rad[flight, start] + roll_rad[flight, end])
                sin_h, cos_h, sin_r, cos_r = np.sin(heading), np.cos(heading), np.sin(roll), np.cos(roll)
                rate[0] = (roll_rad[flight, end] - roll_rad[flight, start]) / dt
                turn /= dt
            rate[1], rate[2] = turn * sin_r, turn * cos_r
            right = -f_n * sin_h + f_e * cos_h
            force[0] = f_n * cos_h + f_e * sin_h
            force[1] = right * cos_r + f_d * sin_r
            force[2] = -right * sin_r + f_d * cos_r + gravity  # the part of gravity in level flight counts as bias
            for i in range(3):
                y[i], y[i + 3] = gyro[flight, start, i], accelerometer[flight, start, i]
                for j in range(3):
                    y[i] += gyro_scale[flight, i, j] * rate[j]
                    y[i + 3] += accelerometer_scale[flight, i, j] * force[j]
            level = y[4] * cos_r - y[5] * sin_r
            c[15] = y[3] * cos_h - level * sin_h + deflection[flight, start, 0]
            c[16] = y[3] * sin_h + level * cos_h + deflection[flight, start, 1]
            level = y[1] * cos_r - y[2] * sin_r
            gyro_n, gyro_e = y[0] * cos_h - level * sin_h, y[0] * sin_h + level * cos_h
            gyro_d = y[1] * sin_r + y[2] * cos_r
            for i in range(3):
                white[i] = gyro_white[flight, start, i]
            level = white[1] * cos_r - white[2] * sin_r
            c[17] = gyro_n + white[0] * cos_h - level * sin_h
            c[18] = gyro_e + white[0] * sin_h + level * cos_h
            c[19] = gyro_d + white[1] * sin_r + white[2] * cos_r
            c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7] = (
                sine, cosine, tangent, meridian, normal, north, east, down
            )  # fmt: skip
            c[8], c[9], c[10], c[11] = f_n, f_e, f_d, earth
            c[12], c[13], c[14] = transport_n + earth * cosine, transport_e, transport_d - earth * sine
            for i in range(7):
                x[i] = state[flight, k, i]
            drift[flight, k, 0] = c[14] * x[4] - c[12] * x[6] + gyro_e
            drift[flight, k, 1] = c[14] * x[5] - c[13] * x[6] - earth * sine * x[0] - gyro_n
            if k == epochs - 1:
                break
            parts = int(np.ceil(dt / LONGEST_STEP_S - 1e-9))
            for _ in range(parts):
                _runge_kutta(x, c, dt / parts, k1, k2, k3, k4, y)
            for i in range(7):
                state[flight, k + 1, i] = x[i]

"""Start of a pass: level, and a heading hypothesis."""

import numpy as np

from groundstation.systems.trajectory.fix_motion import motion_of
from groundstation.systems.trajectory.inputs import GnssFixes
from groundstation.systems.trajectory.layout import Samples
from groundstation.systems.trajectory.model import DEG, StartSigmas
from groundstation.systems.trajectory.passes import Start
from groundstation.systems.trajectory.states import ATT, POS, STATES, VEL, FloatArray, Noise

HYPOTHESES = 12
LEVEL_S = 1.0
GRAVITY_MPS2 = 9.81


def quaternion_of(C: FloatArray) -> FloatArray:
    """Return the quaternion (wxyz) of a rotation matrix n from b."""
    w = np.sqrt(max(0.0, 1.0 + C[0, 0] + C[1, 1] + C[2, 2])) / 2.0
    x = np.sqrt(max(0.0, 1.0 + C[0, 0] - C[1, 1] - C[2, 2])) / 2.0
    y = np.sqrt(max(0.0, 1.0 - C[0, 0] + C[1, 1] - C[2, 2])) / 2.0
    z = np.sqrt(max(0.0, 1.0 - C[0, 0] - C[1, 1] + C[2, 2])) / 2.0
    largest = int(np.argmax([w, x, y, z]))
    if largest == 0:
        q = np.array([w, (C[2, 1] - C[1, 2]) / 4 / w, (C[0, 2] - C[2, 0]) / 4 / w, (C[1, 0] - C[0, 1]) / 4 / w])
    elif largest == 1:
        q = np.array([(C[2, 1] - C[1, 2]) / 4 / x, x, (C[0, 1] + C[1, 0]) / 4 / x, (C[0, 2] + C[2, 0]) / 4 / x])
    elif largest == 2:
        q = np.array([(C[0, 2] - C[2, 0]) / 4 / y, (C[0, 1] + C[1, 0]) / 4 / y, y, (C[1, 2] + C[2, 1]) / 4 / y])
    else:
        q = np.array([(C[1, 0] - C[0, 1]) / 4 / z, (C[0, 2] + C[2, 0]) / 4 / z, (C[1, 2] + C[2, 1]) / 4 / z, z])
    return np.asarray(q / np.linalg.norm(q))


def level(force: FloatArray, heading_rad: float, acceleration: FloatArray) -> FloatArray:
    """Return C, n from b, that turns the mean specific force into n at a heading.

    Parameters
    ----------
    force : ndarray, shape (3,)
        Mean specific force along the axes of the unit.
    heading_rad : float
        Of the x axis; where it points up or down, of the y axis less 90 deg.
    acceleration : ndarray, shape (3,)
        Of the unit in n.
    """
    wanted = acceleration - np.array([0.0, 0.0, GRAVITY_MPS2])
    down_b = -force / np.linalg.norm(force)
    forward = np.array([1.0, 0.0, 0.0]) if abs(down_b[0]) < 0.9 else np.array([0.0, 0.0, -np.sign(down_b[0])])
    forward = forward - down_b * (forward @ down_b)
    forward /= np.linalg.norm(forward)
    level_from_b = np.stack([forward, np.cross(down_b, forward), down_b])
    c, s = np.cos(heading_rad), np.sin(heading_rad)
    C = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ level_from_b
    have, want = C @ force, wanted / np.linalg.norm(wanted)
    have = have / np.linalg.norm(have)
    axis = np.cross(have, want)
    skew = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    turn = np.eye(3) + skew + skew @ skew / (1.0 + have @ want)
    return np.asarray(turn @ C)


def starts_at(
    samples: Samples,
    gnss: GnssFixes,
    begin_s: float,
    noise: Noise,
    sigmas: StartSigmas,
    variances: FloatArray,
    *,
    is_still: bool,
    latency_s: float = 0.0,
    count: int = HYPOTHESES,
) -> list[Start]:
    """Return a start for each heading hypothesis at ``begin_s``."""
    motion = motion_of(gnss)
    have = np.isfinite(gnss.latitude_deg) & np.isfinite(motion[:, :2]).all(axis=1)
    fixes = np.flatnonzero(have)
    valid_s = gnss.time_s - latency_s
    at = int(fixes[np.argmin(np.abs(valid_s[fixes] - begin_s))])
    velocity = motion[at]
    near = samples.time_s - begin_s
    window = np.flatnonzero((near > 0.0) & (near <= LEVEL_S))
    if not len(window):
        window = np.flatnonzero(near > 0.0)[:1]
    force = samples.imu.velocity[window].sum(axis=0) / samples.imu.interval_s[window].sum()
    acceleration = np.zeros(3)
    if not is_still:
        apart_s = float(np.median(np.diff(valid_s[fixes]))) if len(fixes) > 1 else 0.0
        beside = fixes[np.abs(valid_s[fixes] - begin_s) <= max(2.5, 1.5 * apart_s)]
        t = valid_s[beside] - begin_s
        if len(np.unique(t)) >= 2:
            acceleration = np.polyfit(t, motion[beside], 1)[0]
    p = np.diag(variances)
    sigma_m = np.nan_to_num(gnss.position_sigma_m[at], nan=10.0)
    sigma_mps = np.nan_to_num(gnss.velocity_sigma_mps[at], nan=0.5)
    p[range(POS, VEL), range(POS, VEL)] = (3.0 * sigma_m) ** 2 + sigmas.lever_m**2 + 1.0
    p[range(VEL, ATT), range(VEL, ATT)] = (0.1 if is_still else 1.0) ** 2 + (2.0 * sigma_mps) ** 2
    tilt = (3.0 if is_still else 8.0) * DEG
    p[ATT, ATT] = p[ATT + 1, ATT + 1] = tilt**2
    p[ATT + 2, ATT + 2] = (360.0 / count / 2.0 * 1.2 * DEG) ** 2
    found = []
    for heading in np.arange(count) * 2.0 * np.pi / count:
        nav = np.empty(10)
        nav[:3] = np.radians(gnss.latitude_deg[at]), np.radians(gnss.longitude_deg[at]), gnss.height_m[at]
        nav[3:6] = 0.0 if is_still else velocity
        nav[6:] = quaternion_of(level(force, heading, acceleration))
        found.append(Start(nav, np.zeros(STATES), p.copy(), np.zeros(STATES)))
    return found

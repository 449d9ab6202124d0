"""Writes RTKLIB solutions and SBET trajectories for tests."""

import numpy as np

from groundstation.readers.sbet import RECORD

LATITUDE, LONGITUDE, HEIGHT = 51.5, -0.7, 147.0
SIGMAS = "0.0300 0.0400 0.0800 0.0000 0.0000 0.0000"
VELOCITY = "1.50000 -2.50000 0.25000 0.03000 0.04000 0.05000 0.0 0.0 0.0"
GEODETIC = "latitude(deg) longitude(deg) height(m)"
MINUTES = "latitude(d'\") longitude(d'\") height(m)"
ECEF, ECEF_VELOCITY = "x-ecef(m) y-ecef(m) z-ecef(m)", " vx(m/s) vy(m/s) vz(m/s)"
BASELINE = "e-baseline(m) n-baseline(m) u-baseline(m)"
PLACE = f"{LATITUDE:.9f}  {LONGITUDE:.9f}  {HEIGHT:.4f}"
_NAMES = " Q ns sdn(m) sde(m) sdu(m) sdne(m) sdeu(m) sdun(m) age(s) ratio"
_VELOCITY_NAMES = " vn(m/s) ve(m/s) vu(m/s) sdvn sdve sdvu sdvne sdveu sdvun"


def pos(form: str, cells: str, scale: str = "GPST", time: str = "2025/08/28 17:30:39.749", top: str = "") -> bytes:
    """Three equal rows of a solution."""
    rows = [f"{time}   {cells}   1  21 {SIGMAS}   0.00  999.9  {VELOCITY}"] * 3
    names = f"%  {scale}  {form}{_NAMES}{_VELOCITY_NAMES}"
    return "\n".join([f"% program   : RTKLIB ver.2.4.3{top}", names, *rows, ""]).encode()


def pos_rows(rows: list[str]) -> bytes:
    """A geodetic solution in GPS time of rows that are written already: time, place and velocity."""
    top = "% (lat/lon/height=WGS84/ellipsoidal,Q=1:fix,2:float,3:sbas,4:dgps,5:single,6:ppp,ns=# of satellites)"
    return "\n".join([top, f"%  GPST  {GEODETIC}{_NAMES}{_VELOCITY_NAMES}", *rows, ""]).encode()


def sbet(wander_rad: float = 0.4, wander_sign: int = -1, count: int = 60, gravity: bool = True) -> np.ndarray:
    """An aircraft that flies at 50 m/s on track 60 deg; heading 65 deg true; 200 records a second."""
    records = np.zeros(count, RECORD)
    records["time"] = 408_621.0 + np.arange(count) / 200.0
    north, east = 50.0 * np.cos(np.deg2rad(60.0)), 50.0 * np.sin(np.deg2rad(60.0))
    from_start = np.arange(count) / 200.0
    records["latitude"] = np.deg2rad(LATITUDE) + north * from_start / 6_374_000.0
    records["longitude"] = np.deg2rad(LONGITUDE) + east * from_start / (6_391_500.0 * np.cos(np.deg2rad(LATITUDE)))
    records["altitude"], records["wander_angle"] = HEIGHT, wander_rad
    azimuth = wander_sign * wander_rad  # of the platform's x axis
    records["x_velocity"] = north * np.cos(azimuth) + east * np.sin(azimuth)
    records["y_velocity"] = -north * np.sin(azimuth) + east * np.cos(azimuth)
    records["z_velocity"] = -1.0
    records["roll"], records["pitch"] = np.deg2rad(2.0), np.deg2rad(-3.0)
    records["platform_heading"] = np.deg2rad(65.0) - azimuth
    records["z_acceleration"] = -9.81 if gravity else 0.02
    records["y_rate"] = np.deg2rad(0.5)
    return records

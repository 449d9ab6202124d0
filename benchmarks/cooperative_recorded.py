"""Cooperative filters on recorded robots: UTIAS multi-robot data, every algorithm in one table.

    python benchmarks/cooperative_recorded.py FOLDER [--blind] [--calibrate 300] ...

FOLDER holds Robot*_Odometry, Robot*_Measurement, Robot*_Groundtruth, Barcodes and Landmark_Groundtruth, all .dat.gz.
Source of the data: Leung, Halpern, Liu and Barfoot, The UTIAS multi-robot cooperative localization and mapping dataset,
International Journal of Robotics Research 30(8), 2011.

Protocol: every robot starts at its true pose (sigma 0.05 m, 2 deg) at the first time at which all have odometry and
truth; from there to the end truth only judges. Odometry is averaged over 0.2 s. Errors are horizontal, of all robots
together (team), at every second; NEES of the position, 2 is honest. ``--blind`` takes the landmarks from robots 3 to 5.
x and y of the data are taken for north and east, angles for clockwise ones: a mirror image, nothing else changes.

``--calibrate S`` learns the camera from the first S seconds with truth and judges the rest alone: the "range" of the
data is the distance along the optical axis (dividing by the cosine of the bearing takes the spread of its error from
0.16 to 0.06 m), with an offset, a scale, and another offset of robots' markers; sigma grows with the distance. What
the robots differ in (range bias, scales of odometry) stays for the filters to estimate.
"""

import argparse
import gzip
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from groundstation.estimators.cooperative.arrays import PEER, USED
from groundstation.estimators.cooperative.consistency import judge
from groundstation.estimators.cooperative.estimate import run_algorithm
from groundstation.estimators.cooperative.events import prepare
from groundstation.estimators.cooperative.settings import ALGORITHMS, CooperativeSettings, OdometryBelief
from groundstation.tables.session import NO_SLOT, GroundPoint, Odometry, Ranges, Session

BIN_S = 0.2
ROBOTS = (1, 2, 3, 4, 5)
BLIND = ("R3", "R4", "R5")
BEFORE = {  # untuned filters measured on set 6 before this work: full map, robots 3 to 5 blind
    "dead_reckoning": (float("nan"), float("nan")),
    "centralised": (0.188, 0.219),
    "neighbour_exact": (0.301, 0.40),
    "ranked": (0.342, 0.39),  # robots of equal rank do not use each other: own landmarks alone on the full map
    "split_intersection": (0.334, 0.34),
}


@dataclass(frozen=True)
class Recorded:
    """A session and the true tracks of its robots: name to (time_s, position_m, heading_rad)."""

    session: Session
    truth: dict[str, tuple[np.ndarray, np.ndarray, np.ndarray]]


def load_utias(folder: Path, *, blind: bool, lag_s: float, range_sigma_m: float, bearing_sigma_deg: float) -> Recorded:
    """Read one set; ``lag_s`` is how much later than it was taken a camera measurement is stamped."""

    def table(name: str) -> np.ndarray:
        with gzip.open(folder / f"{name}.dat.gz", "rt") as lines:
            return np.loadtxt(lines, ndmin=2)

    subjects = {int(barcode): int(subject) for subject, barcode in table("Barcodes")}
    truth_raw = {robot: table(f"Robot{robot}_Groundtruth") for robot in ROBOTS}
    odometry = {robot: table(f"Robot{robot}_Odometry") for robot in ROBOTS}
    zero = max(max(truth_raw[robot][0, 0], odometry[robot][0, 0]) for robot in ROBOTS)
    vehicles, truth, rows = [], {}, []
    for robot in ROBOTS:
        name, raw = f"R{robot}", truth_raw[robot]
        place = np.column_stack([raw[:, 1], raw[:, 2], np.zeros(len(raw))])
        heading = np.unwrap(raw[:, 3])
        truth[name] = (raw[:, 0] - zero, place, heading)
        time_s, speed, turn = _binned(odometry[robot], zero)
        start = [float(np.interp(0.0, raw[:, 0] - zero, column)) for column in (raw[:, 1], raw[:, 2], heading)]
        vehicles.append(Odometry(name, time_s, speed, np.rad2deg(turn), (start[0], start[1]), np.rad2deg(start[2])))
        for stamp, barcode, distance, bearing in table(f"Robot{robot}_Measurement"):
            subject = subjects.get(int(barcode), 0)
            if subject == robot or subject == 0 or (blind and name in BLIND and subject > len(ROBOTS)):
                continue
            rows.append((stamp - zero - lag_s, robot, subject, distance, bearing))
    rows.sort()
    at, who, what, distance, bearing = (np.array(column) for column in zip(*rows, strict=True))
    n = len(at)
    ranges = Ranges(
        at,
        np.array([f"R{robot}" for robot in who]),
        np.array([f"R{subject}" if subject <= len(ROBOTS) else f"L{subject}" for subject in what]),
        distance,
        np.full(n, range_sigma_m),
        np.full(n, NO_SLOT),
        np.rad2deg(bearing),
        np.full(n, bearing_sigma_deg),
        is_two_way=True,
    )
    points = tuple(GroundPoint(f"L{int(row[0])}", (row[1], row[2], 0.0)) for row in table("Landmark_Groundtruth"))
    ranks = {f"R{robot}": (2 if blind and f"R{robot}" in BLIND else 1) for robot in ROBOTS}
    return Recorded(Session("local", tuple(vehicles), points, ranges, ranks=ranks), truth)


@dataclass(frozen=True)
class Camera:
    """Range / cos(bearing) = true (1 + scale) + offset (+ peer_offset); sigma of both measurements."""

    offset_m: float
    scale: float
    peer_offset_m: float
    sigma_m: float
    sigma_share: float


def calibrate(recorded: Recorded, until_s: float) -> Camera:
    """Fit the camera to truth of the first seconds: least squares without residuals beyond four MAD sigmas."""
    table, true, is_peer = recorded.session.ranges, [], []
    points = {point.name: point.position_m for point in recorded.session.points}
    for time_s, receiver, source in zip(table.time_s, table.receiver, table.source, strict=True):
        ends = []
        for name in (str(receiver), str(source)):
            if name in points:
                ends.append(points[name][:2])
            else:
                at, position, _ = recorded.truth[name]
                ends.append([np.interp(time_s, at, position[:, axis]) for axis in (0, 1)])
        true.append(np.hypot(ends[1][0] - ends[0][0], ends[1][1] - ends[0][1]))
        is_peer.append(str(source) not in points)
    distance, peer = np.array(true), np.array(is_peer, dtype=np.float64)
    assert table.bearing_deg is not None
    error = table.pseudorange_m / np.cos(np.deg2rad(table.bearing_deg)) - distance
    H = np.column_stack([np.ones(len(distance)), distance, peer])
    kept = (table.time_s > 0.0) & (table.time_s < until_s)
    for _ in range(5):
        fit = np.linalg.lstsq(H[kept], error[kept], rcond=None)[0]
        left = error - H @ fit
        spread = 1.4826 * np.median(np.abs(left[kept]))
        kept = (table.time_s > 0.0) & (table.time_s < until_s) & (np.abs(left) < 4.0 * spread)
    near, far = (kept & (distance < 2.0)), (kept & (distance > 4.0))
    near_m, far_m = float(left[near].std()), float(left[far].std())
    share = (far_m - near_m) / float(distance[far].mean() - distance[near].mean())
    return Camera(*(float(value) for value in fit), near_m - share * float(distance[near].mean()), share)


def corrected(recorded: Recorded, camera: Camera, inflation: float) -> Recorded:
    """Ranges as the calibrated camera would have given them."""
    session, table = recorded.session, recorded.session.ranges
    assert table.bearing_deg is not None
    peer = np.array([str(source).startswith("R") for source in table.source], dtype=np.float64)
    slant = table.pseudorange_m / np.cos(np.deg2rad(table.bearing_deg))
    slant = (slant - camera.offset_m - camera.peer_offset_m * peer) / (1.0 + camera.scale)
    sigma = inflation * np.maximum(camera.sigma_m + camera.sigma_share * slant, 0.02)
    ranges = replace(table, pseudorange_m=slant, sigma_m=sigma)
    return Recorded(replace(session, ranges=ranges), recorded.truth)


def _binned(odometry: np.ndarray, zero: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mean speed and turn rate over bins: readings are held until the next."""
    time_s = odometry[:, 0] - zero
    edges = np.arange(0.0, time_s[-1], BIN_S)
    columns = []
    for column in (odometry[:, 1], odometry[:, 2]):
        whole = np.concatenate([[0.0], np.cumsum(column[:-1] * np.diff(time_s))])
        columns.append(np.diff(np.interp(edges, time_s, whole)) / BIN_S)
    return edges[:-1], columns[0], columns[1]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--blind", action="store_true", help="robots 3 to 5 see no landmarks")
    parser.add_argument("--algorithms", default=",".join(ALGORITHMS))
    parser.add_argument("--lag", type=float, default=0.0, help="camera lag, seconds")
    parser.add_argument("--range-sigma", type=float, default=0.15)
    parser.add_argument("--bearing-sigma", type=float, default=3.0)
    parser.add_argument("--bias", type=float, default=0.0, help="sigma of a range bias of each robot, metres")
    parser.add_argument("--speed-scale", type=float, default=0.0)
    parser.add_argument("--turn-scale", type=float, default=0.0)
    parser.add_argument("--along", type=float, default=0.03, help="noise of the way, m per sqrt(s)")
    parser.add_argument("--turn", type=float, default=4.0, help="noise of the heading, deg per sqrt(s)")
    parser.add_argument("--gate", type=float, default=4.0)
    parser.add_argument("--calibrate", type=float, default=0.0, help="learn the camera from so many seconds")
    parser.add_argument("--judge-from", type=float, default=None, help="seconds; as --calibrate unless given")
    parser.add_argument("--bias-time", type=float, default=1e6, help="correlation time of the range bias, seconds")
    parser.add_argument("--inflation", type=float, default=1.0, help="of the calibrated sigma of ranges")
    parser.add_argument("--until", type=float, default=1e9, help="stop after so many seconds")
    given = parser.parse_args()
    given.judge_from = given.calibrate if given.judge_from is None else given.judge_from
    recorded = load_utias(
        given.folder,
        blind=given.blind,
        lag_s=given.lag,
        range_sigma_m=given.range_sigma,
        bearing_sigma_deg=given.bearing_sigma,
    )
    if given.calibrate > 0.0:
        seen = load_utias(given.folder, blind=False, lag_s=given.lag, range_sigma_m=1.0, bearing_sigma_deg=1.0)
        camera = calibrate(seen, given.calibrate)  # of all cameras on all they saw, blind robots included
        print(camera)
        recorded = corrected(recorded, camera, given.inflation)
    belief = OdometryBelief(
        along_m_per_sqrt_s=given.along,
        turn_deg_per_sqrt_s=given.turn,
        speed_scale=given.speed_scale,
        turn_scale=given.turn_scale,
    )
    settings = CooperativeSettings(
        odometry=belief,
        range_bias_m=given.bias,
        range_bias_s=given.bias_time,
        gate_sigma=given.gate,
        latency_slots=0,
        map_window_s=1e6,
    )
    print("| algorithm | RMSE m | before | NEES | gated | range residual m |")
    print("|---|---|---|---|---|---|")
    for name in given.algorithms.split(","):
        print(_row(recorded, settings, name, given), flush=True)


def _row(recorded: Recorded, settings: CooperativeSettings, name: str, given: argparse.Namespace) -> str:
    session = recorded.session
    kept = session.ranges.take(session.ranges.time_s <= given.until)
    prepared = prepare(Session(session.frame, session.vehicles, session.points, kept, ranks=session.ranks), settings)
    run = run_algorithm(prepared, settings, name)
    squares, nees = [], []
    for track, vehicle in zip(run.tracks, session.vehicles, strict=True):
        time_s, position, _ = recorded.truth[track.name]
        judgement = judge(track, vehicle, time_s, position)
        judged = (track.time_s <= given.until) & (track.time_s >= given.judge_from)
        squares.append((judgement.error_m[judged] ** 2).sum(axis=1))
        nees.append(judgement.nees[judged])
    square, ratio = np.concatenate(squares), np.concatenate(nees)
    gated = run.counts.get("gated", 0)
    used = (run.judged.mark == USED) & (prepared.events.kind[run.judged.event] == PEER)
    peers = run.judged.innovation[used] if used.any() else np.array([np.nan])
    before = BEFORE.get(name, (float("nan"), float("nan")))[int(given.blind)]
    return (
        f"| {name} | {np.sqrt(np.nanmean(square)):.3f} | {before:.3f} | {np.nanmean(ratio):.2f} | "
        f"{gated / max(gated + run.counts.get('used', 0), 1):.1%} | {np.mean(peers):+.3f} |"
    )


if __name__ == "__main__":
    main()

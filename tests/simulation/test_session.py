"""Simulated sessions of several aircraft: motion, errors, slots, satellites, scenarios."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import expm

from groundstation.base.ecef import ecef_from_n, ecef_m, geodetic_deg_m
from groundstation.base.errors import SettingsError
from groundstation.base.timescales import iso_to_utc_ns
from groundstation.simulation.satellites import (
    LIGHT_MPS,
    elevation_deg,
    emission_ecef_m,
    orbits,
    satellite_ecef_m,
)
from groundstation.simulation.session import simulate_session
from groundstation.simulation.session_errors import integrated_gauss_markov
from groundstation.simulation.session_motion import fly
from groundstation.simulation.session_scenario import load_session, session_names
from groundstation.tables.session import DeadReckoning
from tests.systems.cooperative.example import GLOBAL, LOCAL

START_NS, _ = iso_to_utc_ns("2018-03-05T12:00:00Z")


def test_every_shipped_session_loads_and_flies() -> None:
    assert len(session_names()) >= 20
    for name in session_names():
        scenario = replace(load_session(name), duration_s=5.0)
        simulated = simulate_session(scenario, 1)
        assert len(simulated.session.vehicles) == len(scenario.aircraft) and scenario.title


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('title = "x"\nframe = "flat"\naircraft = []', "key frame: found 'flat'"),
        ('title = "x"\nframe = "local"\naircraft = []', "0 aircraft"),
        (
            'title = "x"\nframe = "local"\naircraft = [{ name = "A", north_m = 0 }]',
            r"aircraft\[0\].east_m: found nothing",
        ),
        (
            'title = "x"\nframe = "ecef"\n'
            'aircraft = [{ name = "A", north_m = 0, east_m = 0, satellites = ["GPS-99"] }]',
            "GPS-99",
        ),
        (
            'title = "x"\nframe = "local"\n'
            'aircraft = [{ name = "A", north_m = 0, east_m = 0, satellites = ["GPS-13"] }]',
            "satellites in a local frame",
        ),
        (
            'title = "x"\nframe = "local"\naircraft = [{ name = "A", north_m = 0, east_m = 0, wings = 2 }]',
            "a key that nothing reads",
        ),
        (
            'title = "x"\nframe = "local"\nlink = { frame_s = 0.15 }\n'
            'aircraft = [{ name = "A", north_m = 0, east_m = 0 }, { name = "B", north_m = 0, east_m = 9 }]',
            "room for 2 slots",
        ),
    ],
)
def test_a_wrong_scenario_says_where(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "wrong.toml"
    path.write_text(text)
    with pytest.raises(SettingsError, match=message):
        load_session(path)


def test_motion_is_a_line_and_an_arc() -> None:
    """B turns 90 deg to the right in 30 s from 30 s on: radius 220 / 0.05236 = 4202 m."""
    motion = fly(LOCAL, LOCAL.aircraft[1])
    start, end = motion.position_m[0], motion.position_m[-1]
    radius = 220.0 / np.deg2rad(3.0)
    assert end - start == pytest.approx([6600.0 + radius, radius, 0.0], abs=1e-6)
    assert motion.track_deg[-1] == 90.0
    assert np.linalg.norm(np.diff(fly(GLOBAL, GLOBAL.aircraft[1]).position_m, axis=0), axis=1) == pytest.approx(
        22.0, rel=1e-4
    )


def test_dead_reckoning_is_truth_and_error_along_its_own_axes() -> None:
    for scenario in (LOCAL, GLOBAL):
        simulated = simulate_session(scenario, 5)
        for track, truth in zip(simulated.session.vehicles, simulated.truth, strict=True):
            assert isinstance(track, DeadReckoning)
            height = truth.states[:, 10 if scenario.frame == "ecef" else 4]
            error = np.column_stack([truth.states[:, :2], -height])
            moved = np.einsum("nij,nj->ni", track.axes, error)
            assert track.position_m - truth.position_m == pytest.approx(moved, abs=1e-6)


def test_integrated_process_has_the_exact_covariance() -> None:
    """One step against the matrix exponential (Van Loan), long and short against the correlation time."""
    for step_s, tau in ((5.0, 4.0), (0.1, 3600.0)):
        rng = np.random.default_rng(3)
        integral, process = integrated_gauss_markov(rng, (200_000, 2), step_s, 0.0, 2.0, tau)
        F = np.array([[0.0, 1.0], [0.0, -1.0 / tau]])
        both = np.zeros((4, 4))
        both[:2, :2], both[:2, 2:], both[2:, 2:] = -F, np.diag([0.0, 8.0 / tau]), F.T
        exact = expm(both * step_s)
        noise = exact[2:, 2:].T @ exact[:2, 2:]
        phi = exact[2:, 2:].T
        left = np.stack([integral[:, 1], process[:, 1]]) - phi @ np.stack([integral[:, 0], process[:, 0]])
        found = np.cov(left)
        scale = np.sqrt(np.outer(np.diag(noise), np.diag(noise)))
        assert found / scale == pytest.approx(noise / scale, abs=0.02)
        assert process.std() == pytest.approx(2.0, rel=0.01)


def test_slots_carry_both_directions_of_every_link_once_a_frame() -> None:
    ranges = simulate_session(LOCAL, 1).session.ranges
    assert len(ranges) == 60 * (3 * 2 + 2 * 3)
    assert (np.diff(ranges.slot) >= 0).all() and (np.diff(ranges.time_s) >= 0.0).all()
    for slot in range(30):
        sources = set(ranges.source[ranges.slot == slot].tolist())
        assert len(sources) == (1 if slot % 10 < 5 else 0)
    both = simulate_session(LOCAL, 1, scale=0.0).session.ranges
    ab = both.pseudorange_m[(both.receiver == "A") & (both.source == "B")]
    ba = both.pseudorange_m[(both.receiver == "B") & (both.source == "A")]
    assert ab[:20] == pytest.approx(ba[:20], abs=1.0)


def test_lost_quantised_and_biased_ranges() -> None:
    lossy = replace(LOCAL, link=replace(LOCAL.link, lost_share=1.0))
    assert len(simulate_session(lossy, 1).session.ranges) == 0
    coarse = replace(LOCAL, link=replace(LOCAL.link, quantum_m=30.0))
    values = simulate_session(coarse, 1).session.ranges.pseudorange_m
    assert values % 30.0 == pytest.approx(np.zeros(len(values)), abs=1e-6)


def test_runs_of_a_seed_do_not_depend_on_one_another() -> None:
    one, again, other = (simulate_session(LOCAL, 1, run) for run in (3, 3, 4))
    assert one.session.ranges.pseudorange_m.tolist() == again.session.ranges.pseudorange_m.tolist()
    assert one.session.ranges.pseudorange_m[0] != other.session.ranges.pseudorange_m[0]


def test_there_and_back_on_the_ellipsoid() -> None:
    rng = np.random.default_rng(1)
    latitude, longitude = rng.uniform(-89, 89, 50), rng.uniform(-180, 180, 50)
    height = rng.uniform(-100, 20_000, 50)
    found = geodetic_deg_m(ecef_m(latitude, longitude, height))
    for value, expected in zip(found, (latitude, longitude, height), strict=True):
        assert value == pytest.approx(expected, abs=1e-6)
    axes = ecef_from_n(latitude, longitude)
    assert np.einsum("nij,nik->njk", axes, axes) == pytest.approx(np.broadcast_to(np.eye(3), (50, 3, 3)), abs=1e-12)


def test_satellites_are_where_satellites_are() -> None:
    """Radii of GPS and GLONASS, speeds of their orbits, and about as many in view as there should be."""
    place, down = ecef_m(56.0, 38.0, 10_000.0), ecef_from_n(56.0, 38.0)[:, 2]
    in_view = 0
    for name, orbit in orbits().items():
        position = satellite_ecef_m(orbit, START_NS, np.array([0.0, 1.0]))
        radius = float(np.linalg.norm(position[0]))
        assert abs(radius - (26_560e3 if name.startswith("GPS") else 25_508e3)) < 0.03 * 26_560e3
        speed = float(np.linalg.norm(position[1] - position[0]))
        assert 2_300.0 < speed < 4_000.0
        in_view += bool(elevation_deg(position[0], place, down) > 5.0)
    assert 16 <= in_view <= 26


def test_emission_lies_a_light_time_back_and_the_earth_has_turned() -> None:
    orbit, place = orbits()["GPS-13"], ecef_m(56.0, 38.0, 0.0)
    position, distance = emission_ecef_m(orbit, START_NS, np.array([100.0]), place[None])
    flight_s = float(distance[0]) / LIGHT_MPS
    assert 0.065 < flight_s < 0.09
    assert position[0] == pytest.approx(satellite_ecef_m(orbit, START_NS, np.array([100.0 - flight_s]))[0], abs=1e-3)
    plain = float(np.linalg.norm(position[0] - place))
    sagnac = 7.292115e-5 / LIGHT_MPS * (position[0, 0] * place[1] - position[0, 1] * place[0])
    assert distance[0] - plain == pytest.approx(sagnac, abs=1e-2)

"""System 2 on what goes wrong in the air: a finding with place and count each, and no silent nonsense."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from groundstation.base.errors import NotAssessableError
from groundstation.methods.fleet.ins_errors import ins_errors
from groundstation.pipeline.one_flight.analyse import Answered, run_analyses
from groundstation.systems.inertial.analysis import FORECAST, INERTIAL
from groundstation.systems.inertial.answer import InertialResult
from groundstation.systems.inertial.estimate import Estimation, estimate_ins_errors
from groundstation.systems.inertial.settings import InertialSettings
from groundstation.systems.known import AircraftData, Known
from groundstation.tables.phases import flight_phases
from groundstation.tables.table import Flight
from tests.systems.inertial.flights import batch_of, changed, flight_of, table_of, with_table, without_rows

DURATION_S = 7200.0
ONE_SIGMA = 1.0
METRES_PER_DEGREE = 111_200.0  # of latitude, to a percent
SAME_M = 1.0  # what a handful of missing samples may move an estimate by


@pytest.fixture(scope="module")
def flight() -> Flight:
    return flight_of(batch_of(duration_s=DURATION_S))


@pytest.fixture(scope="module")
def clean(flight: Flight) -> Estimation:
    return estimate_ins_errors(flight)


def codes(found: Estimation) -> dict[str, int | None]:
    return {finding.code: finding.count for finding in found.findings}


def final_m(found: Estimation) -> np.ndarray:
    return found.run.x[-1, 0]


def test_a_clean_flight_has_no_findings(clean: Estimation) -> None:
    assert clean.findings == ()
    assert clean.result.kind == "unaided"
    assert clean.result.outages == ()


def test_the_headline_is_the_fit_of_the_acceptance(clean: Estimation) -> None:
    """Slope through the origin over all epochs: what the acceptance finds in the saved arrays of the same flight."""
    found = clean.result
    states, track = (
        next(part for part in found.figures if part.name == f"inertial_{name}") for name in ("states", "track")
    )
    errors = ins_errors(
        states["time_s"],
        *(states[f"measured_{channel}_position_m"] for channel in ("north", "east")),
        *(track[f"ins_{name}_deg"] for name in ("latitude", "longitude")),
        start_s=None if found.navigation_start is None else found.navigation_start.time_s,
    )
    assert errors is not None and found.radial_error_rate_50_nmiph is not None
    assert found.radial_error_rate_fit_nmiph == pytest.approx(errors.values()["radial_rate_fit_nmiph"], rel=1e-3)
    assert found.radial_error_rate_fit_nmiph != pytest.approx(found.radial_error_rate_50_nmiph, rel=1e-3)


def test_gnss_never_present(flight: Flight) -> None:
    with pytest.raises(NotAssessableError, match="no GNSS position"):
        estimate_ins_errors(Flight(tables={"ins": flight["ins"]}))


def test_gnss_for_a_minute_only(flight: Flight) -> None:
    short = without_rows(flight, "gnss", flight.time_s("gnss") < 60.0)
    with pytest.raises(NotAssessableError, match="59 s with INS and GNSS together"):
        estimate_ins_errors(short)


def test_gnss_lost_for_good_is_an_outage_that_never_ends(flight: Flight) -> None:
    found = estimate_ins_errors(without_rows(flight, "gnss", flight.time_s("gnss") < 3600.0))
    (outage,) = found.result.outages
    assert outage.length_s == pytest.approx(DURATION_S - 3599.0)
    assert outage.jump_m is None
    assert codes(found)["inertial.outage"] is None


def test_frozen_gnss_is_left_out(flight: Flight, clean: Estimation) -> None:
    time_s = flight.time_s("gnss")
    frozen = (time_s > 4000.0) & (time_s < 4300.0)
    held = {
        name: np.where(frozen, flight["gnss"].values(name)[time_s == 4000.0], flight["gnss"].values(name))
        for name in ("latitude_deg", "longitude_deg", "velocity_north_mps", "velocity_east_mps")
    }
    found = estimate_ins_errors(changed(flight, "gnss", **held))
    assert codes(found)["inertial.gnss_frozen"] == frozen.sum()
    assert np.abs(final_m(found) - final_m(clean)).max() < SAME_M


def test_gnss_that_jumps_by_kilometres_is_left_out_and_counted(flight: Flight, clean: Estimation) -> None:
    time_s = flight.time_s("gnss")
    away = (time_s > 3000.0) & (time_s < 3120.0)
    found = estimate_ins_errors(
        changed(flight, "gnss", latitude_deg=flight["gnss"].values("latitude_deg") + np.where(away, 0.05, 0.0))
    )
    assert codes(found)["inertial.gnss_jump"] == away.sum()
    moved = np.abs(found.run.x - clean.run.x)[int(3120.0) :, :2].max(axis=0)
    assert (moved < ONE_SIGMA * clean.run.sigma(0)[3120:, :2].max(axis=0)[:, None]).all()


def test_one_outlier_of_a_kilometre_moves_nothing_and_is_listed(flight: Flight, clean: Estimation) -> None:
    values = np.array(flight["gnss"].values("longitude_deg"))
    values[5000] += 0.015
    found = estimate_ins_errors(changed(flight, "gnss", longitude_deg=values))
    assert codes(found)["inertial.gnss_jump"] == 1
    ratio = np.abs(found.run.x - clean.run.x)[:, :, 1] / clean.run.sigma(1)
    assert ratio.max() < ONE_SIGMA


def test_an_outlier_below_the_jump_limit_is_gated_and_counted(flight: Flight) -> None:
    settings = InertialSettings(jump_m=5000.0)
    values = np.array(flight["gnss"].values("longitude_deg"))
    values[5000] += 0.015
    found = estimate_ins_errors(changed(flight, "gnss", longitude_deg=values), settings=settings)
    assert codes(found)["inertial.outlier"] == 1


def test_single_wild_samples_of_the_ins_are_no_resets(flight: Flight, clean: Estimation) -> None:
    values = np.array(flight["ins"].values("latitude_deg"))
    values[[2000, 4000, 6500]] += (0.4, -8.0, 0.01)
    found = estimate_ins_errors(changed(flight, "ins", latitude_deg=values))
    assert codes(found) == {"inertial.ins_outlier": 3}
    assert found.result.radial_error_rate_50_nmiph == pytest.approx(clean.result.radial_error_rate_50_nmiph, rel=1e-3)
    assert np.abs(final_m(found) - final_m(clean)).max() < SAME_M


def test_a_filter_that_rejects_everything_is_opened_again(flight: Flight, tmp_path: Path) -> None:
    """A class far too good for the INS: without the cure the gate would lock GNSS out for good."""
    wrong = tmp_path / "wrong.toml"
    wrong.write_text(
        "position_m = 1.0\nvelocity_mps = 1e-3\ntilt_rad = 1e-9\ndrift_dph = 1e-6\nrandom_drift_dph = 1e-6\n"
        "velocity_walk_mps_per_sqrt_s = 1e-6\ntilt_walk_deg_per_sqrt_h = 1e-6\n[gnss]\nis_inflated = false\n",
        encoding="utf-8",
    )
    found = estimate_ins_errors(flight, settings=InertialSettings(ins_class=str(wrong)))
    assert codes(found)["inertial.reopened"] == found.run.reopened > 0
    away = np.abs(found.run.x[:, 0] - found.compared.epochs.position_m).max(axis=1)
    assert np.median(away) < 100.0  # m; the raw INS is kilometres off


def test_an_ins_reset_in_flight_is_found_and_opens_the_position_again(flight: Flight) -> None:
    time_s = flight.time_s("ins")
    after = time_s >= 4000.0
    reset = changed(flight, "ins", longitude_deg=flight["ins"].values("longitude_deg") + np.where(after, 0.05, 0.0))
    found = estimate_ins_errors(reset)
    assert codes(found)["inertial.ins_reset"] == 1
    assert "inertial.gnss_jump" not in codes(found)
    assert "4000" in next(finding.place for finding in found.findings if finding.code == "inertial.ins_reset")
    measured = found.compared.epochs.position_m
    jump_m = 2000.0
    away = np.abs(found.run.x[:, 0] - measured).max(axis=1)
    assert away[4010:].max() < 0.03 * jump_m  # the new position is taken over at once, but for the receiver's colour
    assert away[5000:].max() < 30.0


def test_different_rates_with_jitter_give_the_same_estimate(flight: Flight, clean: Estimation) -> None:
    rng = np.random.default_rng(3)
    gnss, keep = flight["gnss"], np.arange(0, len(flight["gnss"]), 4)
    jitter_s = rng.uniform(-0.2, 0.2, len(keep))
    names = ("latitude_deg", "longitude_deg", "altitude_ellipsoid_m", "velocity_north_mps", "velocity_east_mps")
    time_s = flight.time_s("gnss")
    when = np.clip(time_s[keep] + jitter_s, 0.0, time_s[-1])
    moved = {name: np.interp(when, time_s, gnss.values(name)) for name in names}
    found = estimate_ins_errors(with_table(flight, table_of("gnss", when, moved)))
    assert found.findings == ()
    assert np.abs(final_m(found) - final_m(clean)).max() < 5.0  # m: a quarter of the samples


def test_a_gap_of_an_hour_is_crossed_with_the_exact_exponential(flight: Flight) -> None:
    gap = (3000.0, 6600.0)
    keep = {topic: (flight.time_s(topic) <= gap[0]) | (flight.time_s(topic) >= gap[1]) for topic in ("ins", "gnss")}
    found = estimate_ins_errors(without_rows(without_rows(flight, "ins", keep["ins"]), "gnss", keep["gnss"]))
    (outage,) = found.result.outages
    assert outage.length_s == pytest.approx(3600.0)
    assert outage.jump_m is not None and outage.sigma_m is not None
    assert outage.jump_m < 3.0 * outage.sigma_m
    assert np.isfinite(found.run.x).all()


def test_nan_in_one_channel_is_told_and_the_other_is_as_it_was(flight: Flight, clean: Estimation) -> None:
    values = np.array(flight["gnss"].values("velocity_east_mps"))
    values[2000:2500] = np.nan
    found = estimate_ins_errors(changed(flight, "gnss", velocity_east_mps=values))
    assert codes(found)["inertial.unknown"] == 500
    rounding_m = 1e-6
    assert np.abs(found.run.x[:, 0, 0] - clean.run.x[:, 0, 0]).max() < rounding_m
    assert np.isfinite(found.run.x).all()


def answered(flight: Flight, **known: Any) -> Answered:
    given = Known(flight_phases(flight), settings={"inertial": InertialSettings()}, **known)
    return run_analyses((INERTIAL, FORECAST), flight, given)


def following(flight: Flight, **more: np.ndarray) -> Flight:
    """The flight with an INS whose position follows GNSS."""
    gnss = flight["gnss"]
    position = {name: gnss.values(name) + 1e-6 for name in ("latitude_deg", "longitude_deg")}
    return changed(flight, "ins", **position, **more)


def test_of_an_ins_that_follows_gnss_the_differences_alone_are_told(flight: Flight) -> None:
    found = answered(following(flight))
    result = found.answers["inertial"]
    assert isinstance(result, InertialResult) and result.kind == "gnss_aided"
    assert result.channels == () and result.azimuth is None and result.radial_error_rate_50_nmiph is None
    assert [finding.code for finding in found.findings["inertial"]] == ["inertial.gnss_aided"]
    offset_m, shift_m = result.difference("position", "north"), 1e-6 * METRES_PER_DEGREE
    assert offset_m is not None and offset_m.mean == pytest.approx(shift_m, rel=0.01)
    assert offset_m.largest == pytest.approx(offset_m.median, rel=0.02)
    assert {figure.name for figure in result.figures} == {"inertial_differences", "inertial_track"}
    assert set(found.answers) == {"inertial"}
    assert "GNSS corrects this INS already (it stays within" in found.reasons["forecast"]
    assert result.to_frame("differences").axis.tolist() == ["north", "east", "horizontal"] * 2


def test_of_an_ins_at_rest_the_differences_alone_are_told(flight: Flight) -> None:
    still = {name: np.zeros(len(flight["gnss"])) for name in ("velocity_north_mps", "velocity_east_mps")}
    still |= {name: np.full(len(flight["gnss"]), 50.0) for name in ("latitude_deg", "longitude_deg")}
    found = answered(changed(changed(flight, "gnss", **still), "ins", **still))
    result = found.answers["inertial"]
    assert isinstance(result, InertialResult) and result.kind == "unknown" and "below 5 m/s" in result.kind_reason
    assert result.channels == () and result.differences and set(found.answers) == {"inertial"}
    assert [finding.code for finding in found.findings["inertial"]] == ["inertial.unknown_kind"]
    assert "it is not known whether GNSS corrects this INS (95 %" in found.reasons["forecast"]


def test_what_is_stated_of_the_ins_decides(flight: Flight) -> None:
    by_head = answered(replace(flight, metadata={"ins_kind": "gnss_aided"}))
    by_aircraft = answered(following(flight), aircraft=AircraftData(ins_kind="unaided"))
    kinds = [
        (found.answers["inertial"].kind, found.answers["inertial"].kind_reason) for found in (by_head, by_aircraft)
    ]
    assert kinds == [("gnss_aided", "the log header says so"), ("unaided", "the aircraft file says so")]
    assert by_aircraft.answers["inertial"].channels
    assert answered(replace(flight, metadata={"ins_kind": "strapdown"})).answers["inertial"].kind == "unaided"


def test_excluded_intervals_are_not_compared(flight: Flight) -> None:
    found = estimate_ins_errors(flight, excluded_s=((1000.0, 1500.0),))
    (outage,) = found.result.outages
    assert (outage.start_s, outage.end_s) == (999.0, 1501.0)


def test_one_sample(flight: Flight) -> None:
    single = without_rows(without_rows(flight, "ins", np.arange(1)), "gnss", np.arange(1))
    with pytest.raises(NotAssessableError, match="0 s with INS and GNSS together"):
        estimate_ins_errors(single)

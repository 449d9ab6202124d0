"""Reception of a receiver with known truth: shares of time, losses, scatter, jumps, delays, two receivers."""

from dataclasses import replace

import numpy as np
import pytest

from groundstation.base.errors import NotAssessableError
from groundstation.base.records import Column
from groundstation.integrity.ledger import gaps_of
from groundstation.pipeline.api import open_flight
from groundstation.systems.gnss.answer import GnssReception, VelocityAgainstPosition
from groundstation.systems.gnss.arrays import GnssMissing
from groundstation.systems.gnss.examine import shortfalls_of
from groundstation.systems.gnss.settings import GnssSettings
from groundstation.systems.gnss.wording_answer import meaning_of, memory_of, same_claims
from groundstation.tables.phases import PhaseInterval, Phases
from groundstation.tables.table import Flight, Table
from tests.real_logs import real_log
from tests.systems.gnss.made import (
    STANDS_S,
    STEP_S,
    WHOLE_S,
    answer,
    flight,
    motion,
    receiver,
    reception,
    shares,
    table,
    times,
    unknown_phases,
)

EXACT_M = 2e-4  # radii of curvature differ by so much across the circle
CODES = "gnss."


def codes(*tables: object, **settings: float) -> dict[str, str]:
    return {one.code.removeprefix(CODES): one.severity for one in reception(*tables, **settings).findings}  # type: ignore[arg-type]


def test_shares_are_of_time_and_not_of_rows() -> None:
    time_s = np.concatenate([np.arange(0.0, 60.0, 0.1), np.arange(60.0, 180.0, 0.4)])  # twice as many rows at first
    kinds = np.where(time_s < 60.0, "rtk_fixed", "rtk_float")
    one = receiver(table(time_s, fix=kinds))
    assert shares(one)["rtk_fixed"] == pytest.approx(1.0 / 3.0, abs=0.005)
    assert [state.state for state in one.states] == ["rtk_fixed", "rtk_float"]
    assert answer(table(time_s, fix=kinds)).sentence.startswith(
        "RTK float 67 %, RTK fixed 33 %, fix never lost; 12 sat"
    )


def test_never_a_fix_is_the_sentence_and_bad() -> None:
    count = 926
    nothing = np.full(count, np.nan)
    places = dict.fromkeys(("latitude_deg", "longitude_deg", "altitude_ellipsoid_m"), nothing)
    velocities = {f"velocity_{axis}_mps": nothing for axis in ("north", "east", "down")}
    none = {"fix": np.full(count, "none"), "satellites_used": np.zeros(count), "hdop": nothing}
    found = reception(table(np.arange(count) * 0.1, **places, **velocities, **none))
    assert found.answer.sentence == "GNSS never had a fix: 926 rows, 0 satellites"
    assert found.answer.grade == "bad" and found.findings[0].code == "gnss.never_a_fix"
    assert found.answer.receiver.first_fix_s is None


def test_a_fix_at_latitude_zero_is_none() -> None:
    """Readers leave the place out; the kind of fix stays as claimed."""
    time_s = times()
    no_place = time_s < 30.0
    gone = {
        name: np.where(no_place, np.nan, table(time_s).values(name))
        for name in ("latitude_deg", "longitude_deg", "velocity_north_mps", "velocity_east_mps")
    }
    one = receiver(table(time_s, **gone))
    assert one.placeless_rows == 150 and one.first_fix_s == pytest.approx(30.0)
    assert shares(one)["none"] == pytest.approx(30.0 / WHOLE_S, abs=0.005)
    assert codes(table(time_s, **gone))["no_place"] == "warn"
    assert answer(table(time_s, **gone)).sentence.startswith("first fix after 30 s, then single (3D) throughout")


def test_a_loss_has_length_speeds_and_way() -> None:
    time_s = times()
    lost = (time_s >= 100.0) & (time_s < 112.0)
    one = receiver(table(time_s, fix=np.where(lost, "none", "3d")))
    (loss,) = one.losses
    assert (loss.state, loss.start_s, loss.seconds) == ("none", pytest.approx(100.0), pytest.approx(12.0))
    assert loss.speed_before_mps == pytest.approx(10.0) and loss.speed_after_mps == pytest.approx(10.0)
    place, _velocity = motion(np.array([99.8, 112.0]))
    assert loss.moved_m == pytest.approx(float(np.hypot(*(place[1] - place[0]))), rel=1e-4)
    assert one.lost_s == pytest.approx(12.0) and answer(table(time_s, fix=np.where(lost, "none", "3d"))).grade == "warn"


def test_gaps_are_those_of_the_ledger_and_a_step_of_the_limit_is_none() -> None:
    time_s = times()
    exact, own = (time_s > 100.1) & (time_s < 100.5), (time_s > 120.1) & (time_s < 120.7)  # 3 steps, 4 steps
    thinned = (time_s > 140.0) & (np.arange(len(time_s)) % 2 == 1)  # two usual steps each: no bursts
    rows = table(time_s[~(exact | own | thinned)])
    one, gaps = receiver(rows), gaps_of("gnss", rows.time_ns)
    assert len(gaps) == 1 and gaps.length_s.tolist() == pytest.approx([0.8])
    (loss,) = one.losses
    assert (loss.start_s, loss.seconds) == pytest.approx((120.0, 0.8))  # from row to row


def test_a_fix_that_is_lost_for_single_epochs_is_not_lost_0_times() -> None:
    time_s = times(0.1)
    found = reception(table(time_s, fix=np.where(np.arange(len(time_s)) % 5 == 0, "none", "3d")))
    (told,) = [one for one in found.findings if one.code == "gnss.lost"]
    assert (told.severity, told.text) == (
        "warn",
        "fix lost for no longer than 0.5 s each time, 36 s in all (20 % of the time)",
    )


@pytest.mark.parametrize("start_s", [0.0, 100.0])
def test_a_gap_has_the_speed_and_the_way_from_its_own_row(start_s: float) -> None:
    """Behind the first row too, at which the vehicle stands."""
    time_s = times()
    (loss,) = receiver(table(time_s[(time_s <= start_s + 0.1) | (time_s > start_s + 5.9)])).losses
    place, velocity = motion(np.array([start_s, start_s + 6.0]))
    assert (loss.start_s, loss.seconds) == pytest.approx((start_s, 6.0))
    assert loss.speed_before_mps == pytest.approx(float(np.hypot(*velocity[0])))
    assert loss.moved_m == pytest.approx(float(np.hypot(*(place[1] - place[0]))), rel=1e-4)


def test_a_gap_that_others_share_but_for_a_row_late_is_the_logs() -> None:
    time_s = times()
    rows = table(time_s[(time_s < 100.0) | (time_s >= 103.0)])
    slow_s = np.arange(0.0, WHOLE_S, 0.25)
    slow_s = slow_s[(slow_s < 100.3) | (slow_s >= 102.9)]  # a row of it at 100.25 s, none until 103 s
    baro = replace(table(slow_s, pressure_altitude_m=np.zeros(len(slow_s))), topic="baro")
    one = receiver(rows, baro)
    assert [loss.state for loss in one.losses] == ["log_silent"]
    assert one.losses[0].seconds == pytest.approx(3.2)


@pytest.mark.real_log
def test_the_gaps_of_a_recorded_link_are_counted_once() -> None:
    results = open_flight(real_log("tlog/uavlogviewer_vtol.tlog")).results
    found = results.answer(GnssReception)
    assert found is not None
    entry, losses = results.ledger.topics["gnss"].gaps, found.receiver.losses
    assert (entry.count, round(entry.total_s, 1)) == (10, 14.2)
    assert len(losses) == 10 and sum(loss.seconds for loss in losses) == pytest.approx(entry.total_s, abs=0.01)
    assert "10 gaps, 14 s together, the longest 3.4 s" in found.sentence
    texts = [one.text for one in results.findings if one.topic == "gnss" and one.code in ("data.gaps", "gnss.silent")]
    assert texts[0].startswith("gnss: 10 gaps, 14.2 s together, the longest 3.4 s")
    assert all(" of 10 gaps" in text for text in texts[1:])


def test_a_gap_of_the_log_is_not_the_receivers() -> None:
    time_s = times()
    kept = (time_s < 100.0) | (time_s >= 130.0)
    alone = receiver(table(time_s[kept]))
    assert shares(alone)["no_record"] == pytest.approx(30.0 / WHOLE_S, abs=0.005)
    assert answer(table(time_s[kept])).sentence.startswith("single (3D) throughout, nothing recorded for 30 s")
    baro = replace(table(time_s[kept], pressure_altitude_m=np.zeros(kept.sum())), topic="baro")
    with_baro = receiver(table(time_s[kept]), baro)
    assert "log_silent" in shares(with_baro) and "no_record" not in shares(with_baro)
    all_along = replace(table(time_s, pressure_altitude_m=np.zeros(len(time_s))), topic="baro")
    assert "no_record" in shares(receiver(table(time_s[kept]), all_along))
    assert codes(table(time_s[kept]), all_along)["silent"] == "warn"
    assert "silent" not in codes(table(time_s[kept]), baro)


def test_repeated_rows_are_one() -> None:
    time_s = np.repeat(np.arange(0.0, 60.0), 2)
    pairs = table(time_s, hdop=np.where(np.arange(120) % 2 == 0, 0.8, np.nan))
    one = receiver(pairs)
    assert (one.rows, one.repeated_rows, one.missed_epochs) == (120, 60, 0)
    assert one.rate_hz == pytest.approx(1.0) and one.hdop == pytest.approx(0.8)


def test_missing_epochs_are_counted() -> None:
    time_s = np.delete(times(), [100, 200, 201])
    assert receiver(table(time_s)).missed_epochs == 3


def test_zero_satellites_beside_a_fix_are_not_logged() -> None:
    time_s = times()
    one = receiver(table(time_s, satellites_used=np.zeros(len(time_s))))
    assert one.satellites_used is None and "satellites" not in answer(table(time_s, satellites_used=None)).sentence
    assert "satellites_used_beyond" not in codes(table(time_s, satellites_used=np.zeros(len(time_s))))


def test_few_satellites_and_bad_geometry_are_graded_by_time() -> None:
    time_s = times()
    some = np.where(time_s < 20.0, 5.0, 12.0)
    assert codes(table(time_s, satellites_used=some))["satellites_used_beyond"] == "warn"
    assert answer(table(time_s, satellites_used=some)).grade == "warn"
    assert answer(table(time_s, satellites_used=np.full(len(time_s), 4.0))).grade == "bad"
    assert codes(table(time_s, hdop=np.where(time_s < 5.0, 4.0, 0.8))).keys() == {"held"}, "3 % of the time"
    assert codes(table(time_s, hdop=np.where(time_s < 20.0, 4.0, 0.8)))["hdop_beyond"] == "warn"


def test_shares_of_satellites_and_geometry_are_of_the_time_with_a_fix() -> None:
    """Half of the time without a fix: five satellites in the half of the rest are so for 50 % of it, and it says so."""
    time_s = times()
    few = np.where(time_s < 0.75 * WHOLE_S, 5.0, 12.0)
    found = reception(table(time_s, fix=np.where(time_s < 0.5 * WHOLE_S, "none", "3d"), satellites_used=few))
    (told,) = [one.text for one in found.findings if one.code == "gnss.satellites_used_beyond"]
    assert told == "fewer than 6 satellites 50 % of the time with a fix"
    (whole,) = [
        one.text
        for one in reception(table(time_s, satellites_used=few)).findings
        if one.code == "gnss.satellites_used_beyond"
    ]
    assert whole == "fewer than 6 satellites 75 % of the time"


def test_what_is_not_logged_is_never_good() -> None:
    time_s = times()
    bare = table(time_s, fix=None, satellites_used=None, hdop=None)
    assert answer(bare).grade == "unknown"
    assert answer(table(time_s, fix=None, hdop=None)).grade == "good", "satellites tell"
    told = [one.text for one in shortfalls_of(flight(bare), unknown_phases(), GnssSettings())]
    assert told[0] == "not logged: kind of fix, satellites, DOP, claimed accuracy"


def test_integrity_that_is_lost_is_no_fix() -> None:
    time_s = times()
    sound = Column((time_s < 100.0) | (time_s > 140.0))
    one = receiver(table(time_s, integrity_ok=sound))
    assert shares(one)["integrity_lost"] == pytest.approx(40.0 / WHOLE_S, abs=0.005)
    flat = receiver(table(time_s, fix=np.full(len(time_s), "2d"), integrity_ok=Column(np.zeros(len(time_s), bool))))
    assert shares(flat) == {"2d": 1.0}, "nobody vouches for a 2D fix"
    assert codes(table(time_s, fix=np.full(len(time_s), "2d")))["two_dimensions"] == "warn"


def noisy(sigma_m: float, seed: int = 1) -> np.ndarray:
    rng = np.random.default_rng(seed)
    place, _velocity = motion(times())
    return np.asarray(place + rng.normal(0.0, sigma_m / np.sqrt(2.0), place.shape))


def test_scatter_of_white_errors_is_the_sigma_and_has_no_memory() -> None:
    claimed = np.full(len(times()), 0.02)
    stood = receiver(table(times(), place_m=noisy(0.02), horizontal_sigma_m=claimed)).standstill
    assert stood is not None
    count = 2 * (stood.samples - 1)
    assert abs(stood.scatter_m / 0.02 - 1.0) < 4.0 / np.sqrt(2.0 * count)
    assert stood.claimed_m == 0.02 and stood.correlation_s == pytest.approx(STEP_S)
    assert STANDS_S - 10.0 < stood.end_s - stood.start_s < STANDS_S, "the drive is no standstill"
    assert not stood.is_held and not stood.is_coarse
    sentence = answer(table(times(), place_m=noisy(0.02), horizontal_sigma_m=claimed)).sentence
    assert f"scatter {100.0 * stood.scatter_m:.1f} cm where 2.0 cm is claimed" in sentence


def test_errors_of_several_durations_last_as_long_as_their_means_say() -> None:
    """What remains of a mean is what the duration told makes of it."""
    rng, time_s = np.random.default_rng(6), np.arange(0.0, 4000.0, 1.0)
    place = np.zeros((len(time_s), 2))
    for sigma_m, lasts_s in ((0.6, 8.0), (0.5, 120.0)):
        kept, drawn = np.exp(-1.0 / lasts_s), rng.normal(0.0, sigma_m, (len(time_s), 2))
        drift = np.zeros_like(place)
        drift[0] = drawn[0]
        for row in range(1, len(time_s)):
            drift[row] = kept * drift[row - 1] + np.sqrt(1.0 - kept**2) * drawn[row]
        place += drift
    still = {f"velocity_{axis}_mps": np.zeros(len(time_s)) for axis in ("north", "east")}
    stood = receiver(table(time_s, place_m=place, **still)).standstill
    assert stood is not None and stood.correlation_s is not None
    assert stood.averaged_s == 512.0 and stood.averaged_scatter_m is not None
    told_m = stood.scatter_m * np.sqrt(2.0 * stood.correlation_s / stood.averaged_s)
    assert told_m >= stood.averaged_scatter_m * 0.999
    true_s = (0.36 * 8.0 + 0.25 * 120.0) / 0.61  # durations by their power
    assert stood.correlation_s == pytest.approx(true_s, rel=0.5)
    assert "means over 8:32 min scatter by" in memory_of(stood)


def two_kinds(**columns: object) -> Table:
    """A stand of 30 s RTK fixed with 0.01 m, then 30 s float with 0.04 m, and a drive in float."""
    time_s = times()
    place = np.where((time_s < 30.0)[:, None], noisy(0.01, seed=2), noisy(0.04, seed=3))
    kinds = np.where(time_s < 30.0, "rtk_fixed", "rtk_float")
    return table(time_s, place_m=place, fix=kinds, **columns)


def test_each_kind_of_fix_has_its_scatter_and_the_sentence_names_it() -> None:
    one = receiver(two_kinds(horizontal_sigma_m=np.full(len(times()), 0.014)))
    fixed, floating = one.standstills
    assert (fixed.state, floating.state) == ("rtk_fixed", "rtk_float")
    assert fixed.scatter_m == pytest.approx(0.01, rel=0.2) and floating.scatter_m == pytest.approx(0.04, rel=0.2)
    assert (fixed.start_s, fixed.end_s) == (pytest.approx(2.0, abs=0.3), pytest.approx(27.8, abs=0.3))
    assert fixed.samples == pytest.approx((fixed.end_s - fixed.start_s) / STEP_S + 1.0, abs=0.5)
    told = answer(two_kinds(horizontal_sigma_m=np.full(len(times()), 0.014))).sentence
    assert told.endswith(f"scatter {100.0 * floating.scatter_m:.1f} cm while RTK float, 1.4 cm claimed")


def test_a_worse_kind_that_claims_as_much_as_a_better_one_is_told() -> None:
    time_s = times()
    same = receiver(two_kinds(horizontal_sigma_m=np.full(len(time_s), 0.014)))
    assert same_claims(same) == "RTK float claims 1.4 cm, as RTK fixed does: the claimed σ does not tell them apart"
    assert codes(two_kinds(horizontal_sigma_m=np.full(len(time_s), 0.014)))["same_claim"] == "info"
    honest = receiver(two_kinds(horizontal_sigma_m=np.where(time_s < 30.0, 0.014, 0.2)))
    assert same_claims(honest) == "" and [one.claimed_m for one in honest.states] == [0.014, 0.2]


def test_a_standstill_knows_the_one_of_the_overview_that_it_lies_in() -> None:
    phases = Phases((PhaseInterval(0.0, 61.0, "standstill"), PhaseInterval(61.0, WHOLE_S, "driving")), "test")
    stood = reception(table(times(), place_m=noisy(0.02)), phases=phases).answer.receiver.standstill
    assert stood is not None and (stood.phase_start_s, stood.phase_end_s) == (0.0, 61.0)
    assert stood.start_s == pytest.approx(2.0, abs=0.01) and stood.end_s < 60.5, "edges taken off"


def sentences(time_s: np.ndarray, topic: str, hdop: float) -> Table:
    time_ns = np.round((time_s + 0.05) * 1e9).astype(np.int64)
    columns = {"HDOP": Column(np.full(len(time_s), hdop))}
    return Table(topic, time_ns, columns, np.arange(len(time_s)), Column(time_ns))


def test_hdop_of_sentences_is_that_of_the_receiver() -> None:
    time_s = times()
    bare = table(time_s, hdop=None)
    one = receiver(bare, sentences(time_s, "raw.GNGGA", 0.62), sentences(time_s, "raw.GNGSA", 0.9))
    assert (one.hdop, one.hdop_high, one.hdop_of) == (0.62, 0.62, "raw.GNGGA")
    assert receiver(bare, sentences(time_s, "raw.GNGSA", 0.9)).hdop == 0.9
    assert receiver(table(time_s), sentences(time_s, "raw.GNGGA", 0.62)).hdop == 0.8, "its own comes first"
    assert receiver(bare, sentences(time_s + 1000.0, "raw.GNGGA", 0.62)).hdop is None, "of other epochs"
    assert codes(bare, sentences(time_s, "raw.GNGGA", 4.0))["hdop_beyond"] == "warn"
    with_pdop = table(time_s, hdop=None, pdop=np.full(len(time_s), 0.62))
    assert receiver(with_pdop, sentences(time_s, "raw.GNGGA", 0.62)).hdop is None, "it is the PDOP"
    other = replace(table(time_s, hdop=None), topic="gnss.2")
    two = replace(bare, topic="gnss.1")
    assert receiver(two, other, sentences(time_s, "raw.GNGGA", 0.62)).hdop is None, "of which receiver is not known"


def test_subframes_that_satellites_send_irregularly_have_no_gaps() -> None:
    """Steps of 0.25 and 0.75 s in turn, and 1 s now and then, are how they come."""
    steps_s = np.tile([0.25, 0.75, 0.25, 0.25, 1.0, 0.25, 0.75, 0.25], 30)
    time_ns = np.round(np.cumsum(steps_s) * 1e9).astype(np.int64)
    assert len(gaps_of("raw.NAV-PVT", time_ns)), "of a topic with a rate they are lost"
    for topic in ("raw.RXM-SFRBX", "raw.RXM-SFRBX.group", "raw.GNTXT", "raw.INF-NOTICE", "raw.MGA-10"):
        assert not len(gaps_of(topic, time_ns)), topic


def texts(topic: str, field: str, *said: str) -> Table:
    time_ns = np.arange(len(said), dtype=np.int64) * 10**9
    return Table(topic, time_ns, {field: Column(np.array(said))}, np.arange(len(said)), Column(time_ns))


def test_texts_of_the_receiver_are_counted_and_told_once() -> None:
    said = texts("raw.GNTXT", "text", *["NMEA unknown msg"] * 402)
    found = reception(table(times()), said, texts("raw.INF-NOTICE", "message", "u-blox", "", "ANTSTATUS=OK"))
    told = {one.topic: one for one in found.findings if one.code == "gnss.texts"}
    assert told["raw.GNTXT"].text == '402 texts of the receiver (GNTXT), each: "NMEA unknown msg"'
    assert (told["raw.GNTXT"].severity, told["raw.GNTXT"].count) == ("info", 402)
    assert told["raw.INF-NOTICE"].text == '2 texts of the receiver (INF-NOTICE), the first: "u-blox"'
    assert [(one.count, one.different) for one in found.answer.texts] == [(402, 1), (2, 2)]


def test_a_receiver_alone_tells_no_heading() -> None:
    assert not answer(table(times())).has_heading_source
    assert answer(table(times(), "gnss.1"), table(times(), "gnss.2")).has_heading_source, "two antennas"
    compass = replace(table(times(), true_heading_deg=np.zeros(len(times()))), topic="ins")
    assert answer(table(times()), compass).has_heading_source
    assert answer(table(times()), texts("raw.GPHDT", "headingT", "1.0")).has_heading_source


@pytest.mark.parametrize(
    ("rms", "left", "lasting", "lag_s", "told"),
    [
        (0.05, 0.05, 0.02, None, "the difference is within the claimed σ"),
        (0.142, 0.053, 0.019, 0.131, "2.0 times the claimed σ: the delay of 0.13 s explains it, 0.05 m/s is left"),
        (
            0.142,
            0.14,
            0.019,
            0.02,
            "noise from fix to fix explains it, means over 10 s differ by 0.02",
        ),
        (0.5, 0.5, 0.1, None, "noise from fix to fix does not explain all of it, means over 10 s differ by 0.10 m/s"),
        (0.5, 0.5, 0.3, None, "neither a delay nor noise from fix to fix explains it"),
        (0.5, 0.5, None, None, "too short to say"),
    ],
)
def test_the_difference_of_velocity_has_a_meaning(
    rms: float, left: float, lasting: float | None, lag_s: float | None, told: str
) -> None:
    motion = VelocityAgainstPosition(100.0, rms, left, lasting, 0.071, lag_s, None if lag_s is None else 0.003)
    assert told in meaning_of(motion, 2.0)
    assert "not judged" in meaning_of(replace(motion, claimed_mps=None), 2.0)


def test_a_late_velocity_explains_its_difference() -> None:
    time_s = times()
    _place, velocity = motion(time_s - 0.25)
    late = {"velocity_north_mps": velocity[:, 0], "velocity_east_mps": velocity[:, 1]}
    one = receiver(table(time_s, velocity_sigma_mps=np.full(len(time_s), 0.1), **late))
    assert one.motion is not None and "the delay of 0.25 s explains it" in meaning_of(one.motion, 2.0)


def test_claims_that_are_too_small_are_a_warning() -> None:
    claimed = np.full(len(times()), 0.005)
    assert codes(table(times(), place_m=noisy(0.02), horizontal_sigma_m=claimed))["too_sure"] == "warn"
    assert "too_sure" not in codes(table(times(), place_m=noisy(0.02), horizontal_sigma_m=8.0 * claimed))


def test_errors_that_last_are_told() -> None:
    rng, time_s = np.random.default_rng(3), times()
    walk = np.cumsum(rng.normal(0.0, 0.01, (len(time_s), 2)), axis=0)
    stood = receiver(table(time_s, place_m=motion(time_s)[0] + walk)).standstill
    assert stood is not None and stood.correlation_s is None and stood.independent == 1.0
    steady = np.zeros((len(time_s), 2))
    held = receiver(table(time_s, place_m=motion(time_s)[0] + steady)).standstill
    assert held is not None and held.is_held
    assert codes(table(time_s))["held"] == "info"


def test_the_step_of_logged_places_hides_scatter() -> None:
    step_deg = 1e-7
    exact = table(times(), place_m=noisy(0.001))
    rounded = {name: np.round(exact.values(name) / step_deg) * step_deg for name in ("latitude_deg", "longitude_deg")}
    stood = receiver(table(times(), **rounded)).standstill
    assert stood is not None and stood.resolution_m == pytest.approx(0.0111, abs=2e-4)
    assert stood.is_coarse or stood.scatter_m > 0.5 * stood.resolution_m


def test_in_the_air_nothing_stands() -> None:
    phases = Phases((PhaseInterval(0.0, WHOLE_S, "airborne"),), "test")
    assert reception(table(times(), place_m=noisy(0.02)), phases=phases).answer.receiver.standstill is None


def test_without_noise_position_and_velocity_agree() -> None:
    one = receiver(table(times()))
    assert one.jumps_found == 0 and one.motion is not None
    assert one.motion.difference_rms_mps < 0.02, "of the trapezoid in a circle"
    assert one.motion.lag_s == pytest.approx(0.0, abs=0.005)


def test_places_in_coarse_steps_differ_from_a_velocity_of_zero() -> None:
    """Most steps are of nothing: the others are no outliers."""
    time_s = times(0.5)
    moved = np.isin(np.arange(len(time_s)) % 10, (3, 4, 5))  # there and back: two steps of ten
    still = {f"velocity_{axis}_mps": np.zeros(len(time_s)) for axis in ("north", "east")}
    one = receiver(table(time_s, place_m=np.column_stack([0.02 * moved, np.zeros(len(time_s))]), **still))
    assert one.motion is not None and one.jumps_found == 0
    assert one.motion.difference_rms_mps == pytest.approx(0.04 * np.sqrt(0.2), rel=0.01)
    far = np.column_stack([0.02 * moved + 300.0 * (time_s == 90.0), np.zeros(len(time_s))])
    one = receiver(table(time_s, place_m=far, **still))
    assert one.motion is not None and one.jumps_found == 2
    assert one.motion.difference_rms_mps == pytest.approx(0.04 * np.sqrt(0.2), rel=0.01), "without the jumps"


def test_a_receiver_that_holds_its_place_still_jumps() -> None:
    """Every step but one is of nothing."""
    time_s = times(0.5)
    still = {f"velocity_{axis}_mps": np.zeros(len(time_s)) for axis in ("north", "east")}
    far = np.column_stack([300.0 * (time_s >= 90.0), np.zeros(len(time_s))])
    one = receiver(table(time_s, place_m=far, **still))
    assert one.jumps_found == 1 and one.jumps[0].size_m == pytest.approx(300.0, rel=1e-3)
    assert one.motion is not None and one.motion.difference_rms_mps == pytest.approx(0.0, abs=1e-6)


def test_a_place_that_is_seldom_another_step_is_no_jump_and_no_outlier() -> None:
    """Fewer steps of 2 cm than jumps may be: they count in the difference all the same."""
    time_s = times(0.5)
    still = {f"velocity_{axis}_mps": np.zeros(len(time_s)) for axis in ("north", "east")}
    moved = np.isin(np.arange(len(time_s)) % 40, (3, 4, 5))  # there and back nine times
    one = receiver(table(time_s, place_m=np.column_stack([0.02 * moved, np.zeros(len(time_s))]), **still))
    assert one.motion is not None and one.jumps_found == 0
    assert one.motion.difference_rms_mps == pytest.approx(0.04 * np.sqrt(0.05), rel=0.01)


@pytest.mark.parametrize("step_s", [0.1, 1.0])
def test_noise_of_the_fixes_is_no_other_motion(step_s: float) -> None:
    """Fixes that scatter by 0.8 m at 10 Hz differ from their velocity by 11 m/s, and tell the same motion."""
    time_s = times(step_s)
    place = motion(time_s)[0] + np.random.default_rng(7).normal(0.0, 0.8, (len(time_s), 2))
    one = receiver(table(time_s, place_m=place))
    assert one.motion is not None and one.motion.lasting_rms_mps is not None
    assert one.motion.difference_rms_mps == pytest.approx(1.6 / step_s, rel=0.1)
    assert one.motion.lasting_rms_mps == pytest.approx(0.16, abs=0.05)
    assert "velocity_apart" not in codes(table(time_s, place_m=place))


def test_a_velocity_of_another_motion_is_told_through_the_noise() -> None:
    time_s = times(0.1)
    place, velocity = motion(time_s)
    place = place + np.random.default_rng(7).normal(0.0, 0.8, (len(time_s), 2))
    told = codes(table(time_s, place_m=place, velocity_north_mps=velocity[:, 0] + 4.0))
    assert told["velocity_apart"] == "warn"


@pytest.mark.parametrize("lag_s", [0.25, -0.15])
def test_a_late_velocity_is_found_with_its_sign(lag_s: float) -> None:
    time_s = times()
    _place, velocity = motion(time_s - lag_s)
    one = receiver(table(time_s, velocity_north_mps=velocity[:, 0], velocity_east_mps=velocity[:, 1]))
    assert one.motion is not None and one.motion.lag_s == pytest.approx(lag_s, abs=0.005)
    assert one.motion.left_rms_mps < 0.1 * one.motion.difference_rms_mps


def test_a_jump_is_found_with_place_and_size() -> None:
    time_s = times()
    place, velocity = motion(time_s)
    ahead = velocity[time_s >= 120.0][0] / 10.0
    place[time_s >= 120.0] += 3.0 * ahead + 4.0 * np.array([-ahead[1], ahead[0]])
    one = receiver(table(time_s, place_m=place))
    (jump,) = one.jumps
    assert jump.along_m == pytest.approx(3.0, abs=0.1)
    assert (jump.time_s, jump.size_m) == (pytest.approx(120.0), pytest.approx(5.0, abs=0.05))
    assert jump.time_shift_s is None and codes(table(time_s, place_m=place))["jump"] == "warn"


def test_a_wrong_time_stamp_is_told_from_a_wrong_place() -> None:
    time_s = times()
    shifted = np.where(time_s >= 120.0, time_s + 1.0, time_s)
    one = receiver(table(time_s, place_m=motion(shifted)[0]))
    (jump,) = one.jumps
    assert jump.size_m == pytest.approx(10.0, abs=0.1) and jump.time_shift_s == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize("jump_m", [0.0, 5.0])
def test_a_turn_with_a_late_velocity_is_no_jump_and_hides_none(jump_m: float) -> None:
    """A light aircraft that flies straight for long and turns twice, with a velocity half a second late."""
    time_s = times(1.0, 400.0)
    turning = ((time_s > 100.0) & (time_s < 110.0)) | ((time_s > 300.0) & (time_s < 315.0))
    heading = np.cumsum(np.where(turning, np.deg2rad(6.0), 0.0))
    velocity = 45.0 * np.column_stack([np.cos(heading), np.sin(heading)])
    before = np.vstack([velocity[:1], velocity[:-1]])
    place = np.cumsum(0.5 * (velocity + before), axis=0)
    place += np.random.default_rng(3).normal(0.0, 0.1, place.shape)
    place[time_s >= 305.0] += (jump_m, 0.0)  # across: it flies east there
    late = 0.5 * (velocity + before)
    one = receiver(table(time_s, place_m=place, velocity_north_mps=late[:, 0], velocity_east_mps=late[:, 1]))
    assert one.motion is not None and one.motion.lag_s is not None and one.motion.lag_s > 0.4
    assert [jump.time_s for jump in one.jumps] == ([305.0] if jump_m else [])
    assert [jump.size_m for jump in one.jumps] == pytest.approx([jump_m] if jump_m else [], abs=0.6)


def test_places_logged_in_coarse_steps_do_not_jump() -> None:
    """A receiver that stands for most of the log, its places in steps of 4 m."""
    exact = table(times(whole_s=100.0))
    step_deg = 4e-5
    rounded = {name: np.round(exact.values(name) / step_deg) * step_deg for name in ("latitude_deg", "longitude_deg")}
    one = receiver(table(times(whole_s=100.0), **rounded))
    assert one.motion is not None and one.jumps_found == 0


def test_jumps_without_velocities() -> None:
    time_s = times()
    place = motion(time_s)[0]
    place[time_s >= 120.0] += (3.0, -4.0)
    nothing = {f"velocity_{axis}_mps": None for axis in ("north", "east", "down")}
    one = receiver(table(time_s, place_m=place, **nothing))
    assert one.motion is None and one.jumps_found == 1 and one.jumps[0].time_s == pytest.approx(120.0)


def test_far_from_the_first_place_steps_are_still_right() -> None:
    """A plane 3 deg away has no jumps and no difference of its own."""
    time_s = times(whole_s=3000.0)
    speed = np.full(len(time_s), 100.0)
    far_m = np.column_stack([np.zeros(len(time_s)), 100.0 * time_s])
    one = receiver(
        table(time_s, place_m=far_m, velocity_north_mps=0.0 * speed, velocity_east_mps=speed, altitude_ellipsoid_m=None)
    )
    assert one.jumps_found == 0 and one.motion is not None and one.motion.difference_rms_mps < 1e-3


def test_two_antennas_keep_their_distance_and_the_late_one_is_found() -> None:
    time_s = times()
    late_s = 0.1
    _place, velocity = motion(time_s)
    speed = np.hypot(velocity[:, 0], velocity[:, 1])
    moving = speed > 0.0
    track = np.where(moving[:, None], velocity / np.where(moving, speed, 1.0)[:, None], [[1.0, 0.0]])
    ahead = motion(time_s - late_s)[0] + 1.5 * track
    found = answer(table(time_s, "gnss.1"), table(time_s, "gnss.2", ahead))
    (pair,) = found.pairs
    assert (pair.first, pair.second, pair.seconds) == ("gnss.1", "gnss.2", pytest.approx(WHOLE_S, abs=1.0))
    assert pair.lag_s == pytest.approx(late_s, abs=0.01) and pair.forward_m == pytest.approx(1.5, abs=0.05)
    assert pair.velocity_difference_rms_mps == pytest.approx(0.0, abs=1e-6)


def test_a_dead_second_receiver_is_a_warning_and_not_the_answer() -> None:
    time_s = times()
    nothing = np.full(len(time_s), np.nan)
    dead = table(
        time_s,
        "gnss.1",
        latitude_deg=nothing,
        longitude_deg=nothing,
        altitude_ellipsoid_m=nothing,
        velocity_north_mps=nothing,
        velocity_east_mps=nothing,
        velocity_down_mps=nothing,
        satellites_used=np.zeros(len(time_s)),
        hdop=nothing,
        fix=np.full(len(time_s), "none"),
    )
    found = answer(dead, table(time_s, "gnss.2"))
    assert (found.main, found.grade, found.pairs) == ("gnss.2", "warn", ())
    assert found.sentence.endswith("gnss.1: never had a fix: 900 rows, 0 satellites")


@pytest.mark.parametrize("count", [1, 2, 3])
def test_a_row_or_two_give_a_sentence(count: int) -> None:
    found = answer(table(np.arange(count) * 1.0))
    assert found.sentence.startswith("single (3D)") and found.receiver.rows == count


def test_without_a_receiver_there_is_a_reason() -> None:
    with pytest.raises(NotAssessableError, match="no GNSS in the log"):
        reception()
    assert isinstance(flight(), Flight)


def test_all_nan_and_shuffled_fields_are_no_error() -> None:
    time_s = times(1.0)
    for name in ("latitude_deg", "velocity_north_mps", "altitude_ellipsoid_m", "hdop", "satellites_used"):
        assert answer(table(time_s, **{name: np.full(len(time_s), np.nan)})).sentence


def test_missing_epochs_are_counted_and_placed_and_never_stand_beside_nothing_lost() -> None:
    time_s = np.delete(np.arange(0.0, 200.0, 0.5), [40, 100, 101])
    found = reception(table(time_s))
    one = found.answer.receiver
    assert one.missed_epochs == 3
    assert "nothing lost" not in found.answer.sentence
    assert "throughout, 3 of 400 epochs missing" in found.answer.sentence
    places = next(figure for figure in found.answer.figures if isinstance(figure, GnssMissing))
    assert places.after_s.tolist() == [19.5, 49.5] and places.next_s.tolist() == [20.5, 51.0]
    assert places.epochs.tolist() == [1.0, 2.0]


def test_a_row_that_is_late_is_no_missing_epoch() -> None:
    time_s = np.arange(0.0, 200.0, 0.5)
    time_s[[40, 90]] += 0.3
    found = reception(table(time_s))
    assert found.answer.receiver.missed_epochs == 0 and "throughout; 12 sat" in found.answer.sentence
    assert not any(isinstance(figure, GnssMissing) for figure in found.answer.figures)


@pytest.mark.parametrize(("step_s", "late_s"), [(0.1, 0.25), (0.2, 0.45)])
def test_a_row_that_is_late_by_several_steps_is_no_gap(step_s: float, late_s: float) -> None:
    """Rows wait in a buffer and come together: none is missing, whatever the time of arrival; 3 at 100 s are."""
    due_s = np.arange(0.0, 200.0, step_s)
    due_s = due_s[(due_s < 100.05) | (due_s > 100.05 + 3.0 * step_s)]
    late = (np.arange(len(due_s)) % 50 == 25) & (due_s < 90.0)
    time_s = np.maximum.accumulate(due_s + late_s * late) + 1e-4 * np.arange(len(due_s)) / len(due_s)
    one = receiver(table(time_s))
    assert one.missed_epochs == 3
    assert [loss.start_s for loss in one.losses] == [pytest.approx(100.0, abs=1e-3)]
    found = reception(table(time_s))
    assert not [one.text for one in found.findings if one.severity == "warn"]

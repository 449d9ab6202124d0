"""Chapter, figures, columns and findings of the GNSS reception; and recorded logs with what is known of them."""

from dataclasses import replace

import numpy as np
import pytest

from groundstation.chapters.markdown import markdown
from groundstation.chapters.parts import Facts, Note
from groundstation.pipeline.api import open_flight
from groundstation.results.flight import FlightResults
from groundstation.systems.gnss.analysis import GNSS
from groundstation.systems.gnss.answer import GnssReception
from groundstation.systems.gnss.chapter import gnss
from groundstation.systems.gnss.plots import PLOTS
from groundstation.tables.table import Table
from tests.real_logs import real_log
from tests.report_example import example
from tests.systems.gnss.made import answer, motion, table, times
from tests.told import next_steps


def results_of(*tables: Table) -> FlightResults:
    """Results of a flight that has only this answer."""
    found = answer(*tables)
    bare = replace(example(), answers={"gnss": found}, figures=found.figures)
    assert bare.answer(GnssReception) is not None
    return bare


def test_the_chapter_says_the_sentence_and_not_logged() -> None:
    results = results_of(table(times(), cn0_dbhz=None))
    section = gnss(results)
    assert section is not None and section.claim is not None
    text = markdown(section)
    assert section.headline.startswith("single (3D) throughout; 12 satellites")
    assert "not logged" in text and section.claim.mark.text == "Good"


def test_the_chapter_tells_scatter_by_kind_of_fix_and_what_is_left_out() -> None:
    time_s = times()
    kinds = np.where(time_s < 30.0, "rtk_fixed", np.where(time_s < 100.0, "rtk_float", "3d"))
    section = gnss(results_of(table(time_s, fix=kinds, horizontal_sigma_m=np.full(len(time_s), 0.014))))
    assert section is not None and section.claim is not None
    text = markdown(section)
    assert "Scatter at standstill by kind of fix" in text
    assert "Single (3D): no standstill of 10 s, so no scatter." in text
    assert "RTK fixed | 0:02 to 0:28 | 130" in text
    assert text.count("as RTK fixed does") == 1
    assert "No heading source in the log: track only." in section.claim.sentences


def test_the_page_opens_with_what_is_against_the_reception() -> None:
    few = gnss(results_of(table(times(), satellites_used=np.full(len(times()), 4.0))))
    assert few is not None and few.claim is not None and few.claim.mark.tone == "bad"
    assert few.claim.headline.startswith("Fewer than 5 satellites 100 % of the time; single (3D) throughout")
    assert not any("Fewer than 5" in one for one in few.claim.sentences), "told once"
    good = gnss(results_of(table(times())))
    assert good is not None and good.claim is not None and good.claim.value == "100 %"
    assert good.claim.headline.startswith("Single (3D) throughout")


def test_the_scatter_of_the_front_says_which_it_is() -> None:
    time_s, rng = times(), np.random.default_rng(1)
    place_m = motion(time_s)[0] + rng.normal(0.0, 0.5, (len(time_s), 2))
    section = gnss(results_of(table(time_s, place_m=place_m)))
    assert section is not None and section.claim is not None
    (remark,) = [remark for name, _, remark in section.claim.figures if name == "Scatter"]
    assert remark == "horizontal σ"


def test_the_share_of_the_tile_is_of_all_the_time_and_not_of_that_after_the_first_fix() -> None:
    time_s = times()
    late = results_of(table(time_s, fix=np.where(time_s < 0.8 * time_s[-1], "none", "3d")))
    section, found = gnss(late), late.answer(GnssReception)
    assert section is not None and section.claim is not None and found is not None
    assert section.claim.value == "20 %" and section.claim.remark == "single (3D)"
    assert "then single (3D) throughout" in section.claim.headline
    assert found.receiver.fix_share == pytest.approx(0.2, abs=0.005)


def test_shares_after_the_first_fix_are_never_more_than_all() -> None:
    found = open_flight(real_log("dataflash/plane_4.2.3_pilot0004.BIN")).results.answer(GnssReception)
    assert found is not None
    assert 0.9 < found.receiver.share_after_first_fix("3d") <= 1.0


def test_a_chapter_of_nothing_known_is_not_judged() -> None:
    section = gnss(results_of(table(times(), fix=None, satellites_used=None, hdop=None)))
    assert section is not None and section.claim is not None and section.claim.mark.tone == "unknown"


@pytest.mark.real_log
def test_delays_of_the_velocity_are_told_as_that_of_the_position_too() -> None:
    """Velocity 0.280 s behind the INS and 0.199 s behind the position: the position 0.081 s behind the INS."""
    results = open_flight(real_log("reference_heading/pntos_drive_first_half.csv")).results
    section = gnss(results)
    assert section is not None
    (facts,) = (
        part for part in section.parts if isinstance(part, Facts) and part.title.startswith("Velocity against pos")
    )
    text = facts.caption.replace("\N{NARROW NO-BREAK SPACE}", " ")
    assert "so the position is later than the INS by +0.081 s (σ 0.03" in text
    (lag,) = (remark for label, _, remark in facts.pairs if label == "Velocity later than position by")
    assert lag.startswith("σ "), "one sigma is not a 95 % interval"


def test_every_figure_has_its_plot() -> None:
    time_s = times()
    cn0 = 40.0 + np.sin(time_s)
    rng = np.random.default_rng(4)
    one = table(time_s, "gnss.1", cn0_dbhz=cn0, horizontal_sigma_m=np.full(len(time_s), 0.02))
    shaken = {name: one.values(name) + rng.normal(0.0, 2e-7, len(time_s)) for name in ("latitude_deg", "longitude_deg")}
    results = results_of(table(time_s, "gnss.1", cn0_dbhz=cn0, **shaken), table(time_s, "gnss.2"))
    assert PLOTS["gnss.states"](results) is not None
    for name in ("gnss.quality", "gnss.standstill", "gnss.steps"):
        plot = PLOTS[name](results, "gnss.1")
        assert plot is not None and plot.title.endswith(" of gnss.1"), name
    assert PLOTS["gnss.pair"](results, "gnss.2 from gnss.1") is not None
    assert PLOTS["gnss.standstill"](results, "gnss.2") is None, "places that the receiver holds"


def test_columns_of_the_tables_of_flights() -> None:
    values = GNSS.values({"gnss": answer(table(times(), fix=np.full(len(times()), "rtk_fixed")))})
    assert values["gnss_grade"] == "good" and values["gnss_rtk_fixed_share"] == pytest.approx(1.0)
    assert values["gnss_satellites"] == 12.0 and values["gnss_cn0_dbhz"] is None and values["gnss_jumps"] == 0


EXPECTED = {
    "gnss/walk_0827_gnss_1730.ubx": ("warn", "RTK fixed 65 %, RTK float 35 %, fix never lost; 25 satellites"),
    "gnss/walk_0827_gnss_1730_sf.pos": ("warn", "RTK fixed 65 %, RTK float 35 %, fix never lost; 25 satellites"),
    "gnss/drive_0708_gnss_1934_sf.pos": ("good", "RTK fixed 99.6 %, RTK float 0.4 %, fix never lost; 23 satellites"),
    "ulog/quadrotor_local.ulg": ("bad", "GNSS never had a fix: 926 rows, 0 satellites"),
    "cases/u3_first_receiver_dead.ulg": (
        "warn",
        "gnss.2: single (3D) throughout; 14 satellites; gnss.1: ",
    ),
    "cases/m3_zero_fix.mcap": ("warn", "first fix after 30 s, then single (3D) throughout"),
    "cases/f_zero_fix_first_60s.csv.gz": ("unknown", "first fix after 60 s, then fix (kind not logged) throughout"),
    "cases/n4_pashr_kinds.nmea": ("good", "RTK fixed throughout; 14 satellites"),
    "cases/m2_two_publishers.mcap": ("good", "gnss.1: single (3D) throughout"),
    "cases/d12_hdop_9_9.bin": ("bad", "single (3D) throughout; 4 satellites"),
    "gnss/inertialsense_Serial38400.nmea": (
        "good",
        "single (3D) throughout, 20 of 2327 epochs missing; 10 satellites; scatter",
    ),
    "gnss/pygpsdata-NMEA.log": ("warn", "single (3D); 6 satellites"),
}


@pytest.mark.real_log
@pytest.mark.parametrize("name", EXPECTED)
def test_recorded_logs_open_on_the_sentence_of_their_owner(name: str) -> None:
    found = open_flight(real_log(name)).results.answer(GnssReception)
    grade, sentence = EXPECTED[name]
    assert found is not None and found.sentence.startswith(sentence) and found.grade == grade


@pytest.mark.real_log
def test_states_of_the_walk_and_the_drive_are_those_of_their_rows() -> None:
    walk = open_flight(real_log("gnss/walk_0827_gnss_1730_sf.pos")).results.answer(GnssReception)
    assert walk is not None and walk.receiver.rate_hz == pytest.approx(4.0)
    seconds = {one.state: one.seconds for one in walk.receiver.states}
    assert seconds == pytest.approx({"rtk_fixed": 349 / 4, "rtk_float": 187 / 4}, abs=0.01)
    drive = open_flight(real_log("gnss/drive_0708_gnss_1934_sf.pos")).results.answer(GnssReception)
    assert drive is not None
    seconds = {one.state: one.seconds for one in drive.receiver.states}
    assert seconds == pytest.approx({"rtk_fixed": 2189 / 4, "rtk_float": 8 / 4}, abs=0.01)
    assert drive.receiver.motion is not None and drive.receiver.motion.lag_s == pytest.approx(0.126, abs=0.005)


@pytest.mark.real_log
def test_a_receiver_at_odds_with_itself_is_told_in_its_chapter() -> None:
    """Its firmware writes PDOP as HDOP of GGA, accuracies as HDOP and VDOP of GSA, and no height above the sea."""
    results = open_flight(real_log("gnss/inertialsense_Serial38400.nmea")).results
    section = gnss(results)
    assert section is not None
    notes = " ".join(part.text for part in section.parts if isinstance(part, Note))
    assert "GSA says PDOP 1.1 to 1.5, HDOP 1 to 3 and VDOP 1 to 7 in 2307 rows, which cannot be" in notes
    assert "is the PDOP of that GSA in 2307 rows" in notes and "Altitude 0 m, geoid 1382.23 to 1389.34 m" in notes
    found = results.answer(GnssReception)
    assert found is not None and found.receiver.hdop is None and found.receiver.pdop == 1.2
    assert found.receiver.motion is not None
    assert found.receiver.motion.difference_rms_mps == pytest.approx(0.054, abs=0.001)


@pytest.mark.real_log
@pytest.mark.parametrize(
    ("name", "is_advised"), [("gnss/inertialsense_Serial38400.nmea", True), ("gnss/walk_0827_gnss_1730.ubx", False)]
)
def test_gst_is_advised_where_sentences_claim_no_accuracy(name: str, is_advised: bool) -> None:
    section = next_steps(open_flight(real_log(name)).results)
    told = "" if section is None else str(section.parts)
    assert ("the NMEA sentence GST, the accuracy that the receiver claims" in told) is is_advised

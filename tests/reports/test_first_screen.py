"""First screens of recorded logs: what an owner sees in five seconds, by the table of docs/report.md."""

import pytest

import groundstation
from groundstation.chapters.front import front
from groundstation.cli.lines import LONGEST, shortened
from groundstation.pipeline.one_flight.flight import sentence
from groundstation.results.recorded import simulated
from groundstation.systems import systems
from groundstation.tables.simulated import simulated_by
from tests.real_logs import real_log

# Log: colour, word, part of the headline, part of the line on the recording.
OPENS = {
    "dataflash/erle_plane_4-12-2014_329.BIN": ("warn", "Left GNSS", "EKF1 and GNSS up to 181 m", "its end is cut off"),
    "dataflash/copter_3.6.7_log0041.BIN": (
        "bad",
        "Bad",
        "control of attitude lost 1:17.6-1:20.5 with output 2 suspect",
        "nothing logged for 21 s while disarmed",
    ),
    "dataflash/plane_4.2.3_pilot0004.BIN": ("bad", "Bad", "GNSS bad 82 % of the time", "GNSS at 5 Hz"),
    "ulog/px4_rs_esc_status.ulg": ("warn", "Warnings", "Vibration raised 0:12", "40 s of GNSS"),
    "ulog/quadrotor_local.ulg": ("bad", "Bad", "“Low battery” at 1:19", "never a fix"),
    "ulog/sample_px4_events.ulg": ("good", "Good", "GNSS good, filter healthy", "nothing lost"),
    "gnss/walk_0827_gnss_1730_sf.pos": ("warn", "Warnings", "RTK fixed 65 %", "GNSS (RTK fixed 65 %) at 4 Hz"),
    "gnss/drive_0708_gnss_1934_sf.pos": ("good", "Good", "RTK fixed 99.6 %", "9:09 min of GNSS"),
    "g1000/log_220416_161856_LFQA.csv": ("good", "Good", "First fix after 87 s", "3:12 min of GNSS, attitude"),
    "foreign/robot_localization_jackal_test2.bag": ("plain", "Recorded", "61 s of attitude, odometry and IMU", ""),
    "ch10/kc135_429_1553_1MB.c10": ("warn", "Recorded", "0.654 s of words of 10 bus channels without ICD", ""),
    "ulog/Proto_FLT09_REENCODED_fixedwing.ulg": ("bad", "Left GNSS", "INS and GNSS up to 85.1 m", "8:50 min of GNSS"),
    "ulog/pyulog_sample.ulg": ("bad", "Bad", "“no barometer found", "the recorder paused"),
    "ulog/px4_rs_6ba1abc7.ulg": ("bad", "Bad", "Magnetic field wrong throughout", "26 s of GNSS"),
    "dataflash/TestLog2_REENCODED_plane.BIN": ("warn", "Warnings", "Setpoints followed poorly", "nothing lost"),
    "tlog/uavlogviewer_vtol.tlog": ("warn", "Warnings", "Gyro unhealthy throughout", "RTK fixed"),
    "gnss/walk_0827_gnss_1730.ubx": ("warn", "Warnings", "RTK fixed 65 %", "2:14 min of GNSS"),
    "gnss/rtklib_demo1_out.pos": (
        "warn",
        "Warnings",
        "position scatters by 1.0 m at standstill where 5.9 cm is claimed",
        "RTK fixed 72 %",
    ),
    "gnss/inertialsense_Serial38400.nmea": ("good", "Good", "Single (3D) throughout", "19:23 min of GNSS"),
    "gnss/ublox_ins_drive_pvat.ubx": ("good", "Good", "GNSS with INS throughout", "8:46 min of GNSS"),
    "gnss/pygpsdata_testobsdata.log": ("plain", "Recorded", "Messages without navigation", ""),
    "g1000/log_210623_141501_TEST1.csv": ("warn", "Not stabilised", "Landing, runway EGTF 06", "1:18:02 h of GNSS"),
    "approach/coreg.hdf5": ("plain", "Recorded", "1:59:27 h of heading", ""),
    "approach/flight_with_go_around_and_landing.hdf5": (
        "warn",
        "Not stabilised",
        "Landing, runway OMDB 30L",
        "3:43:59 h",
    ),
    "foreign/robot_localization_husky_test1.bag": ("good", "Good", "DGNSS throughout", "6:35 min of GNSS"),
    "inertial/gv_ff02.csv": ("unknown", "No rate", "grew at 0.61", "5:04:34 h of GNSS and INS at 1 Hz"),
}


# Logs of simulators by what they say themselves: ver_hw PX4_SITL or SITL, SIMSTATE; all others are of hardware.
SIMULATED = {
    "ulog/sample_px4_events.ulg": "ver_hw PX4_SITL",
    "ulog/px4_rs_6ba1abc7.ulg": "ver_hw SITL",
    "tlog/uavlogviewer_vtol.tlog": "SIMSTATE",
}

# Their trajectories take seconds.
LONG = {"dataflash/TestLog2_REENCODED_plane.BIN", "foreign/robot_localization_husky_test1.bag"}


@pytest.mark.real_log
@pytest.mark.parametrize("name", [pytest.param(one, marks=pytest.mark.slow) if one in LONG else one for one in OPENS])
def test_a_recorded_log_opens_on_what_its_owner_asks(name: str) -> None:
    tone, word, headline, line = OPENS[name]
    results = groundstation.open(real_log(name)).results
    top = front(results, systems().chapters)
    assert top.verdict is not None and (top.verdict.tone, top.verdict.text) == (tone, word)
    assert headline.lower() in top.headline.lower() and line in top.recorded
    assert "No answer" not in top.line
    told = simulated(results)
    assert told == (f"simulated vehicle ({SIMULATED[name]})" if name in SIMULATED else "")
    line = sentence(results)
    answer = line.removeprefix(f"{told}; ").lower()
    assert word == "Recorded" or answer.startswith(f"{word.lower()}: "), line
    short = shortened(line, LONGEST)
    assert not told or (short.startswith("simulated vehicle") and f"; {answer[:40]}" in short.lower()), short


@pytest.mark.real_log
@pytest.mark.parametrize("folder", ["ulog", "dataflash", "tlog"])
def test_only_logs_of_simulators_are_called_simulated(folder: str) -> None:
    names = [f"{folder}/{one.name}" for one in sorted(real_log(folder).iterdir()) if one.is_file()]
    others = [name for name in names if name not in OPENS or name in LONG]  # the test above asks of those it opens
    assert {name: told for name in others if (told := simulated_by(groundstation.open(real_log(name)).flight))} == {}
    assert set(SIMULATED) <= set(OPENS) - LONG

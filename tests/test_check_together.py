"""Check of logs of one flight as one, and of the logs in a folder: a line each."""

import json
from pathlib import Path

import pytest

from tests.test_verbs import groundstation

PROFILE = """name = "unit"
[recognise]
names = ["t", "gx", "gy", "gz", "ax", "ay", "az"]
[time]
kind = "seconds"
column = "t"
{time}
{metadata}
[columns]
gx = {{ field = "imu.rate_x_dps", unit = "dps" }}
gy = {{ field = "imu.rate_y_dps", unit = "dps" }}
gz = {{ field = "imu.rate_z_dps", unit = "dps" }}
ax = {{ field = "imu.accel_x_mps2", unit = "mps2" }}
ay = {{ field = "imu.accel_y_mps2", unit = "mps2" }}
az = {{ field = "imu.accel_z_mps2", unit = "mps2" }}
"""
START = 'start_utc = "2026-05-04T06:00:00Z"'


@pytest.fixture
def kit(tmp_path: Path) -> Path:
    """Folder with an inertial unit's table without UTC, its profile, and a receiver's log of the same drive."""
    unit = (
        f"{0.01 * n:.2f},0.{n % 9},{0.01 * (n % 3):.2f},{n % 5},0.{n % 7},0.{n % 4},-9.8{n % 6}" for n in range(12000)
    )
    (tmp_path / "imu.csv").write_text("\n".join(unit) + "\n", encoding="utf-8")
    names = "time_s,gnss.latitude_deg,gnss.longitude_deg,gnss.altitude_ellipsoid_m"
    speeds = "gnss.velocity_north_mps,gnss.velocity_east_mps,gnss.velocity_down_mps,gnss.satellites_used"
    fixes = (f"{n},{50 + 9e-5 * n:.6f},8,100,10,0,0,12" for n in range(120))
    text = "\n".join(["# start_utc: 2026-05-04T06:00:00Z", f"{names},{speeds}", *fixes])
    (tmp_path / "gnss.csv").write_text(text + "\n", encoding="utf-8")
    (tmp_path / "readme.txt").write_text("a drive\n", encoding="utf-8")
    with_start(tmp_path)
    return tmp_path


def with_start(folder: Path, *, metadata: str = f"[metadata.set]\n{START}", time: str = "") -> Path:
    """Write the profile of the unit."""
    path = folder / "my.toml"
    path.write_text(PROFILE.format(time=time, metadata=metadata), encoding="utf-8")
    return path


def checked(folder: Path, *arguments: str) -> tuple[int, str, str]:
    """Check both logs of the kit by its profile."""
    logs = (str(folder / name) for name in ("imu.csv", "gnss.csv"))
    return groundstation("check", *logs, "--profile", str(folder / "my.toml"), *arguments)


def test_logs_of_one_flight_are_judged_as_one(kit: Path) -> None:
    code, out, told = checked(kit, "--for", "trajectory")
    assert code == 4 and out.count("usable for trajectory: no") == 2
    assert "logs of one flight are judged as one with --together" in told
    code, out, told = checked(kit, "--for", "trajectory", "--together")
    first = out.splitlines()[0]
    assert "no GNSS receiver" not in first and "no inertial unit" not in first
    assert first.startswith("usable for trajectory: ") and code == (4 if ": no:" in first else 0)
    assert "gnss.b" in out and "gnss.csv is joined by the times of the files" in out
    assert out.splitlines()[-1].startswith("imu.csv + gnss.csv: no data lost")
    size = sum((kit / name).stat().st_size for name in ("imu.csv", "gnss.csv"))
    (one,) = json.loads(checked(kit, "--together", "--json")[1])
    assert one["source"] == "imu.csv + gnss.csv" and one["facts"]["size"] == f"{size} bytes"
    assert {"imu", "gnss.b"} <= set(one["ledger"]["topics"])


def test_together_takes_no_session_and_no_time_bound(kit: Path) -> None:
    code, _out, told = checked(kit, "--together", "--for", "cooperative")
    assert code == 2 and "of several aircraft" in told
    code, _out, told = checked(kit, "--together", "--timeout", "10")
    assert code == 2 and "--together without them" in told


def test_where_nothing_gives_a_clock_the_file_and_the_setting_that_would_are_named(kit: Path) -> None:
    with_start(kit, metadata="")
    code, _out, told = checked(kit, "--together")
    assert code == 1 and "no UTC in imu.csv" in told
    assert "imu.csv gets UTC by start_utc under [metadata.set] of my.toml, or by imu.csv.tag" in told
    (kit / "imu.csv.tag").write_bytes(b"")
    _code, _out, told = checked(kit, "--together")
    assert "imu.csv gets UTC by imu.csv.tag beside it: rtklib_tag = true under [time] of my.toml" in told
    head = "# start_utc: 2026-05-04T06:00:00Z\n"
    (kit / "gnss.csv").write_text((kit / "gnss.csv").read_text(encoding="utf-8").removeprefix(head), encoding="utf-8")
    _code, _out, told = checked(kit, "--together")
    assert "no UTC in imu.csv and gnss.csv" in told and "gnss.csv gets UTC by a line `# start_utc: ...` on top" in told


def test_info_shows_logs_of_one_flight_as_one(kit: Path) -> None:
    logs = str(kit / "imu.csv"), str(kit / "gnss.csv")
    code, out, _told = groundstation("info", *logs, "--profile", str(kit / "my.toml"), "--together", "--json")
    shown = json.loads(out)
    assert code == 0 and {one["name"] for one in shown["topics"]} >= {"imu", "gnss.b"}
    assert "imu.csv" in shown["facts"]["file"] and "gnss.csv" in shown["facts"]["file"]
    size = sum((kit / name).stat().st_size for name in ("imu.csv", "gnss.csv"))
    assert shown["facts"]["size"] == f"{size} bytes"
    code, out, told = groundstation("info", *logs, "--profile", str(kit / "my.toml"))
    assert code == 0 and len(out.splitlines()) == 2 and "2 logs" in told
    assert groundstation("info", logs[1], "--together")[0] == 2


def test_an_empty_file_of_a_folder_is_told_as_empty(kit: Path) -> None:
    (kit / "nothing.csv").write_bytes(b"")
    code, _out, told = groundstation("check", str(kit), "--profile", str(kit / "my.toml"))
    assert code == 0 and "1 other file that no reader claims; 1 empty file" in told


def test_a_folder_is_a_line_for_each_log(kit: Path) -> None:
    profile = ("--profile", str(kit / "my.toml"))
    code, out, told = groundstation("check", str(kit), *profile)
    assert code == 0
    assert [line.split("  ")[0] for line in out.splitlines()] == ["gnss.csv", "imu.csv"]
    assert "no data lost" in out and "2 logs" in told and "1 other file that no reader claims" in told
    assert groundstation("check", str(kit), *profile, "--timeout", "60")[:2] == (0, out)
    code, out, _told = groundstation("check", str(kit), *profile, "--for", "trajectory")
    assert code == 4 and out.startswith("gnss.csv  no: no inertial unit")
    code, out, told = groundstation("info", str(kit), *profile)
    assert code == 0 and "2 logs; 1 other file that no reader claims" in told
    start = "2026-05-04T06:00:00.000Z to 2026-05-04T06:01:59"
    assert out.splitlines()[0].startswith(f"gnss.csv  flat-csv  {start}") and "120 rows" in out.splitlines()[0]
    assert groundstation("info", str(kit), *profile, "--timeout", "60")[:2] == (0, out)
    both = json.loads(groundstation("info", str(kit), *profile, "--json")[1])
    assert [Path(one["source"]).name for one in both] == ["gnss.csv", "imu.csv"]


def test_a_folder_without_a_log_is_refused(tmp_path: Path) -> None:
    (tmp_path / "readme.txt").write_text("nothing\n", encoding="utf-8")
    for verb in ("check", "info"):
        code, _out, told = groundstation(verb, str(tmp_path))
        assert code == 2 and "no log among 1 file, expected a log, or a folder with logs" in told


def test_a_log_of_a_folder_that_cannot_be_read_stops_no_other(kit: Path) -> None:
    (kit / "bad.csv").write_text("time_s,ins.true_heading_deg\n", encoding="utf-8")
    for verb in ("check", "info"):
        code, out, told = groundstation(verb, str(kit), "--profile", str(kit / "my.toml"))
        assert code == 1 and "bad.csv" in out + told and len(out.splitlines()) >= 2

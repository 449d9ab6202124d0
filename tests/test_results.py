"""Results: saved and loaded without loss, rounded as stated, NaN as null, nothing half written."""

import csv
import io
import json
from pathlib import Path

import numpy as np
import pytest

from groundstation.base.errors import UnreadableLogError
from groundstation.base.serial import to_json
from groundstation.results.figures import FigureData
from groundstation.results.files import csv_text, json_text, save, write_text
from groundstation.results.summary import digits_of, summary_of
from tests.report_example import MANIFEST, example, figure, heading_result
from tests.saved import load


def test_saved_flight_loads_as_it_was(tmp_path: Path) -> None:
    results = example(heading_result())
    save(tmp_path, results, MANIFEST)
    saved = load(tmp_path)
    assert saved.summary == summary_of(results) and saved.manifest == MANIFEST
    assert set(saved.figures) == {item.name for item in results.figures}
    for item in results.figures:
        loaded = saved.figure(item.name)
        assert loaded is not None and list(loaded.columns) == list(item.columns)
        for name, values in item.columns.items():
            assert loaded[name].dtype.kind == values.dtype.kind, (item.name, name)
            np.testing.assert_array_equal(loaded[name], values)


@pytest.mark.parametrize("values", [[], ["a"], ["", "=1", "\udcff", "日本"]])
def test_text_columns_survive(tmp_path: Path, values: list[str]) -> None:
    text = FigureData("t", {"state": np.array(values, dtype=np.str_), "digit": np.zeros(len(values))}, {"digit": 2})
    save(tmp_path, example(None, figures=(text,)), MANIFEST)
    loaded = load(tmp_path).figures["t"]
    assert loaded["state"].dtype.kind == "U" and len(loaded["state"]) == len(values)
    assert dict(loaded.digits) == {"digit": 2}
    assert (load(tmp_path).figure("t") is None) == (not values)


def test_arrays_of_results_are_read_only() -> None:
    with pytest.raises(ValueError, match="read-only"):
        figure("x", time_s=[1.0])["time_s"][0] = 2.0


def test_earlier_results_are_replaced(tmp_path: Path) -> None:
    save(tmp_path, example(heading_result()), MANIFEST)
    save(tmp_path, example(None, figures=()), MANIFEST)
    assert not load(tmp_path).figures and not list((tmp_path / "tables").iterdir())


def test_results_that_were_cut_short_do_not_look_finished(tmp_path: Path) -> None:
    save(tmp_path, example(None), MANIFEST)
    uneven = FigureData("uneven", {"a": np.zeros(2), "b": np.zeros(3)}, {})
    with pytest.raises(ValueError):
        save(tmp_path, example(None, figures=(uneven,)), MANIFEST)
    with pytest.raises(UnreadableLogError):
        load(tmp_path)


@pytest.mark.parametrize("content", ["", "[1, 2]", "{", '"text"', "\udcff"])
def test_summary_that_is_no_object_is_refused(tmp_path: Path, content: str) -> None:
    save(tmp_path, example(None), MANIFEST)
    (tmp_path / "summary.json").write_bytes(content.encode("utf-8", "surrogateescape"))
    with pytest.raises(UnreadableLogError, match=r"summary\.json"):
        load(tmp_path)


def test_arrays_in_a_folder_of_the_earlier_name_are_read_and_go_with_the_next_run(tmp_path: Path) -> None:
    save(tmp_path, example(heading_result()), MANIFEST)
    expected = set(load(tmp_path).figures)
    (tmp_path / "arrays").rename(tmp_path / "results.parquet")
    saved = load(tmp_path)
    assert set(saved.figures) == expected and len(saved.figures["heading_samples"])
    save(tmp_path, example(heading_result()), MANIFEST)
    assert not (tmp_path / "results.parquet").exists() and set(load(tmp_path).figures) == expected


def test_columns_of_an_earlier_name_are_read_by_their_new_one(tmp_path: Path) -> None:
    columns = {"magnetic_heading_deg": np.array([0.5]), "deviation_recommended_deg": np.array([2.0])}
    curves = FigureData("magnetic_curves", columns, {"deviation_recommended_deg": 4})
    other = FigureData("magnetic_ground_curve", {"magnetic_heading_deg": np.array([0.5])}, {})
    save(tmp_path, example(None, figures=(curves, other)), MANIFEST)
    figures = load(tmp_path).figures
    assert list(figures["magnetic_curves"].columns) == ["uncorrected_magnetic_heading_deg", "deviation_to_add_deg"]
    assert figures["magnetic_curves"].digits["deviation_to_add_deg"] == 4
    assert list(figures["magnetic_ground_curve"].columns) == ["magnetic_heading_deg"]


def test_parquet_that_is_broken_is_refused(tmp_path: Path) -> None:
    save(tmp_path, example(None), MANIFEST)
    (tmp_path / "arrays" / "overview.parquet").write_bytes(b"PAR1 no")
    with pytest.raises(UnreadableLogError, match=r"overview\.parquet"):
        load(tmp_path)


def test_figures_are_read_when_they_are_asked_for(tmp_path: Path) -> None:
    save(tmp_path, example(heading_result()), MANIFEST)
    path = tmp_path / "arrays" / "overview.parquet"
    content = path.read_bytes()
    path.write_bytes(content[:4] + bytes(len(content) - 8) + content[-4:])  # whole at its ends alone
    saved = load(tmp_path)
    assert "overview" in saved.figures and list(saved.figures) == sorted(saved.figures)
    first = saved.figures["heading_samples"]
    assert saved.figures["heading_samples"] is first and saved.figure("none") is None
    with pytest.raises(UnreadableLogError, match=r"overview\.parquet"):
        saved.figure("overview")


def test_failed_write_leaves_the_old_file_and_no_partial(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.txt"
    write_text(path, "old")

    def fail(self: Path, data: bytes) -> int:
        open(self, "wb").write(data[:1])  # noqa: SIM115, PTH123 - half a file, as a full disk leaves it
        raise OSError("no space left")

    with monkeypatch.context() as patched:
        patched.setattr(Path, "write_bytes", fail)
        with pytest.raises(OSError, match=r"no space.*a\.txt"):
            write_text(path, "new")
    assert path.read_text() == "old" and [item.name for item in tmp_path.iterdir()] == ["a.txt"]


def test_file_names_that_are_not_utf8_are_written_and_read_back(tmp_path: Path) -> None:
    write_text(tmp_path / "a.json", json_text({"name": "x\udcff"}))
    assert json.loads((tmp_path / "a.json").read_text(encoding="utf-8")) == {"name": "x\udcff"}


def test_json_refuses_nan() -> None:
    with pytest.raises(ValueError, match="Out of range"):
        json_text({"a": float("nan")})


def test_numbers_are_rounded_by_their_unit_without_minus_zero() -> None:
    assert to_json({"error_deg": 0.00004}) == {"error_deg": 0.0}
    assert str(to_json(-1e-9, "error_deg")) == "0.0"
    assert to_json((1.23456, float("inf")), "residual_arcmin") == [1.23, None]
    assert to_json(np.array([1.23456789, np.nan]), "speed_of_mean_mps") == [1.2346, None]
    assert to_json({"a": np.int64(3), "b": np.bool_(True), "c": None, "d": "x"}) == {
        "a": 3,
        "b": True,
        "c": None,
        "d": "x",
    }


@pytest.mark.parametrize(
    ("name", "places"),
    [
        *(("latitude_deg", 7), ("error_deg", 4), ("time_s", 3), ("density_per_deg", 4), ("samples", 6)),
        *(("lever_arm_m", 3), ("drift_windows_rms_m", 3), ("east_tilt_arcsec", 3), ("horizon_min", 3)),
        *(("north_drift_sigma_dph", 6), ("east_drift_rate_dphph", 6), ("start_h", 4)),
        ("radial_error_rate_95_nmiph", 4),
    ],
)
def test_digits_follow_the_name(name: str, places: int) -> None:
    assert digits_of(name) == places


def test_summary_is_plain_json_with_null_for_nan() -> None:
    heading = heading_result(error_deg=float("nan"), confidence95_deg=(float("nan"), 1.0))
    summary = json.loads(json_text(summary_of(example(heading))))
    assert summary["results"]["heading"]["error_deg"] is None
    assert summary["results"]["heading"]["confidence95_deg"] == [None, 1.0]
    assert "figures" not in summary["results"]["heading"]


def test_tables_are_readable_and_safe() -> None:
    data = FigureData(
        "t",
        {
            "time_s": np.array([-1e-9, 2.5, np.nan]),
            "rows": np.array([-1, 2, 3]),
            "used": np.array([True, False, True]),
            "state": np.array(["=1+1", 'a,"b"', "-x"]),
            "mixed": np.array(["@x", "b\nc", "d"], dtype=object),
            "gain": np.array([1.25, -2.0, np.inf]),
        },
        {"gain": 1},
    )
    rows = list(csv.reader(io.StringIO(csv_text(data))))
    assert rows[0] == ["time_s", "rows", "used", "state", "mixed", "gain"]
    assert rows[1] == ["0.000", "-1", "1", "'=1+1", "'@x", "1.2"]
    assert rows[2] == ["2.500", "2", "0", 'a,"b"', "b c", "-2.0"]
    assert rows[3] == ["", "3", "1", "'-x", "d", ""]

"""What the later steps of a run import is there when its log has been read."""

import sys
from pathlib import Path
from threading import Event, get_ident

import pytest

from groundstation.pipeline.one_flight import ahead
from groundstation.pipeline.one_flight.ahead import imported_meanwhile


def _module(folder: Path, name: str, text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    (folder / f"{name}.py").write_text(text, encoding="utf-8")
    monkeypatch.syspath_prepend(str(folder))
    monkeypatch.delitem(sys.modules, name, raising=False)


def test_modules_are_whole_at_the_end_and_made_by_another_thread(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    _module(tmp_path, "late_module", "import threading\nmade_by = threading.get_ident()\n", monkeypatch)
    monkeypatch.setattr(ahead, "COMPUTING", ("late_module",))
    with imported_meanwhile(with_pages=False):
        pass
    assert sys.modules["late_module"].made_by not in (None, get_ident())


def test_what_cannot_be_imported_is_left_to_who_needs_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    _module(tmp_path, "broken_module", "raise ValueError('broken')\n", monkeypatch)
    _module(tmp_path, "sound_module", "", monkeypatch)
    monkeypatch.setattr(ahead, "COMPUTING", ("broken_module", "sound_module"))
    with imported_meanwhile(with_pages=False):
        pass
    assert "sound_module" in sys.modules and "broken_module" not in sys.modules


def test_a_log_that_cannot_be_read_waits_for_no_further_module(monkeypatch: pytest.MonkeyPatch) -> None:
    begun, may_go_on, imported = Event(), Event(), list[str]()

    def imports(name: str) -> None:
        imported.append(name)
        begun.set()
        may_go_on.wait(10.0)

    class Failing(Event):  # type: ignore[misc]
        def set(self) -> None:
            super().set()
            may_go_on.set()

    monkeypatch.setattr(ahead, "Event", Failing)
    monkeypatch.setattr(ahead, "import_module", imports)
    with pytest.raises(OSError, match="full"), imported_meanwhile(with_pages=True):
        assert begun.wait(10.0)
        raise OSError("the disk is full")
    assert imported == [ahead.COMPUTING[0]]


def test_a_run_of_results_alone_imports_nothing_that_draws(monkeypatch: pytest.MonkeyPatch) -> None:
    imported = list[str]()
    monkeypatch.setattr(ahead, "import_module", imported.append)
    with imported_meanwhile(with_pages=False):
        pass
    assert imported == list(ahead.COMPUTING)


def test_who_waits_for_flights_imports_what_makes_a_fleet_of_them(monkeypatch: pytest.MonkeyPatch) -> None:
    imported = list[str]()
    monkeypatch.setattr(ahead, "import_module", imported.append)
    with ahead.fleet_imported_meanwhile(with_pages=False):
        pass
    assert imported == ["cattrs"]
    with ahead.fleet_imported_meanwhile(with_pages=True):
        pass
    assert imported[1:] == ["cattrs", *ahead.FLEET_DRAWING]

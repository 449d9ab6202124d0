"""What fuzzing ever found stays mended, and the first mutations of every format pass (`make fuzz` makes thousands)."""

import json
import tempfile
import time
from pathlib import Path
from typing import Any

import pytest

from groundstation.base.records import Damage, RecordBatch
from groundstation.pipeline.one_flight.log import open_log
from tests.fuzz import __main__ as every_format
from tests.fuzz.bases import FORMATS, base_named, bases
from tests.fuzz.mutation import KINDS, Mutant
from tests.fuzz.trial import Case, Watch, edits_of, run_case, suffix_of, try_file
from tests.fuzz.verbs import Answer, disagreements, faults_of, limit_of

CORPUS = Path(__file__).parent / "fuzz" / "corpus" / "found.jsonl"
FOUND = [json.loads(line) for line in CORPUS.read_text(encoding="utf-8").splitlines()]
SEEDS = 5  # of each format, in the suite; `.ci/slow` takes 500


@pytest.fixture(scope="module")
def watch() -> Watch:
    return Watch()


@pytest.mark.parametrize("entry", FOUND, ids=[entry["was"][:60] for entry in FOUND])
def test_what_was_found_stays_mended(entry: dict[str, Any], tmp_path: Path) -> None:
    base, other = base_named(entry["base"]), base_named(entry["other"])
    if base is None or other is None:
        pytest.skip(f"recorded log behind {entry['base']} is not here (GROUNDSTATION_REAL_LOGS)")
    path = tmp_path / f"log{suffix_of(base.format)}"
    path.write_bytes(Mutant(base.data, other.data, entry["edits"]).content)
    came_to = try_file(path, tmp_path, is_deep=True)
    if entry.get("keeps_records"):
        items = list(open_log(path).items())
        assert came_to != "refused" and sum(len(item) for item in items if isinstance(item, RecordBatch)) > 0
        kinds = {item.kind for item in items if isinstance(item, Damage)}
        assert not (entry.get("is_whole") and "truncated" in kinds)


@pytest.mark.parametrize("format_name", FORMATS)
def test_the_first_mutations_pass(
    format_name: str, tmp_path: Path, watch: Watch, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))  # as in the child processes of the long run
    for seed in range(SEEDS):
        found = run_case(Case(format_name, seed), tmp_path, watch)
        assert found["came_to"] not in ("crash", "escape"), (seed, found["fault"])


@pytest.mark.parametrize("format_name", FORMATS)
def test_the_sound_logs_are_read_whole_and_the_harmful_ones_in_time(format_name: str, tmp_path: Path) -> None:
    for base in bases(format_name, recorded=False):
        path = tmp_path / f"log{suffix_of(format_name)}"
        path.write_bytes(base.data)
        if base.is_harmful:
            began = time.process_time()
            try_file(path, tmp_path, is_deep=True)
            assert time.process_time() - began < 2.0 * limit_of(len(base.data)), "twice: code may be compiled"
        else:
            assert try_file(path, tmp_path, is_deep=True) == "read", base.name


def test_every_kind_of_edit_is_drawn_and_a_seed_gives_the_same_file() -> None:
    met = set()
    for seed in range(60):
        base, other, edits = edits_of(Case("flat-csv", seed))
        again = edits_of(Case("flat-csv", seed))[2]
        restored = json.loads(json.dumps(edits))
        assert edits == again
        assert Mutant(base.data, other.data, restored).content == Mutant(base.data, other.data, edits).content
        met |= {edit[0] for edit in edits}
    assert met == set(KINDS)


def test_a_mutant_knows_what_was_not_touched() -> None:
    mutant = Mutant(b"0123456789", b"abc", [("splice", 2, 0, 2, False), ("flip", 6, 0), ("truncate", 10)])
    assert mutant.content == b"01ab235567"
    assert [mutant.is_kept(at, at + 1) for at in range(10)] == [True] * 4 + [False] + [True] * 3 + [False] * 2


def test_without_names_every_format_is_taken(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.argv", ["tests.fuzz", "--cases", "0"])
    assert every_format.main() == 0
    assert [line.split()[0] for line in capsys.readouterr().out.splitlines()] == list(FORMATS)


@pytest.mark.parametrize(
    ("answer", "count"),
    [
        (Answer(0, "flight", "", 0.1), 0),
        (Answer(1, "", "error: a.csv: no readable record\n", 0.1), 0),
        (Answer(1, "", "error: a.csv: internal error (IndexError: 0); please report it\n", 0.1), 1),
        (Answer(1, "", "error: a.csv: one\nerror: two\n", 0.1), 1),
        (Answer(3, "", "x.py:1: RuntimeWarning: overflow\n", 0.1), 1),
        (Answer(2, "", "error: a.csv: no such file\n", 0.1), 2),
    ],
)
def test_what_a_verb_must_never_do_is_seen(answer: Answer, count: int) -> None:
    assert len(list(faults_of("run", answer))) == count


def test_verbs_that_differ_are_seen() -> None:
    lost, done = Answer(3, "", "", 0.1), Answer(0, "", "", 0.1)
    assert not list(disagreements({"check": lost, "run": lost}))
    assert len(list(disagreements({"check": lost, "run": done}))) == 1

"""Texts that users write: sound ones are accepted, damaged ones refused in one line (`tests.fuzz.documents`)."""

from pathlib import Path

import pytest

from groundstation.base.errors import MOST_SHOWN, GroundstationError, SettingsError
from groundstation.base.toml_text import MAX_BYTES, toml_table, toml_text
from groundstation.pipeline.one_flight.intervals import flight_seconds
from tests.fuzz.documents import KINDS, LOADERS, TextCase, bases, run_text, text_of
from tests.fuzz.trial import Watch

SEEDS = 12  # of each kind, in the suite


@pytest.fixture(scope="module")
def watch() -> Watch:
    return Watch()


@pytest.mark.parametrize("kind", KINDS)
def test_sound_texts_are_accepted(kind: str, tmp_path: Path) -> None:
    for number, text in enumerate(bases(kind)):
        path = tmp_path / f"{number}.{'yaml' if kind == 'icd' else 'toml'}"
        path.write_text(text, encoding="utf-8")
        LOADERS[kind](path)


@pytest.mark.parametrize("kind", KINDS)
def test_the_first_mutations_are_accepted_or_refused_in_a_line(kind: str, tmp_path: Path, watch: Watch) -> None:
    for seed in range(SEEDS):
        found = run_text(TextCase(kind, seed), tmp_path, watch)
        assert not found["fault"], (seed, found["fault"])


def test_mutations_differ_from_the_text_and_repeat() -> None:
    texts = [text_of(TextCase("settings", seed)) for seed in range(40)]
    assert texts == [text_of(TextCase("settings", seed)) for seed in range(40)]
    assert len(set(texts) - {one.encode() for one in bases("settings")}) > 30


def test_what_is_no_toml_is_told_in_a_line(tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match=r"a\.toml: found not TOML \(brackets in brackets, too many\)"):
        toml_table("a = " + "[" * 3000, "a.toml")
    path = tmp_path / "a.toml"
    path.write_bytes(b"a = '\xff'")
    with pytest.raises(SettingsError, match=r"text that is not UTF-8 \(byte 6: 0xff\)"):
        toml_text(path, "a.toml")
    path.write_bytes(b"\xef\xbb\xbfa = 1")
    assert toml_table(toml_text(path, "a.toml"), "a.toml") == {"a": 1}
    with path.open("wb") as file:
        file.truncate(MAX_BYTES + 1)
    with pytest.raises(SettingsError, match="more than 16 MiB"):
        toml_text(path, "a.toml")
    with pytest.raises(SettingsError, match="no such file"):
        toml_text(tmp_path / "b.toml", "b.toml")


def test_an_error_quotes_no_more_than_a_line_holds() -> None:
    told = str(GroundstationError("a.toml", "y" * 5000, "a number"))
    assert told == f"a.toml: found {'y' * MOST_SHOWN} ... (5000 characters), expected a number"


def test_an_error_does_not_drive_the_terminal() -> None:
    assert str(GroundstationError("\x1b[2Ja.csv", "a\0b", "no\nbreak")) == "?[2Ja.csv: found a?b, expected no break"


@pytest.mark.parametrize("text", ["+" + "9" * 400 + ":00", "9" * 400])
def test_a_time_of_too_many_digits_is_no_time(text: str) -> None:
    with pytest.raises(SettingsError, match="flight seconds"):
        flight_seconds(text, 0, True)


def test_a_number_of_too_many_digits_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "p.toml"
    path.write_text(bases("profile")[0].replace('unit = "ft" }', f'unit = "ft", offset = {"9" * 400} }}', 1))
    with pytest.raises(SettingsError, match="offset: found a number of 400 digits"):
        LOADERS["profile"](path)

"""Long tables are written a column at a time, and their text is that of the plain way."""

import numpy as np
import pytest

from groundstation.results.csv_table import LEAST_ROWS, ROWS_AT_ONCE, csv_text, long_rows, short_rows
from groundstation.results.figures import FigureData

ROWS = LEAST_ROWS + 37
RNG = np.random.default_rng(52)
SIZES = 10.0 ** RNG.uniform(-9.0, 14.0, ROWS) * RNG.choice([-1.0, 1.0], ROWS)
KNOWN = {
    "gaps": np.where(RNG.random(ROWS) < 0.3, np.nan, RNG.normal(0.0, 300.0, ROWS)),
    "endless": np.where(RNG.random(ROWS) < 0.3, -np.inf, RNG.normal(0.0, 3.0, ROWS)),
    "all unknown": np.full(ROWS, np.nan),
    "zeros": np.where(RNG.random(ROWS) < 0.5, -0.0, 0.0),
    "minus nothing": RNG.uniform(-0.001, 0.0, ROWS),
    "halves": RNG.integers(-2000, 2000, ROWS) / 8.0,  # exact ties
    "edges of a group": RNG.choice([9999.0, 10000.0, 9999.9996, 99999999.0, 1e8, -1e8], ROWS),
    "float32": RNG.normal(0.0, 40.0, ROWS).astype(np.float32),
    "integers": RNG.integers(-(2**62), 2**62, ROWS),
    "small": RNG.integers(-128, 127, ROWS).astype(np.int8),
    "unsigned": RNG.integers(0, 2**63, ROWS, dtype=np.uint64),
    "flags": RNG.random(ROWS) < 0.5,
    "texts": RNG.choice(["", "=1+1", 'a,"b"', "-x", "größer", "b\nc", "\0", "\udc80"], ROWS),
    "objects": RNG.choice(np.array(["@x", "y"], dtype=object), ROWS),
    "nothing": np.full(ROWS, ""),
}


@pytest.mark.parametrize("name", KNOWN)
@pytest.mark.parametrize("places", range(7))
def test_a_long_table_reads_as_a_short_one(name: str, places: int) -> None:
    columns = [(KNOWN[name], places), (np.arange(ROWS), 0)]
    found = long_rows(columns, "\r\n")
    assert found is not None
    assert found == short_rows(columns, "\r\n")


@pytest.mark.parametrize("places", range(16))
def test_numbers_of_every_size_keep_their_digits(places: int) -> None:
    values = SIZES[np.abs(SIZES) * 10.0**places < 9e14]
    values = np.resize(values, ROWS)
    assert long_rows([(values, places)], "\n") == short_rows([(values, places)], "\n")


def test_the_places_of_a_table_longer_than_a_block() -> None:
    count = 2 * ROWS_AT_ONCE + 5
    figure = FigureData("t", {"time_s": np.arange(count) * 0.1, "north_m": RNG.normal(0.0, 1e5, count)}, {})
    lines = csv_text(figure).split("\n")
    assert len(lines) == count + 2
    assert lines[1 + ROWS_AT_ONCE].split(",")[0] == f"{ROWS_AT_ONCE * 0.1:.3f}"
    assert lines[count].split(",")[0] == f"{(count - 1) * 0.1:.3f}"


@pytest.mark.parametrize(
    "values",
    [
        np.full(ROWS, 1e15),
        np.full(ROWS, -(2**63)),
        np.full(ROWS, 2**64 - 1, dtype=np.uint64),
        np.full(ROWS, "x" * 65),
        np.zeros(LEAST_ROWS - 1),
    ],
)
def test_what_cannot_be_written_by_columns_is_written_plainly(values: np.ndarray) -> None:
    assert long_rows([(values, 0)], "\n") is None
    assert (
        csv_text(FigureData("t", {"a": values}, {"a": 0})).split("\n")[1:-1]
        == short_rows([(values, 0)], "\n").split("\n")[1:]
    )


def test_columns_of_unequal_length_are_refused() -> None:
    with pytest.raises(ValueError, match="argument 2 is longer"):
        csv_text(FigureData("t", {"a": np.zeros(ROWS), "b": np.zeros(ROWS + 1)}, {}))

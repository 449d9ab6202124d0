"""sample_logs/ is what make_sample_logs writes, byte for byte, and it is small."""

from pathlib import Path

import pytest

from groundstation.simulation.samples import SAMPLES, make_sample_logs

SHIPPED = Path(__file__).parents[2] / "sample_logs"
LARGEST_BYTES = 350_000
TOTAL_BYTES = 1_500_000


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("sample_logs")
    make_sample_logs(folder)
    return folder


@pytest.mark.parametrize("name", [*(f"{name}.csv" for name in SAMPLES), "README.md"])
def test_shipped_bytes_are_made_again(made: Path, name: str) -> None:
    assert (SHIPPED / name).read_bytes() == (made / name).read_bytes()


def test_nothing_else_is_shipped_and_it_is_small(made: Path) -> None:
    files = {path.name: path.stat().st_size for path in SHIPPED.iterdir()}
    assert set(files) == {path.name for path in made.iterdir()}
    assert max(files.values()) < LARGEST_BYTES and sum(files.values()) < TOTAL_BYTES


def test_readme_tells_the_truth_of_every_log(made: Path) -> None:
    text = (made / "README.md").read_text(encoding="utf-8")
    assert all(text.count(f"`{name}.csv`") >= 2 for name in SAMPLES)
    assert "| `taxi-good.csv` | +1.20 | +0.05 | 352.40 | 352.41 | 3.0 | 6 |" in text

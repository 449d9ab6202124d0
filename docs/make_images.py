"""Make the README's pictures again: `python docs/make_images.py` (a Vulkan driver and poppler needed)."""

import io
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

from tests import viewer_shots  # noqa: E402

IMAGES = ROOT / "docs" / "images"
LOG = ROOT / "sample_logs" / "taxi-good.csv"
TABS = {"Overview": "overview", "Heading": "heading"}
PLAYHEAD_S = 9000.0  # behind the second of the paper's four starts
LONG_FLIGHT, LONG_TABS = "norilsk-moscow", {"INS errors": "inertial", "Forecast": "forecast"}
COLOURS = 128


def save(png: bytes, name: str) -> None:
    """Keep a picture with few colours: it is looked at, not measured."""
    image = Image.open(io.BytesIO(png)).convert("RGB").quantize(COLOURS)
    image.save(IMAGES / f"{name}.png", optimize=True)


def groundstation(*arguments: str) -> None:
    """Run the command line."""
    subprocess.run([sys.executable, "-m", "groundstation", *arguments], check=True)


def shoot(log: Path, home: Path, tabs: dict[str, str], playhead_s: float | None = None) -> Path:
    """Run a log, keep a picture of the first page of each tab, return the flight's folder."""
    groundstation("run", str(log), "-o", str(home / log.stem))
    flight = next(path.parent for path in (home / log.stem).glob("*/manifest.json"))
    wanted = dict(tabs)
    with viewer_shots.viewer(next(flight.glob("*.rrd")), home) as client:
        if playhead_s is not None:
            client.set_time(timeline="flight_time", duration=playhead_s)
        for name, _ in viewer_shots.pages(client):
            picture = wanted.pop(name.strip(" /").partition("#")[0].strip(), None)
            if picture:
                save(viewer_shots.settled(client), picture)
    return flight


def main() -> None:
    """Run the sample and a simulated long flight, shoot their tabs and the first page of the report."""
    IMAGES.mkdir(exist_ok=True)
    viewer_shots.WINDOW = "1600x1000"
    with tempfile.TemporaryDirectory() as folder:
        home = Path(folder)
        flight = shoot(LOG, home, TABS)
        groundstation("simulate", LONG_FLIGHT, "-o", str(home))
        shoot(home / f"{LONG_FLIGHT}.csv", home, LONG_TABS, PLAYHEAD_S)
        groundstation("report", str(flight), "--pdf")
        pdf, page = flight / "report.pdf", home / "page"
        subprocess.run(["pdftoppm", "-r", "80", "-f", "1", "-l", "1", "-singlefile", "-png", pdf, page], check=True)
        save(page.with_suffix(".png").read_bytes(), "report")


if __name__ == "__main__":
    main()

"""Make the README's pictures again: `python docs/make_images.py` (a Vulkan driver, Chromium and poppler needed)."""

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
COLOURS = 128
CHROMIUM = (
    *("chromium", "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync", "--no-pdf-header-footer"),
)


def save(png: bytes, name: str) -> None:
    """Keep a picture with few colours: it is looked at, not measured."""
    image = Image.open(io.BytesIO(png)).convert("RGB").quantize(COLOURS)
    image.save(IMAGES / f"{name}.png", optimize=True)


def main() -> None:
    """Run the sample, shoot two tabs and the first page of the report."""
    IMAGES.mkdir(exist_ok=True)
    viewer_shots.WINDOW = "1600x1000"
    with tempfile.TemporaryDirectory() as folder:
        home = Path(folder)
        subprocess.run([sys.executable, "-m", "groundstation", "run", str(LOG), "-o", str(home / "out")], check=True)
        flight = next(path.parent for path in (home / "out").glob("*/manifest.json"))
        with viewer_shots.viewer(next(flight.glob("*.rrd")), home) as client:
            for name, _ in viewer_shots.pages(client):
                tab = TABS.get(name.strip(" /").partition("#")[0].strip())
                if tab:
                    save(viewer_shots.settled(client), tab)
                    TABS.pop(next(key for key, value in TABS.items() if value == tab))
        pdf, page = home / "report.pdf", home / "page"
        profile = f"--user-data-dir={home / 'chromium'}"
        report = (flight / "report.html").as_uri()
        subprocess.run([*CHROMIUM, profile, f"--print-to-pdf={pdf}", report], check=True, capture_output=True)
        subprocess.run(["pdftoppm", "-r", "80", "-f", "1", "-l", "1", "-singlefile", "-png", pdf, page], check=True)
        save(page.with_suffix(".png").read_bytes(), "report")


if __name__ == "__main__":
    main()

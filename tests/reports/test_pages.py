"""Every kind of page in a browser: nothing fails, no panel is blank, and without scripts nothing is missing."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from groundstation.pipeline.verbs.acceptance import accept
from groundstation.pipeline.verbs.compare import compare
from groundstation.reports.acceptance import write_acceptance_report
from groundstation.reports.fleet_report import write_fleet_report
from groundstation.results.files import save
from groundstation.systems import systems
from tests.acceptance_example import save_fleet
from tests.browser import Browser
from tests.plot_cases import CASES
from tests.report_example import MANIFEST
from tests.reports.test_fleet_report import fleet_of
from tests.saved import write_flight_report
from tests.test_compare import saved_example
from tests.told import comparison_html

# A picture becomes live where it is seen: the page is gone through from top to bottom.
SEE_ALL = """(async () => {
    const frame = () => new Promise((done) => requestAnimationFrame(done)), end = Date.now() + 20000;
    for (const host of document.querySelectorAll(".plot[data-live]")) {
        host.scrollIntoView();
        while (!host.classList.contains("is-live") && Date.now() < end) await frame();
    }
    return document.querySelectorAll(".plot[data-live]:not(.is-live)").length;
})()"""
# Titles of the panels that have nothing but axes: within the frame no colour but that of the grid, or none.
BLANK = """(() => {
    const all = JSON.parse(document.getElementById("live")?.textContent ?? '{"figures": []}').figures, found = [];
    for (const host of document.querySelectorAll(".plot.is-live")) {
        const panels = all[Number(host.dataset.live)];
        host.querySelectorAll(".uplot canvas").forEach((canvas, at) => {
            const { left, top, width, height } = canvas.parentElement.querySelector(".u-over").style;
            const [x, y, wide, high] = [left, top, width, height].map((text) => Math.round(parseFloat(text)));
            const pixels = canvas.getContext("2d").getImageData(x + 2, y + 2, wide - 4, high - 4).data;
            const colours = new Set();
            for (let place = 0; place < pixels.length; place += 4) {
                if (pixels[place + 3]) colours.add(pixels.slice(place, place + 3).join());
            }
            if (colours.size < 2) found.push(panels[at].titles.join(" / "));
        });
    }
    return found;
})()"""
PICTURES = """[...document.querySelectorAll(".plot > svg")].map((svg) => {
    const box = svg.getBoundingClientRect();
    return [box.width, box.height, svg.querySelectorAll("path, text").length];
})"""
# What is written into each canvas, and where.
NOTE_TEXTS = """(() => {
    const write = CanvasRenderingContext2D.prototype.fillText;
    window.written = new Map();
    CanvasRenderingContext2D.prototype.fillText = function (text, x, y, ...rest) {
        if (!written.has(this.canvas)) written.set(this.canvas, []);
        const { e, f } = this.getTransform();
        written.get(this.canvas).push([text, Math.round(x + e), Math.round(y + f)]);
        return write.call(this, text, x, y, ...rest);
    };
})()"""
# The axes of numbers: each the places of its ticks in pixels, with what they say.
AXES = """[...written.values()].flatMap((texts) => [1, 2].flatMap((along) => {
    const axes = new Map();
    for (const one of texts) {
        const value = Number(one[0].replace("\u2212", "-"));
        if (!Number.isFinite(value)) continue;
        axes.set(one[3 - along], (axes.get(one[3 - along]) ?? new Map()).set(one[along], value));
    }
    return [...axes.values()].filter((axis) => axis.size > 3).map((axis) => [...axis].sort((a, b) => a[0] - b[0]));
}))"""
TOO_WIDE = "document.documentElement.scrollWidth - innerWidth"


def flight(case: str) -> Callable[[Path], Path]:
    """Write the report of a flight, a session or a plan."""

    def write(folder: Path) -> Path:
        save(folder, CASES[case](), MANIFEST)
        write_flight_report(folder)
        return folder / "report.html"

    return write


def fleet(folder: Path) -> Path:
    """Write the report of many flights."""
    write_fleet_report(folder, fleet_of(30, ("A12", "B7"), samples=200), systems())
    return folder / "summary.html"


def comparison(folder: Path) -> Path:
    """Write the page of two flights."""
    for name in "ab":
        saved_example(folder / name)
    page = folder / "compare.html"
    page.write_text(comparison_html(*compare(folder / "a", folder / "b", None)), encoding="utf-8")
    return page


def acceptance(folder: Path) -> Path:
    """Write the page of an acceptance."""
    save_fleet(folder, [0.4, 0.5, 0.6, 0.7, 1.2])
    write_acceptance_report(folder / "acceptance.html", accept(folder, "app-g"))
    return folder / "acceptance.html"


PAGES: dict[str, Callable[[Path], Path]] = {
    **{case: flight(case) for case in ("report", "landing", "session", "control", "placement")},
    "fleet": fleet,
    "comparison": comparison,
    "acceptance": acceptance,
}


@pytest.fixture(scope="module")
def page_of(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """Write a kind of page, each once."""
    written: dict[str, Path] = {}

    def page(kind: str) -> Path:
        if kind not in written:
            written[kind] = PAGES[kind](tmp_path_factory.mktemp(kind))
        return written[kind]

    return page


def of_size(pictures: list[list[float]]) -> list[list[float]]:
    """Pictures that show something: so wide and high, so many shapes."""
    return [one for one in pictures if one[0] > 200.0 and one[1] > 40.0 and one[2] > 4]


@pytest.mark.parametrize("kind", PAGES)
def test_a_page_shows_all_of_its_figures(kind: str, chromium: Browser, page_of: Callable[[str], Path]) -> None:
    page = page_of(kind)
    figures = page.read_text(encoding="utf-8").count('class="plot"')
    chromium.open(page, height=12000)
    assert chromium.run(SEE_ALL) == 0, "stays a picture"
    assert chromium.run(BLANK) == []
    assert chromium.complaints() == []
    chromium.ask("Emulation.setEmulatedMedia", media="print")
    printed: Any = chromium.run(PICTURES)
    chromium.ask("Emulation.setEmulatedMedia", media="")
    assert len(of_size(printed)) == len(printed) == figures > 0
    chromium.open(page, scripts=False)
    assert len(of_size(chromium.run(PICTURES))) == figures
    chromium.open(page, width=390, height=12000)
    chromium.run(SEE_ALL)
    assert chromium.run(TOO_WIDE) <= 0, "wider than a phone"
    assert chromium.complaints() == []


@pytest.mark.parametrize("width", [500, 700, 900, 1100, 1200])
def test_ticks_of_live_figures_are_round(width: int, chromium: Browser, page_of: Callable[[str], Path]) -> None:
    """Ticks at steps of 2.5 read 33, 30, 28, 25 without decimals: no value of theirs lies where it says."""
    noting = chromium.ask("Page.addScriptToEvaluateOnNewDocument", source=NOTE_TEXTS)
    try:
        chromium.open(page_of("landing"), width=width, height=12000)
        assert chromium.run(SEE_ALL) == 0
        axes: Any = chromium.run(AXES)
    finally:
        chromium.ask("Page.removeScriptToEvaluateOnNewDocument", identifier=noting["identifier"])
    assert axes
    for axis in axes:
        steps = np.diff([value for _place, value in axis])
        assert np.ptp(steps) < 1e-9 * abs(steps[0]) and f"{abs(steps[0]):e}"[0] in "125", axis

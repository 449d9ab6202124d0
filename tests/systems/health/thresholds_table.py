"""The table of thresholds in docs/health_checks.md, made from the shipped file.

``python -m tests.systems.health.thresholds_table`` writes it into the page.
"""

from dataclasses import replace
from pathlib import Path

from groundstation.systems.health.checks import CHECKS
from groundstation.systems.health.limits import Threshold, shipped

PAGE = Path(__file__).parents[3] / "docs" / "health_checks.md"
HEAD = "|quantity|amber|red|decides|source|\n|---|---|---|---|---|\n"
BEGIN, END = "<!-- thresholds -->\n", "<!-- end of thresholds -->\n"
SHORT = {  # the page names files and commits below the table
    "PX4 Tools/ecl_ekf/check_level_dict.csv": "ecl_ekf",
    "ArduPilot LogAnalyzer": "LogAnalyzer",
    "dronekit-la analyzer_": "dronekit-la ",
    " (read 2026-11-26)": "",
    " (2022-02-24)": "",
    " (2022-04-12)": "",
    " (2023-12-11)": "",
}


def table() -> str:
    """Return a table for each check."""
    told = []
    for check, title in CHECKS.items():
        rows = [_row(quantity, limit) for quantity, limit in shipped().items() if limit.check == check]
        if rows:
            told.append(f"\n## {title[0].upper()}{title[1:]}: `{check}`\n\n{HEAD}{''.join(rows)}")
    return "".join(told)


def _row(quantity: str, limit: Threshold) -> str:
    amber, red = _level(limit.amber, limit.amber_below), _level(limit.red, limit.red_below)
    unit = f", {limit.unit}" if limit.unit else ""
    source = limit.source
    for long, short in SHORT.items():
        source = source.replace(long, short)
    return f"|{limit.title}{unit}: `{quantity}`|{amber}|{red}|{_told(limit)}|{source}|\n"


def _level(above: float | None, below: float | None) -> str:
    told = [f">{above:g}"] if above is not None else []
    return ", ".join([*told, *([f"<{below:g}"] if below is not None else [])])


def _told(limit: Threshold) -> str:
    """Return what decides, where it is not what the page says of all."""
    plain = Threshold(limit.check, limit.title)
    usual = replace(
        limit,
        warn_amber=plain.warn_amber,
        fail_amber=plain.fail_amber,
        warn_red=plain.warn_red,
        fail_red=plain.fail_red,
        amber_mean=None,
    )
    held = [f"after {limit.hold_s:g} s"] if limit.hold_s else []
    return "; ".join([*([] if limit.rule == "share" and _rule(limit) == _rule(usual) else [_rule(limit)]), *held])


def _rule(limit: Threshold) -> str:
    if limit.rule != "share":
        return limit.rule
    has_amber = limit.amber is not None or limit.amber_below is not None
    has_red = limit.red is not None or limit.red_below is not None
    warns = _beyond((limit.warn_amber if has_amber else None, "amber"), (limit.warn_red if has_red else None, "red"))
    fails = _beyond((limit.fail_amber if has_amber else None, "amber"), (limit.fail_red if has_red else None, "red"))
    mean = [f"mean >{limit.amber_mean:g}"] if limit.amber_mean is not None else []
    told = [f"warns: {', '.join([*warns, *mean])}"] if warns or mean else []
    return "; ".join([*told, *([f"fails: {', '.join(fails)}"] if fails else [])])


def _beyond(*shares: tuple[float | None, str]) -> list[str]:
    known = [(share, grade) for share, grade in shares if share is not None and share < 1.0]
    return [f"any {grade}" if share == 0.0 else f"{grade} >{100.0 * share:g} %" for share, grade in known]


def page() -> str:
    """The page with the table as the shipped file has it."""
    text = PAGE.read_text(encoding="utf-8")
    before, _, rest = text.partition(BEGIN)
    _, _, after = rest.partition(END)
    return f"{before}{BEGIN}{table()}{END}{after}"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")

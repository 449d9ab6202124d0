"""The table of thresholds in docs/health.md, made from the shipped file.

``python -m tests.systems.health.thresholds_table`` writes it into the page.
"""

from pathlib import Path

from groundstation.systems.health.checks import CHECKS
from groundstation.systems.health.limits import Threshold, shipped

PAGE = Path(__file__).parents[3] / "docs" / "health.md"
HEAD = "| check | quantity | what it is | amber | red | the check | source |\n|---|---|---|---|---|---|---|\n"
BEGIN, END = "<!-- thresholds -->\n", "<!-- end of thresholds -->\n"


def table() -> str:
    """The rows, check by check."""
    order = list(CHECKS)
    rows = sorted(shipped().items(), key=lambda item: order.index(item[1].check))
    return HEAD + "".join(_row(quantity, limit) for quantity, limit in rows)


def _row(quantity: str, limit: Threshold) -> str:
    amber, red = _level(limit.amber, limit.amber_below), _level(limit.red, limit.red_below)
    unit = f", {limit.unit}" if limit.unit else ""
    return (
        f"| {limit.check} | `{quantity}` | {limit.title}{unit} | {amber} | {red} | {_rule(limit)} | {limit.source} |\n"
    )


def _level(above: float | None, below: float | None) -> str:
    told = [f"> {above:g}"] if above is not None else []
    return ", ".join([*told, *([f"< {below:g}"] if below is not None else [])])


def _rule(limit: Threshold) -> str:
    if limit.rule != "share":
        what = {"median": "median", "mean": "mean", "rise": "rise of the counter"}[limit.rule]
        return f"{what}: amber warns" + (", red fails" if limit.red is not None else "")
    has_amber = limit.amber is not None or limit.amber_below is not None
    has_red = limit.red is not None or limit.red_below is not None
    warns = _beyond((limit.warn_amber if has_amber else None, "amber"), (limit.warn_red if has_red else None, "red"))
    fails = _beyond((limit.fail_amber if has_amber else None, "amber"), (limit.fail_red if has_red else None, "red"))
    mean = [f"a mean > {limit.amber_mean:g}"] if limit.amber_mean is not None else []
    told = [f"warns: {', '.join([*warns, *mean])}"] if warns or mean else []
    told += [f"fails: {', '.join(fails)}"] if fails else []
    held = [f"counts after {limit.hold_s:g} s"] if limit.hold_s else []
    return "; ".join([*told, *held])


def _beyond(*shares: tuple[float | None, str]) -> list[str]:
    known = [(share, grade) for share, grade in shares if share is not None and share < 1.0]
    return [f"any {grade}" if share == 0.0 else f"{grade} > {100.0 * share:g} %" for share, grade in known]


def page() -> str:
    """The page with the table as the shipped file has it."""
    text = PAGE.read_text(encoding="utf-8")
    before, _, rest = text.partition(BEGIN)
    _, _, after = rest.partition(END)
    return f"{before}{BEGIN}{table()}{END}{after}"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")

"""Look of a picture: colours of roles, widths of lines, shades of phases, scale of cells."""

from groundstation.plots.marks import Dash, Emphasis, Role

INK, FAINT, EDGE, GRID, PAPER = "#1c2530", "#6b7683", "#8d97a3", "#e4e8ec", "#ffffff"

# Okabe and Ito (2008), colour-blind safe. One meaning, one colour, in every figure.
COLOURS: dict[Role, str] = {
    "truth": INK,
    "gnss": "#d55e00",
    "ins": "#0072b2",
    "answer": "#007f5f",
    "limit": "#8a2be2",
    "unused": "#a9b1ba",
    "paper": PAPER,
    "ink": INK,
    "faint": FAINT,
    "good": "#007f5f",
    "warn": "#e69f00",
    "bad": "#b3261e",
    "other": "#cc79a7",
    "series 1": "#0072b2",
    "series 2": "#d55e00",
    "series 3": "#007f5f",
    "series 4": "#cc79a7",
    "series 5": "#e69f00",
    "series 6": "#56b4e9",
    "series 7": "#7a6a00",
}
SHADES = {
    "unknown": "#eef0f2",
    "standstill": "#d9dee3",
    "taxi": "#f6e3b4",
    "take-off run": "#f2b8a0",
    "airborne": "#d3e7f5",
    "landing roll": "#e3cfe6",
    "driving": "#f6e3b4",
    "walking": "#e4ecc4",
    "under way": "#cde8e4",
    "on the ground": "#ece5d8",
    "moving": "#dedbee",
}
LANE: dict[Emphasis, float] = {"faint": 0.3, "thin": 0.6, "usual": 1.0, "bold": 1.0}  # of a lane
DOT: dict[Emphasis, float] = {"faint": 0.75, "thin": 0.75, "usual": 0.75, "bold": 1.0}  # of dots, which are many
LIMIT_PT: dict[Emphasis, float] = {"faint": 0.6, "thin": 0.6, "usual": 0.9, "bold": 1.5}
LINE: dict[Emphasis, float] = {"faint": 0.65, "thin": 1.0, "usual": 1.0, "bold": 1.0}  # opacity of a curve
LINE_PT: dict[Emphasis, float] = {"faint": 0.5, "thin": 0.8, "usual": 1.1, "bold": 2.2}
DOT_PT: dict[Emphasis, float] = {"faint": 1.3, "thin": 1.6, "usual": 1.8, "bold": 3.0}
SHADE: dict[Emphasis, float] = {"faint": 0.10, "thin": 0.15, "usual": 0.19, "bold": 0.35}  # opacity of a band
DASHES = {"dashed": "4 2", "dotted": "1 1.6"}
SYMBOL_PT = 4.5  # across a symbol of the usual size
STEPS = 20  # colours of a scale


def with_alpha(colour: str, alpha: float) -> str:
    """Return the colour and opacity as one number.

    Examples
    --------
    >>> with_alpha("#0072b2", 0.5)
    '#0072b280'
    """
    return f"{colour}{round(255.0 * alpha):02x}"


def opacity(of: str, share: float) -> str:
    """Return the attribute of an opacity, none of what is opaque.

    Examples
    --------
    >>> opacity("fill", 0.5), opacity("fill", 1.0)
    (' fill-opacity="0.5"', '')
    """
    return "" if share == 1.0 else f' {of}-opacity="{share:g}"'


def dashes(dash: Dash) -> str:
    """Return the attribute of a dashed line, none of a solid one.

    Examples
    --------
    >>> dashes("")
    ''
    """
    return f' stroke-dasharray="{DASHES[dash]}"' if dash else ""


def shade_of(kind: str, role: Role, emphasis: Emphasis = "usual") -> tuple[str, float]:
    """Return colour and opacity of shaded ground.

    A phase of flight has its own, all else a faint one of its role.

    Examples
    --------
    >>> shade_of("taxi", "ink"), shade_of("95 %", "answer", "faint")
    (('#f6e3b4', 1.0), ('#007f5f', 0.1))
    """
    return (SHADES[kind], 1.0) if kind in SHADES else (COLOURS[role], SHADE[emphasis])

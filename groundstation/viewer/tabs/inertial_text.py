"""The text panel of the INS errors tab: the figures people ask first, then every state with its sigma."""

from collections.abc import Mapping, Sequence
from typing import Any

from groundstation.results.inertial import MISSING, ChannelResult, InertialResult, StateEstimate, is_left_alone
from groundstation.viewer.markdown import markdown_text, number, table
from groundstation.viewer.names import UNITS

DIGITS = {"m": 1, "mps": 3, "arcsec": 1, "dph": 4, "dphph": 4}


def inertial_text(result: InertialResult | None, reasons: Sequence[str] = ()) -> str:
    """Markdown of the panel; without a result the reasons why there is none."""
    if result is None:
        return "\n\n".join(["# INS errors not assessed", *(markdown_text(reason) for reason in reasons)])
    parts = [
        f"# {_headline(result)}",
        markdown_text(result.kind_reason),
        _figures(result),
        *(_channel(channel, result.settings) for channel in result.channels),
        *_outages(result),
        *_azimuth(result),
    ]
    return "\n\n".join(part for part in parts if part)


def _headline(result: InertialResult) -> str:
    if result.kind == "gnss_aided":
        return "This INS is aided by GNSS: a forecast from it means nothing"
    if result.kind == "unknown":
        return "Whether GNSS corrects this INS cannot be told"
    rate = number(result.radial_error_rate_50_nmiph, 2, "nmi/h")
    return f"Unaided INS, {rate} (median)" if rate != "–" else "Unaided INS"


def _figures(result: InertialResult) -> str:
    rows = [
        ["radial error rate, median", number(result.radial_error_rate_50_nmiph, 2, "nmi/h")],
        ["radial error rate, 95 %", number(result.radial_error_rate_95_nmiph, 2, "nmi/h")],
        ["velocity error, RMS", number(result.velocity_error_rms_mps, 2, "m/s")],
        ["largest radial error", number(result.largest_radial_error_m, 0, "m")],
        ["INS class (noise used)", f"{markdown_text(result.ins_class)}: {markdown_text(result.ins_class_origin)}"],
        ["pair used", f"{markdown_text(result.ins_topic)}, {markdown_text(result.gnss_topic)}"],
        ["epochs, with GNSS", f"{result.epochs}, {number(result.gnss_seconds, 0, 's')}"],
        ["transition matrix", "exact exponential" if result.transition == "exact" else "first order, I + A T"],
        ["filter opened again after long rejection of GNSS", f"{result.reopened} times"],
        ["other INS topics, not used", ", ".join(markdown_text(topic) for topic in result.other_ins) or "–"],
    ]
    return table(["figure", "value"], [row for row in rows if row[1] != "–"])


def _channel(channel: ChannelResult, settings: Mapping[str, Any]) -> str:
    rows = [_state(state, settings) for state in channel.states]
    counted = f"{channel.innovations} innovations, {channel.rejected} rejected"
    if channel.nis_low is None:
        lines = (
            f"{counted}. NIS {number(channel.nis, 2)}: the noise was raised to cover slow GNSS errors, so it says "
            "nothing of consistency."
        )
    else:
        limits = f"95 % limits {number(channel.nis_low, 2)} … {number(channel.nis_high, 2)}"
        lines = (
            f"NIS {number(channel.nis, 2)} ({limits}), {number(100.0 * channel.share_inside95, 1)} % inside their 95 % "
            f"band of {counted}."
        )
    return "\n\n".join(
        [
            f"## {channel.name.capitalize()} channel, last time with GNSS",
            table(["state", "value ± σ", "observability"], rows),
            lines,
        ]
    )


def _state(state: StateEstimate, settings: Mapping[str, Any]) -> list[str]:
    if is_left_alone(state.name, state.sigma, state.observability, settings):
        return [markdown_text(state.title), "not estimated in this class", "–"]
    digits, unit = DIGITS.get(state.unit, 3), UNITS.get(state.unit, state.unit)
    value = f"{number(state.value, digits, sign=True)} ± {number(state.sigma, digits, unit)}"
    return [markdown_text(state.title), value, number(state.observability, 2)]


def _outages(result: InertialResult) -> list[str]:
    if not result.outages:
        return []
    rows = [
        [
            number(outage.start_s, 0, "s"),
            MISSING.get(outage.missing, "–"),
            number(outage.length_s, 0, "s"),
            number(outage.jump_m, 0, "m") if outage.jump_m is not None else _no_return(outage.missing),
            number(outage.sigma_m, 0, "m"),
        ]
        for outage in result.outages
    ]
    return ["## Outages in the log", table(["from", "without", "length", "off on return", "σ claimed"], rows)]


def _no_return(missing: str) -> str:
    return "neither returned" if missing == "both" else f"{MISSING.get(missing, 'it')} did not return"


def _azimuth(result: InertialResult) -> list[str]:
    azimuth = result.azimuth
    if azimuth is None:
        return []
    value = (
        f"{number(azimuth.error_deg, 3, sign=True)} ± {number(azimuth.sigma_deg, 3, 'deg')}"
        if azimuth.observable
        else "not observable"
    )
    return ["## Azimuth error from the turns", f"{value}: {markdown_text(azimuth.reason)}"]

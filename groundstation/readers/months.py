"""Names of months in dates, in the languages of common recorders and spreadsheets."""

import re
from collections.abc import Mapping
from types import MappingProxyType

_BY_MONTH = (
    "jan|january|januar|jän|jänner|janv|janvier|ene|enero|gen|gennaio|янв|январь|января",
    "feb|february|februar|févr|fév|février|febr|febrero|febbraio|фев|февр|февраль|февраля",
    "mar|march|mrz|mär|märz|mars|marzo|мар|март|марта",
    "apr|april|avr|avril|abr|abril|aprile|апр|апрель|апреля",
    "may|mai|mayo|mag|maggio|май|мая",
    "jun|june|juni|juin|junio|giu|giugno|июн|июнь|июня",
    "jul|july|juli|juil|juillet|julio|lug|luglio|июл|июль|июля",
    "aug|august|août|aou|aoû|ago|agosto|авг|август|августа",
    "sep|sept|september|septembre|septiembre|set|settembre|сен|сент|сентябрь|сентября",
    "oct|october|okt|oktober|octobre|octubre|ott|ottobre|окт|октябрь|октября",
    "nov|november|novembre|noviembre|ноя|нояб|ноябрь|ноября",
    "dec|december|dez|dezember|déc|décembre|dic|diciembre|dicembre|дек|декабрь|декабря",
)
MONTHS: Mapping[str, int] = MappingProxyType(
    {name: number for number, names in enumerate(_BY_MONTH, start=1) for name in names.split("|")}
)
NAME = r"[A-Za-zÀ-ÖØ-öø-ÿА-Яа-яёЁ]{3,10}"


def with_number(text: str) -> str:
    """Return a date with the number of its month for the name.

    Examples
    --------
    >>> with_number("31 Dez 2021"), with_number("March 4 2021"), with_number("4 Foo 2021")
    ('31 12 2021', '03 4 2021', '4 Foo 2021')
    """
    return re.sub(NAME, lambda found: _number(found[0]), text, count=1)


def _number(name: str) -> str:
    number = MONTHS.get(name.lower())
    return name if number is None else f"{number:02d}"

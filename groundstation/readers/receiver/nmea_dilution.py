"""Dilution of precision from GSA, which states all three, and from GGA and GNS.

PDOP² = HDOP² + VDOP² by their definition. A receiver that breaks it writes something else into the fields of GSA: the
firmware of InertialSense, for one, has its PDOP in the HDOP of GGA as well, and its accuracies in metres in place of
HDOP and VDOP of GSA (inertial-sense-sdk, src/protocol_nmea.cpp, commit 003fc3f, ``nmea_gga`` and ``nmea_gsa``).
"""

import numpy as np

from groundstation.base.records import BoolArray, Column
from groundstation.readers.receiver.credible import MOST_DILUTION
from groundstation.readers.receiver.messages import Columns, merged
from groundstation.readers.receiver.nmea import SentenceEpochs
from groundstation.readers.receiver.sentences import Sentences
from groundstation.readers.receiver.tally import HDOPS_DIFFER, IMPOSSIBLE_DILUTION, SAME_DILUTION, StreamTally

_NAMES = ("PDOP", "HDOP", "VDOP")
_ROUNDED = 0.05  # of a number with one decimal, as GSA has it at the least


def dilution(epochs: SentenceEpochs, tally: StreamTally) -> Columns:
    """Return PDOP and HDOP by epoch, HDOP of GGA before that of GSA.

    Of a GSA that cannot be, HDOP is left out, and the HDOP of GGA where it is the PDOP of GSA.
    """
    stated = epochs.values("GSA", _NAMES)
    if stated:  # a system without a satellite in the solution repeats it, or has nothing to say
        stated |= merged(stated, epochs.values("GSA", _NAMES, _has_satellites))
    columns = {"pdop": stated["PDOP"], "hdop": stated["HDOP"]} if stated else {}
    wrong = _impossible(stated) if stated else np.zeros(len(epochs), dtype=bool)
    if wrong.any():
        columns["hdop"] = Column(stated["HDOP"].values, stated["HDOP"].mask & ~wrong)
        tally.add(IMPOSSIBLE_DILUTION, "gnss", epochs.places[wrong], **{n: stated[n].values[wrong] for n in _NAMES})
    for formatter in ("GNS", "GGA"):
        found = epochs.values(formatter, ("HDOP",))
        if not found:
            continue
        hdop = found["HDOP"]
        if stated:
            same = wrong & hdop.mask & (np.abs(hdop.values - stated["PDOP"].values) <= _ROUNDED)
            tally.add(SAME_DILUTION, "gnss", epochs.places[same], HDOP=hdop.values[same])
            hdop = Column(hdop.values, hdop.mask & ~same)
            both = hdop.mask & stated["HDOP"].mask & ~wrong & _is_told(stated["HDOP"]) & _is_told(hdop)
            apart = both & (np.abs(hdop.values - stated["HDOP"].values) > _ROUNDED + 1e-9)
            values = {formatter: hdop.values[apart], "GSA": stated["HDOP"].values[apart]}
            tally.add(HDOPS_DIFFER, "gnss", epochs.places[apart], **values)
        columns |= merged(columns, {"hdop": hdop})
    return columns


def _impossible(stated: Columns) -> BoolArray:
    """Tell where PDOP is less than HDOP and VDOP together, rounding allowed for.

    One number for all three, such as 50.0, is the sign of a receiver without a fix.
    """
    pdop, hdop, vdop = (stated[name] for name in _NAMES)
    told = np.logical_and.reduce([_is_told(one) for one in (pdop, hdop, vdop)])
    least = np.hypot(np.maximum(hdop.values - _ROUNDED, 0.0), np.maximum(vdop.values - _ROUNDED, 0.0))
    is_sign = (pdop.values == hdop.values) & (hdop.values == vdop.values)
    return np.asarray(told & ~is_sign & (pdop.values + _ROUNDED < least))


def _is_told(column: Column) -> BoolArray:
    return np.asarray(column.mask & (column.values > 0.0) & (column.values <= MOST_DILUTION))


def _has_satellites(sentences: Sentences) -> BoolArray:
    return sentences.columns["svid_01"].mask

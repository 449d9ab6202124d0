"""Messages of u-blox receivers: names and layouts.

Fields have the names, units and order of u-blox's documents.

Source: u-blox, interface descriptions of protocol versions 15 (M8) to 33 (F9, M10). A message that stands here without
a layout is kept with its bytes. Scaled fields are in the unit of the document (degrees, metres per second squared).
"""

from collections.abc import Mapping
from types import MappingProxyType

_DATE = "year:u2 month:u1 day:u1 hour:u1 min:u1"
_VALID = "valid:x1(validDate validTime fullyResolved validMag)"
_PLACE = "lon:i4/1e7 lat:i4/1e7 height:i4 hMSL:i4"
_FLAGS2 = "flags2:x1(-:5 confirmedAvai confirmedDate confirmedTime)"
_COVARIANCE = " ".join(
    f"{kind}Cov{pair}:r4" for kind in ("pos", "vel") for pair in ("NN", "NE", "ND", "EE", "ED", "DD")
)
_RELATIVE_FLAGS = (
    "flags:x4(gnssFixOK diffSoln relPosValid carrSoln:2 isMoving refPosMiss refObsMiss relPosHeadingValid "
    "relPosNormalized)"
)
_SATELLITE_FLAGS = (
    "flags:x4(qualityInd:3 svUsed health:2 diffCorr smoothed orbitSource:3 ephAvail almAvail anoAvail aopAvail -:1 "
    "sbasCorrUsed rtcmCorrUsed slasCorrUsed spartnCorrUsed prCorrUsed crCorrUsed doCorrUsed clasCorrUsed)"
)

LAYOUTS: Mapping[str, str] = MappingProxyType(
    {
        "NAV-POSECEF": "iTOW:u4 ecefX:i4 ecefY:i4 ecefZ:i4 pAcc:u4",
        "NAV-POSLLH": f"iTOW:u4 {_PLACE} hAcc:u4 vAcc:u4",
        "NAV-STATUS": "iTOW:u4 gpsFix:u1 flags:x1(gpsFixOk diffSoln wknSet towSet) "
        "fixStat:x1(diffCorr carrSolnValid -:4 mapMatching:2) flags2:x1(psmState:2 -:1 spoofDetState:2 -:1 carrSoln:2) "
        "ttff:u4 msss:u4",
        "NAV-DOP": "iTOW:u4 " + " ".join(f"{axis}DOP:u2/1e2" for axis in "gptvhne"),
        "NAV-ATT": "iTOW:u4 version:u1 -:u3 roll:i4/1e5 pitch:i4/1e5 heading:i4/1e5 "
        "accRoll:u4/1e5 accPitch:u4/1e5 accHeading:u4/1e5",
        "NAV-SOL": "iTOW:u4 fTOW:i4 week:i2 gpsFix:u1 flags:x1(gpsfixOK diffSoln wknSet towSet) "
        "ecefX:i4 ecefY:i4 ecefZ:i4 pAcc:u4 ecefVX:i4 ecefVY:i4 ecefVZ:i4 sAcc:u4 pDOP:u2/1e2 -:u1 numSV:u1 -:u4",
        "NAV-PVT": f"iTOW:u4 {_DATE} second:u1 {_VALID} tAcc:u4 nano:i4 fixType:u1 "
        "flags:x1(gnssFixOk diffSoln psmState:3 headVehValid carrSoln:2) "
        f"{_FLAGS2} numSV:u1 {_PLACE} hAcc:u4 vAcc:u4 velN:i4 velE:i4 velD:i4 gSpeed:i4 headMot:i4/1e5 "
        "sAcc:u4 headAcc:u4/1e5 pDOP:u2/1e2 flags3:x2(invalidLlh lastCorrectionAge:4) -:u4 headVeh:i4/1e5 "
        "magDec:i2/1e2 magAcc:u2/1e2",
        "NAV-VELECEF": "iTOW:u4 ecefVX:i4 ecefVY:i4 ecefVZ:i4 sAcc:u4",
        "NAV-VELNED": "iTOW:u4 velN:i4 velE:i4 velD:i4 speed:u4 gSpeed:u4 heading:i4/1e5 sAcc:u4 cAcc:u4/1e5",
        "NAV-HPPOSLLH": "version:u1 -:u2 flags:x1(invalidLlh) iTOW:u4 lon:i4/1e7+lonHp lat:i4/1e7+latHp "
        "height:i4+heightHp hMSL:i4+hMSLHp lonHp:i1/1e9 latHp:i1/1e9 heightHp:i1/1e1 hMSLHp:i1/1e1 "
        "hAcc:u4/1e1 vAcc:u4/1e1",
        "NAV-PVAT": f"iTOW:u4 version:u1 {_VALID} {_DATE} sec:u1 -:u1 -:u2 tAcc:u4 nano:i4 fixType:u1 "
        "flags:x1(gnssFixOK diffSoln -:1 vehRollValid vehPitchValid vehHeadingValid carrSoln:2) "
        f"{_FLAGS2} numSV:u1 {_PLACE} hAcc:u4 vAcc:u4 velN:i4 velE:i4 velD:i4 gSpeed:i4 sAcc:u4 vehRoll:i4/1e5 "
        "vehPitch:i4/1e5 vehHeading:i4/1e5 motHeading:i4/1e5 accRoll:u2/1e2 accPitch:u2/1e2 accHeading:u2/1e2 "
        "magDec:i2/1e2 magAcc:u2/1e2 errEllipseOrient:u2/1e2 errEllipseMajor:u4 errEllipseMinor:u4 -:u4 -:u4",
        "NAV-TIMEGPS": "iTOW:u4 fTOW:i4 week:i2 leapS:i1 valid:x1(towValid weekValid leapSValid) tAcc:u4",
        "NAV-TIMEUTC": f"iTOW:u4 tAcc:u4 nano:i4 {_DATE} sec:u1 "
        "valid:x1(validTOW validWKN validUTC authStatus utcStandard:4)",
        "NAV-TIMELS": "iTOW:u4 version:u1 -:u3 srcOfCurrLs:u1 currLs:i1 srcOfLsChange:u1 lsChange:i1 timeToLsEvent:i4 "
        "dateOfLsGpsWn:u2 dateOfLsGpsDn:u2 -:u3 valid:x1(validCurrLs validTimeToLsEvent)",
        "NAV-SAT": "iTOW:u4 version:u1 numSvs:u1 -:u2 | numSvs gnssId:u1 svId:u1 cno:u1 elev:i1 azim:i2 "
        f"prRes:i2/1e1 {_SATELLITE_FLAGS}",
        "NAV-COV": f"iTOW:u4 version:u1 posCovValid:u1 velCovValid:u1 -:u9 {_COVARIANCE}",
        "NAV-RELPOSNED": "version:u1 -:u1 refStationID:u2 iTOW:u4 relPosN:i4+relPosNHp relPosE:i4+relPosEHp "
        "relPosD:i4+relPosDHp relPosLength:i4+relPosLengthHp relPosHeading:i4/1e5 -:u4 relPosNHp:i1/1e2 "
        "relPosEHp:i1/1e2 relPosDHp:i1/1e2 relPosLengthHp:i1/1e2 accN:u4/1e1 accE:u4/1e1 accD:u4/1e1 "
        f"accLength:u4/1e1 accHeading:u4/1e5 -:u4 {_RELATIVE_FLAGS}",
        "NAV-RELPOSNED-V0": "version:u1 -:u1 refStationID:u2 iTOW:u4 relPosN:i4+relPosNHp relPosE:i4+relPosEHp "
        "relPosD:i4+relPosDHp relPosNHp:i1/1e2 relPosEHp:i1/1e2 relPosDHp:i1/1e2 -:u1 accN:u4/1e1 accE:u4/1e1 "
        f"accD:u4/1e1 {_RELATIVE_FLAGS}",
        "NAV-EOE": "iTOW:u4",
        "HNR-PVT": f"iTOW:u4 {_DATE} second:u1 valid:x1(validDate validTime fullyResolved) nano:i4 "
        "gpsFix:u1 flags:x1(GPSfixOK DiffSoln WKNSET TOWSET headVehValid) -:u2 "
        f"{_PLACE} gSpeed:i4 speed:i4 headMot:i4/1e5 headVeh:i4/1e5 hAcc:u4 vAcc:u4 sAcc:u4 headAcc:u4/1e5 -:u4",
        "RXM-SFRBX": "gnssId:u1 svId:u1 sigId:u1 freqId:u1 numWords:u1 chn:u1 version:u1 -:u1 | numWords dwrd:u4",
        "RXM-RAWX": "rcvTow:r8 week:u2 leapS:i1 numMeas:u1 recStat:x1(leapSec clkReset) -:u3 | numMeas prMes:r8 "
        "cpMes:r8 doMes:r4 gnssId:u1 svId:u1 sigId:u1 freqId:u1 locktime:u2 cno:u1 prStdev:x1(prStd:4) "
        "cpStdev:x1(cpStd:4) doStdev:x1(doStd:4) trkStat:x1(prValid cpValid halfCyc subHalfCyc) -:u1",
        "MON-VER": "swVersion:c30 hwVersion:c10 | * extension:c30",
        "ESF-MEAS": "timeTag:u4 flags:x2(timeMarkSent:2 timeMarkEdge calibTtagValid -:7 numMeas:5) id:u2 | numMeas "
        "data:x4(dataField:24 dataType:6) | 4",
        "ESF-RAW": "msss:u4 | * data:x4(dataField:24 dataType:8) sTtag:u4",
        "ESF-STATUS": "iTOW:u4 version:u1 initStatus1:x1(wtInitStatus:2 mntAlgStatus:3 insInitStatus:3) "
        "initStatus2:x1(imuInitStatus:2) -:u5 fusionMode:u1 -:u2 numSens:u1 | numSens "
        "sensStatus1:x1(type:6 used ready) sensStatus2:x1(calibStatus:2 timeStatus:2) freq:u1 "
        "faults:x1(badMeas badTTag missingMeas noisyMeas)",
        "ESF-INS": "flags:x4(version:8 xAngRateValid yAngRateValid zAngRateValid xAccelValid yAccelValid zAccelValid) "
        "-:u4 iTOW:u4 xAngRate:i4/1e3 yAngRate:i4/1e3 zAngRate:i4/1e3 xAccel:i4/1e2 yAccel:i4/1e2 zAccel:i4/1e2",
    }
)
SHORT_RELPOSNED = 40  # bytes of the payload of its version 0
_LAID_OUT_AS = {"HNR-ATT": "NAV-ATT", "HNR-INS": "ESF-INS"}
_OLDER = {"NAV-PVT": 84}  # bytes of the payload before headVeh and magDec were added (M8, protocol 14)

# Class -> its name, and number and name of its messages.
_CLASSES: Mapping[int, tuple[str, str]] = MappingProxyType(
    {
        0x01: (
            "NAV",
            "01-POSECEF 02-POSLLH 03-STATUS 04-DOP 05-ATT 06-SOL 07-PVT 09-ODO 10-RESETODO 11-VELECEF 12-VELNED "
            "13-HPPOSECEF 14-HPPOSLLH 17-PVAT 20-TIMEGPS 21-TIMEUTC 22-CLOCK 23-TIMEGLO 24-TIMEBDS 25-TIMEGAL "
            "26-TIMELS 27-TIMEQZSS 30-SVINFO 31-DGPS 32-SBAS 34-ORB 35-SAT 36-COV 39-GEOFENCE 3B-SVIN "
            "3C-RELPOSNED 3D-EELL 42-SLAS 43-SIG 60-AOPSTATUS 61-EOE 62-PL 63-TIMENAVIC",
        ),
        0x02: ("RXM", "13-SFRBX 14-MEASX 15-RAWX 20-SVSI 32-RTCM 34-COR 59-RLM"),
        0x04: ("INF", "00-ERROR 01-WARNING 02-NOTICE 03-TEST 04-DEBUG"),
        0x05: ("ACK", "00-NAK 01-ACK"),
        0x06: ("CFG", "01-MSG 08-RATE 8A-VALSET 8B-VALGET"),
        0x0A: (
            "MON",
            "02-IO 04-VER 06-MSGPP 07-RXBUF 08-TXBUF 09-HW 0B-HW2 28-GNSS 31-SPAN 36-COMMS 37-HW3 38-RF 39-SYS",
        ),
        0x0D: ("TIM", "01-TP 03-TM2 06-VRFY"),
        0x10: ("ESF", "02-MEAS 03-RAW 10-STATUS 14-ALG 15-INS"),
        0x13: ("MGA", ""),
        0x21: ("LOG", ""),
        0x27: ("SEC", ""),
        0x28: ("HNR", "00-PVT 01-ATT 02-INS"),
        0x29: (
            "NAV2",
            "01-POSECEF 02-POSLLH 03-STATUS 04-DOP 07-PVT 09-ODO 11-VELECEF 12-VELNED 17-PVAT 20-TIMEGPS 21-TIMEUTC "
            "22-CLOCK 23-TIMEGLO 24-TIMEBDS 25-TIMEGAL 26-TIMELS 27-TIMEQZSS 32-SBAS 35-SAT 36-COV 3B-SVIN 3D-EELL "
            "42-SLAS 43-SIG 61-EOE 63-TIMENAVIC",
        ),
    }
)
_NAMES = MappingProxyType(
    {
        number * 256 + int(word[:2], 16): f"{family}-{word[3:]}"
        for number, (family, words) in _CLASSES.items()
        for word in words.split()
    }
)


def name_of(code: int, size: int) -> str:
    """Return the name of a message by its code and the bytes of its payload.

    The code is ``class * 256 + number``.

    Examples
    --------
    >>> name_of(0x0107, 92), name_of(0x013C, 40), name_of(0x0B30, 8), name_of(0x1302, 8)
    ('NAV-PVT', 'NAV-RELPOSNED-V0', 'UBX-0B-30', 'MGA-02')
    """
    number, message = divmod(code, 256)
    family = _CLASSES[number][0] if number in _CLASSES else f"UBX-{number:02X}"
    name = _NAMES.get(code, f"{family}-{message:02X}")
    return f"{name}-V0" if name == "NAV-RELPOSNED" and size == SHORT_RELPOSNED else name


def layout_of(name: str) -> str:
    """Return the layout of a message by its name, as a line of text.

    Empty for a message that is not known here.

    The messages of the second solution (NAV2) are laid out as those of the first.

    Examples
    --------
    >>> layout_of("NAV2-EOE"), layout_of("MGA-02")
    ('iTOW:u4', '')
    """
    first = _LAID_OUT_AS.get(name, name.replace("NAV2-", "NAV-"))
    return LAYOUTS.get(first, "")


def is_version(name: str, size: int) -> bool:
    """Tell whether a message had an older, shorter version of so many bytes.

    Examples
    --------
    >>> is_version("NAV-PVT", 84), is_version("NAV-PVT", 80)
    (True, False)
    """
    return _OLDER.get(name) == size

"""Layouts of NMEA sentences: the fields of each formatter, and addresses of makers.

The addresses are those whose next field chooses the layout.

Fields have the names of pynmeagps and the order of NMEA 0183 (4.11); a version that has fewer leaves the last ones out.
A maker's address (``PASHR``, ``PUBX``) may stand for several layouts: then a word or a number behind it says which, and
the sentence is called by both, ``PUBX.00``.

Sources: NMEA 0183; Trimble, NMEA-0183 messages (PASHR, PTNL); u-blox, interface descriptions (PUBX); documentation of
gpsd and pynmeagps (BSD).
"""

from collections.abc import Mapping
from types import MappingProxyType

# Kinds of fields: n number, t time of day, d date, a latitude or longitude (its hemisphere is the next field), c text.
_GROUP_OF_SATELLITE = " ".join(f"svid_0{k}:n elv_0{k}:n az_0{k}:n cno_0{k}:n" for k in range(1, 5))
_PLACE = "lat:a NS:c lon:a EW:c"
FORMATTERS: Mapping[str, str] = MappingProxyType(
    {
        "GGA": f"time:t {_PLACE} quality:n numSV:n HDOP:n alt:n altUnit:c sep:n sepUnit:c diffAge:n diffStation:n",
        "GNS": f"time:t {_PLACE} posMode:c numSV:n HDOP:n alt:n sep:n diffAge:n diffStation:n navStatus:c",
        "GLL": f"{_PLACE} time:t status:c posMode:c",
        "RMC": f"time:t status:c {_PLACE} spd:n cog:n date:d mv:n mvEW:c posMode:c navStatus:c",
        "VTG": "cogt:n cogtUnit:c cogm:n cogmUnit:c sogn:n sognUnit:c sogk:n sogkUnit:c posMode:c",
        "GSA": "opMode:c navMode:n " + " ".join(f"svid_{k:02d}:n" for k in range(1, 13)) + " PDOP:n HDOP:n VDOP:n "
        "systemId:c",
        "GSV": f"numMsg:n msgNum:n numSV:n {_GROUP_OF_SATELLITE} signalID:c",
        "GST": "time:t rangeRms:n stdMajor:n stdMinor:n orient:n stdLat:n stdLong:n stdAlt:n",
        "ZDA": "time:t day:n month:n year:n ltzh:c ltzn:c",
        "HDT": "headingT:n headingTu:c",
        "HDM": "headingM:n headingMag:c",
        "HDG": "headingM:n deviation:n deviationEW:c variation:n variationEW:c",
        "THS": "headt:n mi:c",
        "ROT": "rot:n valid:c",
        "TXT": "numMsg:n msgNum:n msgType:n text:c",
        "PASHR": "utctime:t trueHdg:n trueHdgInd:c roll:n pitch:n reserved:c rollAcc:n pitchAcc:n hdgAcc:n "
        "gnssQual:n imuAlign:n",
        "PASHR.POS": f"solnType:n sip:n utctime:t {_PLACE} alt:n corrAge:n trueTrk:n sog:n vertVel:n PDOP:n HDOP:n "
        "VDOP:n TDOP:n baseId:c",
        "PTNL.AVR": "utctime:t yaw:n yawc:c tilt:n tiltc:c roll:n rollc:c range:n gpsQual:n PDOP:n sip:n",
        "PTNL.GGK": f"utctime:t utcdate:c {_PLACE} gpsQual:n sip:n DOP:n height:c hunit:c",
        "PTNL.VGK": "utctime:t utcdate:c vectE:n vectN:n vectV:n gpsQual:n sip:n DOP:n vunit:c",
        "PTNL.VHD": "utctime:t utcdate:c azi:n aziRate:n ele:n eleRate:n range:n rangeRate:n gpsQual:n sip:n PDOP:n "
        "unit:c",
        "PUBX.00": f"time:t {_PLACE} altRef:n navStat:c hAcc:n vAcc:n SOG:n COG:n vVel:n diffAge:n HDOP:n VDOP:n "
        "TDOP:n numSVs:n reserved:n DR:n",
        "PUBX.04": "time:t date:d utcTow:n utcWk:n leapSec:c clkBias:n clkDrift:n tpGran:n",
    }
)
TIMED = ("GGA", "GNS", "RMC", "GLL", "ZDA", "GST", "PASHR")
TIME_FIELD: Mapping[str, int] = MappingProxyType({"GLL": 4, "PASHR.POS": 2})  # 0 in the others
STANDARD_POSITIONS = ("GLL", "RMC", "GNS", "GGA")  # the last that has a position gives it
MAKERS_POSITIONS = ("PUBX.00", "PTNL.GGK", "PASHR.POS")  # the first that a log has, where it has no standard one
RECEIVERS = ("GP", "GN", "GL", "GA", "GB", "BD", "GQ", "QZ", "GI")  # talkers that are satellite receivers

# Addresses of several layouts. True: digits choose one too; PASHR with a time behind it is the attitude.
_BY_WORD = ("PASHR", "PERDAPI", "PERDCRG", "PERDCRJ", "PERDSYS", "PFEC", "PERC", "PIXSE", "PSAT", "PSSN", "PTNL")
_BY_NUMBER = ("PGPPADV", "PKODG", "PLSR", "PMVXG", "PSTI", "PSXN", "PUBX")
FAMILIES: Mapping[str, bool] = MappingProxyType(dict.fromkeys(_BY_WORD, False) | dict.fromkeys(_BY_NUMBER, True))

"""Test of the host name in a request against the names of this machine.

A page elsewhere can make any other name point here.
"""

import ipaddress
import re
import socket

LOCAL = "127.0.0.1"
_HOST = re.compile(r"(\[(?P<address>[0-9a-f:.]+)\]|(?P<name>[^:\[\]]+))(:\d*)?")


def is_own_name(host: str) -> bool:
    """Tell whether a Host header is an address, ``localhost`` or this machine's name.

    A port may follow. An address cannot be made to point elsewhere, so a browser sends one only for a page of that
    address.

    Examples
    --------
    >>> is_own_name("127.0.0.1:9090"), is_own_name("[::1]:9090"), is_own_name("localhost"), is_own_name("pages.example")
    (True, True, True, False)
    """
    parts = _HOST.fullmatch(host.strip().lower())
    if parts is None:
        return False
    name = parts["address"] or parts["name"]
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return name in {"localhost", socket.gethostname().lower()}
    return True

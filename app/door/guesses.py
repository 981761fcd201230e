"""Guessing tokens is slow: the tries of one visitor stand in a line, and the line is short."""

from __future__ import annotations

import ipaddress
from collections import OrderedDict

PACE_S = 0.5
"""Between two tries of one visitor."""

LINE_S = 4.0
"""Who would wait longer is sent away; a handshake may take ten seconds."""

_REMEMBERED = 1000


class Guesses:
    """Who tried when. Explicit times [s, any clock that only goes forward]; for one thread."""

    def __init__(self) -> None:
        self._next: OrderedDict[str, float] = OrderedDict()

    def wait_s(self, visitor: str, now: float) -> float | None:
        """How long this try has to wait before it is looked at; None: too many stand in line."""
        who = _neighbourhood(visitor)
        turn = max(now, self._next.get(who, now))
        if turn - now > LINE_S:
            return None
        self._next[who] = turn + PACE_S
        self._next.move_to_end(who)
        if len(self._next) > _REMEMBERED:
            self._next.popitem(last=False)
        return turn - now

    def forgive(self, visitor: str) -> None:
        """It was right: what was tried before does not count."""
        self._next.pop(_neighbourhood(visitor), None)


def _neighbourhood(visitor: str) -> str:
    """The address; of IPv6 the network, as one machine has as many addresses there as it likes."""
    address = ipaddress.ip_address(visitor.partition("%")[0])
    if address.version == 4:
        return str(address)
    if address.ipv4_mapped is not None:
        return str(address.ipv4_mapped)
    return str(ipaddress.ip_network((int(address), 64), strict=False))

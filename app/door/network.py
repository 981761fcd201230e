"""This machine on its network: its addresses and names, and a free port to serve on."""

from __future__ import annotations

import contextlib
import errno
import ipaddress
import os
import socket
import struct
import sys
from contextlib import closing
from pathlib import Path

from handstudio.errors import HandstudioError

LOOPBACK_HOSTS = frozenset({"localhost", "127.0.0.1", "[::1]"})
"""What this machine is called in the address line of its own browser."""

_ELSEWHERE = {socket.AF_INET: "192.0.2.1", socket.AF_INET6: "2001:db8::1"}
"""Addresses of documentation: asking for the way there sends nothing."""

_INTERFACE_ADDRESS = 0x8915  # SIOCGIFADDR of Linux
_TRIES = 100


def bind_address(host: str) -> str:
    """The numeric address that a host given by a person stands for.

    Raises:
        HandstudioError: nobody knows the name, or the address belongs to another machine.
    """
    name = host.strip().strip("[]")
    try:
        known = socket.getaddrinfo(name, None, type=socket.SOCK_STREAM)
    except (OSError, UnicodeError) as error:
        raise HandstudioError(
            "{host}: no machine of this name is known.",
            "Serve with --host 0.0.0.0 for the whole network, or name an address of this machine.",
            host=host,
        ) from error
    known.sort(key=lambda entry: entry[0] != socket.AF_INET)
    address = str(known[0][4][0])
    try:
        with closing(_probe(address, 0)):
            return address
    except OSError as error:
        raise HandstudioError(
            "{host}: this machine cannot serve there ({reason}).",
            "Name one of its own addresses ({addresses}), or 0.0.0.0 for all of them.",
            host=host,
            reason=error.strerror or error,
            addresses=", ".join(own_addresses()) or "127.0.0.1",
        ) from error


def is_loopback(address: str) -> bool:
    """Whether only this machine can reach the address."""
    return _parsed(address).is_loopback


def is_everywhere(address: str) -> bool:
    """Whether the address stands for all addresses of this machine."""
    return _parsed(address).is_unspecified


def same_machine(local: str, peer: str) -> bool:
    """Whether the two ends of a connection are on one machine."""
    return is_loopback(peer) or _parsed(local) == _parsed(peer)


def as_host(address: str) -> str:
    """An address as it stands in a link and in the header ``Host``."""
    parsed = _parsed(address)
    return f"[{parsed}]" if parsed.version == 6 else str(parsed)


def own_addresses(family: int = socket.AF_INET) -> tuple[str, ...]:
    """Addresses by which other machines reach this one, the most used first; maybe none."""
    found = [*_by_default_route(family), *_by_interface(family), *_by_name(family)]
    usable = [address for address in dict.fromkeys(found) if not is_loopback(address)]
    return tuple(address for address in usable if not _parsed(address).is_link_local)


def own_names() -> tuple[str, ...]:
    """Names of this machine, in small letters: its hostname, and that with ``.local``."""
    full = socket.gethostname().lower().rstrip(".")
    short = full.partition(".")[0]
    return tuple(dict.fromkeys(name for name in (full, short, f"{short}.local") if short))


def hosts(host: str, address: str) -> frozenset[str]:
    """Names under which a studio that serves at an address may be asked for, without port."""
    if is_loopback(address):
        return LOOPBACK_HOSTS | {as_host(address)}
    typed = set() if is_everywhere(address) else {host.strip().lower(), as_host(address)}
    return LOOPBACK_HOSTS | typed | set(own_names())


def nearest_host(address: str) -> str:
    """By which host this machine itself reaches what is served at an address."""
    if is_everywhere(address) or address in ("127.0.0.1", "::1"):
        return "localhost"
    return as_host(address)


def reachable_hosts(address: str) -> list[str]:
    """By which hosts others reach what is served at an address, to be shown; at least one."""
    if not is_everywhere(address):
        return [nearest_host(address)]
    family = socket.AF_INET6 if _parsed(address).version == 6 else socket.AF_INET
    found = [as_host(own) for own in own_addresses(family)]
    name = own_names()[-1:]
    return [*found, *name] if found else ["localhost"]


def free_port(address: str, wanted: int) -> int:
    """The wanted port, or the next one that is free.

    Raises:
        HandstudioError: it is no port, may not be used, or none of a hundred is free.
    """
    if not 0 <= wanted <= 65535:
        raise HandstudioError(
            "{port} is not the number of a port.", "Choose one from 1024 to 65535.", port=wanted
        )
    last = min(wanted + _TRIES, 65536) - 1
    for port in range(wanted, last + 1):
        try:
            with closing(_probe(address, port)):
                return port
        except OSError as error:
            if error.errno == errno.EACCES and port < 1024:
                raise HandstudioError(
                    "Port {port} may not be used by everybody.",
                    "Choose one from 1024 to 65535: --port 8765.",
                    port=port,
                ) from error
    raise HandstudioError(
        "No free port between {first} and {last}.",
        "Name another one: --port.",
        first=wanted,
        last=last,
    )


def _probe(address: str, port: int) -> socket.socket:
    family = socket.AF_INET6 if _parsed(address).version == 6 else socket.AF_INET
    probe = socket.socket(family)
    try:
        if os.name == "posix":  # on Windows this would take a port that is in use for free
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        probe.bind((address, port))
        probe.listen(1)  # with the option two may bind; that two listen is never allowed
    except BaseException:
        probe.close()
        raise
    return probe


def _parsed(address: str) -> ipaddress.IPv4Address | ipaddress.IPv6Address:
    parsed = ipaddress.ip_address(address.partition("%")[0])
    return getattr(parsed, "ipv4_mapped", None) or parsed


def _by_default_route(family: int) -> list[str]:
    with contextlib.suppress(OSError), closing(socket.socket(family, socket.SOCK_DGRAM)) as probe:
        probe.connect((_ELSEWHERE[socket.AddressFamily(family)], 9))
        return [str(probe.getsockname()[0])]
    return []


def _by_name(family: int) -> list[str]:
    with contextlib.suppress(OSError, UnicodeError):
        return [str(entry[4][0]) for entry in socket.getaddrinfo(socket.gethostname(), 0, family)]
    return []


def _by_interface(family: int) -> list[str]:
    if not sys.platform.startswith("linux"):
        return []
    return _interfaces_v6() if family == socket.AF_INET6 else _interfaces_v4()


def _interfaces_v4() -> list[str]:
    import fcntl  # noqa: PLC0415 - not on Windows

    found = []
    with closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as probe:
        for _, name in socket.if_nameindex():
            question = struct.pack("256s", name.encode()[:15])
            with contextlib.suppress(OSError):  # an interface without an address
                answer = fcntl.ioctl(probe.fileno(), _INTERFACE_ADDRESS, question)
                found.append(socket.inet_ntoa(answer[20:24]))
    return found


def _interfaces_v6() -> list[str]:
    with contextlib.suppress(OSError):
        lines = Path("/proc/net/if_inet6").read_text().splitlines()
        return [str(ipaddress.IPv6Address(bytes.fromhex(line.split()[0]))) for line in lines]
    return []

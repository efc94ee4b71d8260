"""Addresses of servers: what one may hold, and which of them lie on this machine."""

from ipaddress import ip_address
from urllib.parse import SplitResult, urlsplit

__all__ = ["act_url", "is_here", "server_address"]


def server_address(option: str, url: str) -> SplitResult:
    """The parts of a server's address.

    Args:
        option: that gives it, for the message.
        url: as typed.

    Raises:
        ValueError: it is none of http or https, or holds what must not stand in records: a password or a query.
    """
    try:
        parts = urlsplit(url)
        known = parts.scheme in ("http", "https") and bool(parts.hostname) and (parts.port is None or parts.port > 0)
    except ValueError:  # its text would tell what may be a password
        known = False
    if not known:
        raise ValueError(f"{option} is no address of a server; write http://HOST:PORT")
    if parts.username is not None or parts.password is not None or parts.query or parts.fragment:
        raise ValueError(
            f"{option} holds a password, a query or a fragment, which would stand in every record; leave it out"
        )
    return parts


def is_here(address: SplitResult) -> bool:
    """Whether what is sent there cannot leave this machine."""
    host = address.hostname or ""
    try:
        return host == "localhost" or ip_address(host).is_loopback
    except ValueError:  # a name, which may mean any machine
        return False


def act_url(url: str) -> str:
    """The address that actions are asked of: a server's own with `/act` behind it, if it is not there.

    Raises:
        ValueError: see `server_address`.
    """
    parts = server_address("url", url)
    path = parts.path.rstrip("/")
    return f"{parts.scheme}://{parts.netloc}{path if path.endswith('/act') else f'{path}/act'}"

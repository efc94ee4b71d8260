"""Checks on the addresses of servers."""

from ipaddress import ip_address
from urllib.parse import SplitResult, urlsplit

_HTTP = ("http", "https")
WEBSOCKET = ("ws", "wss")


def server_address(option: str, url: str, schemes: tuple[str, ...] = _HTTP) -> SplitResult:
    """Return the parts of an address; the message names the option that gives it.

    Raises:
        ValueError: the address has none of the schemes, or holds a password or a query, which would
            be recorded.
    """
    try:
        parts = urlsplit(url)
        is_valid = (
            parts.scheme in schemes
            and bool(parts.hostname)
            and (parts.port is None or parts.port > 0)
        )
    except ValueError:  # not chained: its text would repeat what may be a password
        is_valid = False
    if not is_valid:
        raise ValueError(f"{option} is not the address of a server; write {schemes[0]}://HOST:PORT")
    if parts.username is not None or parts.password is not None or parts.query or parts.fragment:
        raise ValueError(
            f"{option} holds a password, a query or a fragment, which would be written to every "
            "record; leave it out"
        )
    return parts


def is_local(address: SplitResult) -> bool:
    """Return whether requests to this address stay on this machine."""
    host = address.hostname or ""
    try:
        return host == "localhost" or ip_address(host).is_loopback
    except ValueError:  # any other name may resolve to another machine
        return False


def act_url(url: str) -> str:
    """Return the address that actions are requested from: the server's own, ending in `/act`.

    Raises:
        ValueError: see `server_address`.
    """
    parts = server_address("url", url)
    path = parts.path.rstrip("/")
    return f"{parts.scheme}://{parts.netloc}{path if path.endswith('/act') else f'{path}/act'}"

"""Options written as `k=v,k=v`."""

from collections.abc import Iterable

from infthor_eval.errors import UsageError

__all__ = ["read_pairs"]


def read_pairs(items: Iterable[str], option: str) -> dict[str, str]:
    """Return keys and values written as `k=v`; messages name the option that they belong to.

    Raises:
        UsageError: an item is not `k=v`, or a key is given twice.
    """
    pairs: dict[str, str] = {}
    for item in filter(None, (part.strip() for part in items)):
        key, equals, value = item.partition("=")
        if not equals or not key.strip():
            raise UsageError(f"{option}: {item!r} is not of the form key=value")
        if key.strip() in pairs:
            raise UsageError(f"{option}: {key.strip()!r} is given twice")
        pairs[key.strip()] = value.strip()
    return pairs

"""Encoded sequences that are kept, so that several memories are cut from one."""

from collections.abc import Callable, Sequence

from model_adapters.hf.cached.kv_cache import BufferedLayer
from model_adapters.hf.cached.prefix import Prefix
from model_adapters.hf.prompting.prompt import Piece


class PrefixStore:
    """Sequences that a model has encoded, within a limit of bytes; the longest unused go first.

    Args:
        make: makes an empty sequence.
        most_bytes: most bytes of keys and values of all of them; one is kept in any case.
    """

    def __init__(self, make: Callable[[], Prefix], most_bytes: int) -> None:
        self._make = make
        self._most_bytes = most_bytes
        self._stored: list[Prefix] = []  # the last used one last

    def clear(self) -> None:
        """Free the memory of all."""
        self._stored.clear()

    def encode(self, pieces: Sequence[Piece], *, exactly: bool) -> tuple[Prefix, int]:
        """Return a sequence that begins with these pieces, and how many were encoded already.

        Args:
            pieces: the pieces.
            exactly: True if it must end with them.
        """
        prefix = max(self._stored, key=lambda it: it.n_common(pieces), default=None)
        n_known = 0 if prefix is None else prefix.n_common(pieces)
        if prefix is None or (n_known < len(pieces) and n_known < prefix.n_pieces):
            prefix = self._make()  # another trajectory's stays as it is
            n_known = 0
        else:
            self._stored.remove(prefix)
        if n_known < len(pieces):
            prefix.feed(pieces[n_known:])
        elif exactly:
            prefix.cut(len(pieces))
        self._stored.append(prefix)
        while len(self._stored) > 1 and sum(map(_n_bytes, self._stored)) > self._most_bytes:
            del self._stored[0]
        return prefix, n_known


def _n_bytes(prefix: Prefix) -> int:
    layers = [layer for layer in prefix.cache.layers if isinstance(layer, BufferedLayer)]
    return sum(layer.n_bytes for layer in layers)

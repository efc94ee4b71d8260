"""Arrays in JSON as the package json_numpy writes them, which servers of the `/act` convention expect."""

import base64
import binascii
import json
from typing import Any

import numpy as np
import numpy.typing as npt

__all__ = ["decoded_numbers", "encoded"]

_MARK = "__numpy__"
_KINDS = "fiu"  # numbers; anything else could be an object that runs code when it is made


def encoded(array: npt.NDArray[Any]) -> dict[str, Any]:
    """An array as JSON values: its bytes in base 64, its type and its shape."""
    content = np.ascontiguousarray(array)
    return {
        _MARK: base64.b64encode(content.tobytes()).decode("ascii"),
        "dtype": content.dtype.str,
        "shape": list(content.shape),
    }


def decoded_numbers(value: Any) -> npt.NDArray[np.float64]:
    """Numbers that a server sent: lists, arrays of json_numpy, lists of either, or a text that holds such JSON.

    Args:
        value: as JSON was decoded.

    Raises:
        ValueError: it is anything else, or ragged.
    """
    if isinstance(value, str):  # a server that was asked in encoded form answers so
        try:
            value = json.loads(value)
        except ValueError as error:
            raise ValueError(f"the text {value[:80]!r}") from error
    return np.array(_plain(value), dtype=np.float64)


def _plain(value: Any) -> Any:
    if isinstance(value, list):
        return [_plain(item) for item in value]
    if isinstance(value, dict) and _MARK in value:
        return _decoded(value).tolist()
    if isinstance(value, int | float) and not isinstance(value, bool):
        return value
    raise ValueError(f"{type(value).__name__} {str(value)[:80]!r} among numbers")


def _decoded(value: dict[str, Any]) -> npt.NDArray[Any]:
    try:
        dtype = np.dtype(str(value["dtype"]))
        if dtype.kind not in _KINDS:
            raise ValueError(f"an array of {dtype}")
        return np.frombuffer(base64.b64decode(value[_MARK], validate=True), dtype).reshape(value["shape"])
    except (KeyError, TypeError, binascii.Error) as error:
        raise ValueError(f"a damaged array ({error})") from error

"""Arrays in JSON as by the package json_numpy, which servers of the `/act` convention expect."""

import base64
import binascii
import json
from typing import Any

import numpy as np
import numpy.typing as npt

_MARK = "__numpy__"
_KINDS = "fiu"  # numbers only: object arrays could run code when they are created


def encode_array(array: npt.NDArray[Any]) -> dict[str, Any]:
    """Return an array as JSON values: its bytes in base 64, its type and its shape."""
    content = np.ascontiguousarray(array)
    return {
        _MARK: base64.b64encode(content.tobytes()).decode("ascii"),
        "dtype": content.dtype.str,
        "shape": list(content.shape),
    }


def decode_numbers(value: Any) -> npt.NDArray[np.float64]:
    """Return the numbers in a reply's JSON: lists, arrays of json_numpy, lists of either, or a text
    with such JSON.

    Raises:
        ValueError: the value is anything else, or ragged.
    """
    if isinstance(value, str):  # the reply of some servers to encoded requests
        try:
            value = json.loads(value)
        except ValueError as error:
            raise ValueError(f"the text {value[:80]!r}") from error
    return np.array(_to_lists(value), dtype=np.float64)


def _to_lists(value: Any) -> Any:
    if isinstance(value, list):
        return [_to_lists(element) for element in value]
    if isinstance(value, dict) and _MARK in value:
        return _decode_array(value).tolist()
    if isinstance(value, int | float) and not isinstance(value, bool):
        return value
    raise ValueError(f"{type(value).__name__} {str(value)[:80]!r} among numbers")


def _decode_array(value: dict[str, Any]) -> npt.NDArray[Any]:
    try:
        dtype = np.dtype(str(value["dtype"]))
        if dtype.kind not in _KINDS:
            raise ValueError(f"an array of {dtype}")
        return np.frombuffer(base64.b64decode(value[_MARK], validate=True), dtype).reshape(
            value["shape"]
        )
    except (KeyError, TypeError, binascii.Error) as error:
        raise ValueError(f"a damaged array ({error})") from error

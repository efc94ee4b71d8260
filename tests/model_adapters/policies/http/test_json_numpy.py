"""Arrays in JSON, byte for byte as the package json_numpy writes them."""

import base64
import json
import struct
from typing import Any

import numpy as np
import pytest

from model_adapters.policies.http.json_numpy import decode_numbers, encode_array


def test_an_array_is_its_bytes_its_type_and_its_shape() -> None:
    assert encode_array(np.array([[1, 2, 255]], dtype=np.uint8)) == {
        "__numpy__": "AQL/",
        "dtype": "|u1",
        "shape": [1, 3],
    }


def test_an_array_that_is_a_view_is_written_in_its_own_order() -> None:
    turned = np.array([[1, 2], [3, 4]], dtype=np.uint8).T
    assert base64.b64decode(encode_array(turned)["__numpy__"]) == bytes([1, 3, 2, 4])


NUMBERS = [0.5, -1.0, 2.0]
ARRAY = {
    "__numpy__": base64.b64encode(struct.pack("<3d", *NUMBERS)).decode(),
    "dtype": "<f8",
    "shape": [3],
}


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (NUMBERS, NUMBERS),
        ([1, 2], [1.0, 2.0]),
        ([NUMBERS, NUMBERS], [NUMBERS, NUMBERS]),
        (ARRAY, NUMBERS),
        ([ARRAY, NUMBERS], [NUMBERS, NUMBERS]),
        (json.dumps(ARRAY), NUMBERS),  # as OpenVLA's server answers a request in encoded form
        (encode_array(np.array([[1.5]], dtype=">f4")), [[1.5]]),
    ],
)
def test_numbers_come_in_several_forms(value: Any, expected: Any) -> None:
    assert decode_numbers(value).tolist() == expected


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ("error", "the text 'error'"),
        ({"action": NUMBERS}, "dict"),
        ([*NUMBERS, "1"], "str '1' among numbers"),
        ([True], "bool"),
        (None, "NoneType"),
        ([NUMBERS, [1.0]], "inhomogeneous"),
        (ARRAY | {"dtype": "|O8"}, "array of object"),
        (ARRAY | {"shape": [4]}, "reshape"),
        (ARRAY | {"__numpy__": "*"}, "damaged array"),
        (ARRAY | {"dtype": "left"}, "damaged array"),
        ({"__numpy__": ARRAY["__numpy__"]}, "damaged array"),
    ],
)
def test_anything_else_is_refused(value: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        decode_numbers(value)

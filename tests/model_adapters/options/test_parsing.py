from dataclasses import dataclass

import pytest

from infthor_eval.errors import UsageError
from model_adapters.options import NoOptions, describe, parse


@dataclass(frozen=True)
class Options:
    text: str = "a"
    count: int = 3
    part: float = 0.5
    flag: bool = True
    limit: int | None = None

    def __post_init__(self):
        if self.count < 0:
            raise ValueError("count must not be negative")


def test_values_take_the_type_of_the_field():
    texts = {"text": "7", "count": "7", "part": "7", "flag": "No", "limit": "7"}
    assert parse("m", Options, texts) == Options("7", 7, 7.0, False, 7)


def test_what_is_left_out_takes_its_default():
    assert parse("m", Options, {}) == Options()


@pytest.mark.parametrize("text", ["none", "None", ""])
def test_none_where_the_field_allows_it(text):
    assert parse("m", Options, {"limit": text}).limit is None


@pytest.mark.parametrize(
    ("texts", "complaint"),
    [
        ({"count": "x"}, "m: count=x: give a whole number"),
        ({"count": "none"}, "m: count=none: give a whole number"),
        ({"flag": "maybe"}, "m: flag=maybe: give true or false"),
        ({"count": "-1"}, "m: count must not be negative"),
        ({"limits": "1"}, r"m has no option limits; did you mean limit\?"),
    ],
)
def test_what_does_not_fit_is_named_with_all_options(texts, complaint):
    with pytest.raises(UsageError, match=complaint) as caught:
        parse("m", Options, texts)
    assert "it takes: text=a, count=3, part=0.5, flag=true, limit=none" in str(caught.value)


@pytest.mark.parametrize(
    ("options", "beginning"), [(NoOptions, "no options"), (Options, "text=a, count=3")]
)
def test_describe(options, beginning):
    assert describe(options).startswith(beginning)


def test_an_option_without_a_default_must_be_given():
    @dataclass(frozen=True)
    class Required:
        path: str
        count: int = 3

    assert describe(Required) == "path (required), count=3"
    assert parse("m", Required, {"path": "x"}).path == "x"
    with pytest.raises(UsageError, match=r"m: the option path has no default; give it"):
        parse("m", Required, {"count": "1"})

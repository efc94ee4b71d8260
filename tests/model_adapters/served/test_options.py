"""What can be asked for, and what is refused before anything is sent."""

import pytest

from infthor_eval.errors import UsageError
from model_adapters import check_options, label, options_of

SECRET = "sk-0123456789abcdef"
ASKED = {"model": "m"}


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"model": ""}, "it needs model="),
        ({"base_url": "localhost:8000"}, "base_url is not the address of a server"),
        ({"base_url": "ftp://host/v1"}, "base_url is not the address of a server"),
        ({"base_url": f"https://me:{SECRET}@host/v1"}, "base_url holds a password"),
        ({"base_url": f"https://host/v1?key={SECRET}"}, "base_url holds a password, a query"),
        ({"base_url": "http://10.0.0.7:8000/v1"}, "base_url leads to 10.0.0.7 without encryption"),
        ({"base_url": "http://gpu-box/v1"}, "use https, or set insecure=true"),
        ({"base_url": "http://localhost.example.org/v1"}, "without encryption"),
        ({"base_url": "http://0.0.0.0:8000/v1"}, "without encryption"),
        ({"api_key_env": SECRET}, "api_key_env is not the name of an environment variable"),
        ({"api_key_env": ""}, "api_key_env is not the name"),
        ({"api_key": SECRET}, "no option api_key; did you mean api_key_env"),
        ({"image_format": "gif"}, "image_format=gif: give png or jpeg"),
        ({"detail": "fine"}, "detail=fine: give one of auto, low, high"),
        ({"max_tokens_field": "max_new_tokens"}, "give max_tokens or max_completion_tokens"),
        ({"guided": "sglang"}, "guided=sglang: give one of vllm"),
        ({"max_in_flight": "0"}, "max_in_flight=0: give a whole number from 1, at most 256"),
        ({"timeout_s": "0"}, "timeout_s=0: give a number of seconds from 0.01"),
        ({"timeout_s": "nan"}, "timeout_s=nan: give a number"),
        ({"retries": "-1"}, "retries=-1: give a whole number from 0, at most 20"),
        ({"requests_per_minute": "0"}, "requests_per_minute=0: give a number above 0"),
        ({"max_tokens_total": "0"}, "max_tokens_total=0: give a whole number from 1"),
        (
            {"price_per_m_input": "-1", "price_per_m_output": "1"},
            "price_per_m_input=-1: give a number from 0",
        ),
        ({"max_cost": "1"}, "max_cost needs price_per_m_input and price_per_m_output; give both"),
        (
            {"price_per_m_cached": "1", "price_per_m_input": "1"},
            "price_per_m_input needs price_per_m_input and",
        ),
    ],
)
def test_misuse_is_refused_in_one_line_that_tells_no_secret(settings, message):
    with pytest.raises(UsageError) as caught:
        check_options("openai", ASKED | settings)
    assert message in str(caught.value)
    assert SECRET not in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "url",
    [
        "http://127.0.0.1:8000/v1",
        "http://localhost:1/v1",
        "http://[::1]:80/v1",
        "https://gpu-box/v1",
        "http://127.9.9.9/",
    ],
)
def test_this_machine_may_be_asked_in_the_open_and_others_under_encryption(url):
    check_options("openai", ASKED | {"base_url": url})


def test_another_machine_may_be_asked_in_the_open_where_that_is_said():
    check_options("openai", ASKED | {"base_url": "http://gpu-box:8000/v1", "insecure": "true"})


def test_options_are_listed_with_their_defaults():
    listed = options_of("openai")
    assert listed["api_key_env"].default == "OPENAI_API_KEY"
    assert listed["max_cost"].default is None


@pytest.mark.parametrize(
    ("model", "named"), [("gpt-x", "gpt-x"), ("org/name-7b", "name-7b"), ("/a/folder", "folder")]
)
def test_a_run_is_called_by_the_servers_model(model, named):
    assert label("openai", {"model": model, "base_url": "https://host/v1"}) == named

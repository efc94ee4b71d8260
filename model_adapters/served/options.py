"""Options of models behind a server: address, form of requests, rate limits, spend caps, batches.

To add an option of served models: a field here, `in_config` if it can change a reply; its effect in
`model.py` or `endpoint.py`, or, of one dialect alone, in its module.
"""

import re
from dataclasses import dataclass
from typing import Annotated, Any

from msgspec import Meta

from infthor_eval.quantities import MOST, Amount, Total
from infthor_eval.settings import Setting, config_values
from model_adapters.addresses import is_local, server_address

_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_PRICES = (
    "price_per_m_input",
    "price_per_m_cached",
    "price_per_m_cache_write",
    "price_per_m_output",
)

# Only requests of agents have these: what others ask is the same whatever they are, so that the
# document names them only where they are not at their default.
_OF_AGENTS = ("send_repetition_penalty", "send_skip_special_tokens")

_AboveZero = Annotated[float, Meta(gt=0, le=MOST)]
_KeyName = Annotated[
    str,
    Setting(
        help="Name of the environment variable with the key; the key itself is never an option."
    ),
]


@dataclass(frozen=True, kw_only=True)
class ServedOptions:
    """Options of requests to a server; those in the config can change a reply."""

    model: Annotated[str, Setting(help="The server's name of the model.", in_config=True)] = ""
    base_url: Annotated[str, Setting(help="Address of the server.")] = ""
    api_key_env: _KeyName = ""
    insecure: Annotated[
        bool, Setting(help="Allow requests to another machine without encryption.")
    ] = False
    image_format: Annotated[
        str,
        Setting(
            help="Encoding of frames: png is lossless, jpeg (quality 95) is smaller.",
            choices=("png", "jpeg"),
            in_config=True,
        ),
    ] = "png"
    send_temperature: Annotated[
        bool,
        Setting(
            help="Send temperature and top_p; some models refuse them and decode in their own way.",
            in_config=True,
        ),
    ] = True
    send_stop: Annotated[
        bool,
        Setting(
            help="Send stop strings, as many as the server takes; replies are cut here in any "
            "case.",
            in_config=True,
        ),
    ] = True
    max_in_flight: Annotated[
        int, Meta(ge=1, le=256), Setting(help="Requests at the same time.")
    ] = 4
    timeout_s: Annotated[
        float,
        Meta(ge=0.01, le=86_400),
        Setting(
            help="Limit for a whole reply, from the connection to its last byte, in seconds.",
            of="seconds",
        ),
    ] = 300.0
    retries: Annotated[
        int,
        Meta(ge=0, le=20),
        Setting(help="Repetitions of a request after transient failures."),
    ] = 4
    requests_per_minute: Annotated[_AboveZero | None, Setting(help="Rate limit, kept evenly.")] = (
        None
    )
    tokens_per_minute: Annotated[
        _AboveZero | None,
        Setting(help="Rate limit of the tokens of requests and replies, kept evenly."),
    ] = None
    price_per_m_input: Annotated[
        Amount | None, Setting(help="US dollars per million tokens of requests.")
    ] = None
    price_per_m_cached: Annotated[
        Amount | None,
        Setting(
            help="US dollars per million cached tokens of requests; default: the price of others."
        ),
    ] = None
    price_per_m_cache_write: Annotated[
        Amount | None,
        Setting(
            help="US dollars per million tokens that a request put into the cache; default: the "
            "price of others."
        ),
    ] = None
    price_per_m_output: Annotated[
        Amount | None, Setting(help="US dollars per million tokens of replies.")
    ] = None
    max_tokens_total: Annotated[
        Total | None,
        Setting(help="Cap on the tokens of a run; no request is sent once it is reached."),
    ] = None
    max_cost: Annotated[
        _AboveZero | None,
        Setting(
            help="Cap on the cost of a run in US dollars; no request is sent once it is reached."
        ),
    ] = None
    batch: Annotated[
        bool,
        Setting(help="Ask in batches, at the price of batches; the replies come within a day."),
    ] = False
    batch_requests: Annotated[
        Annotated[int, Meta(ge=1, le=1_000_000)] | None,
        Setting(help="Most requests of a batch; default: the most that the server takes."),
    ] = None
    batch_mb: Annotated[
        Annotated[int, Meta(ge=1, le=2_000)] | None,
        Setting(help="Most megabytes of a batch; default: the most that the server takes."),
    ] = None

    def __post_init__(self) -> None:
        """Raise `ValueError` for a value that is not valid; the message names the option and
        repeats no secret."""
        if not self.model:
            raise ValueError("it needs model=..., the server's name of the model")
        if not _NAME.fullmatch(self.api_key_env):
            raise ValueError(
                "api_key_env is not the name of an environment variable; put the key into one"
            )
        self._check_address()
        if not self.batch and (self.batch_requests or self.batch_mb):
            raise ValueError("batch_requests and batch_mb are for batches; give batch=true, too")
        self._check_money()

    @property
    def url(self) -> str:
        """The address without a slash at its end."""
        return self.base_url.rstrip("/")

    def document(self) -> dict[str, Any]:
        """Return everything that can change a reply, as JSON values; rates and prices cannot, nor
        whether it is asked in a batch."""
        return {"base_url": self.url} | config_values(self)

    def _check_address(self) -> None:
        address = server_address("base_url", self.base_url)
        if address.scheme == "http" and not (is_local(address) or self.insecure):
            raise ValueError(
                f"base_url leads to {address.hostname} without encryption, readable by everyone in "
                "between; use https, or set insecure=true"
            )

    def _check_money(self) -> None:
        needed = (self.price_per_m_input, self.price_per_m_output)
        money_options = [name for name in ("max_cost", *_PRICES) if getattr(self, name) is not None]
        if money_options and None in needed:
            raise ValueError(
                f"{money_options[0]} needs price_per_m_input and price_per_m_output; give both"
            )


@dataclass(frozen=True, kw_only=True)
class OpenAIOptions(ServedOptions):
    """Options of requests to a server of OpenAI's chat completions, beside `ServedOptions`."""

    base_url: Annotated[str, Setting(help="Address of the server without /chat/completions.")] = (
        "https://api.openai.com/v1"
    )
    api_key_env: _KeyName = "OPENAI_API_KEY"
    detail: Annotated[
        str | None,
        Setting(
            help="Value of `detail` for every frame; default: not sent.",
            choices=("auto", "low", "high"),
            in_config=True,
        ),
    ] = None
    max_tokens_field: Annotated[
        str,
        Setting(
            help="Name of the field that limits the reply.",
            choices=("max_tokens", "max_completion_tokens"),
            in_config=True,
        ),
    ] = "max_tokens"
    send_seed: Annotated[
        bool, Setting(help="Send the seed of sampled replies.", in_config=True)
    ] = True
    send_repetition_penalty: Annotated[
        bool,
        Setting(
            help="Send the penalty of requests that have one, as agents' have; OpenAI itself "
            "refuses it."
        ),
    ] = True
    send_skip_special_tokens: Annotated[
        bool,
        Setting(
            help="Send `skip_special_tokens: false` with stop strings, as agents have: else vLLM "
            "and SGLang strip `<|act|>` from the text before they look for it. OpenAI itself "
            "refuses it."
        ),
    ] = True
    guided: Annotated[
        str | None,
        Setting(
            help="How replies are restricted to choices: vllm sends its `structured_outputs`; "
            "default: they cannot be.",
            choices=("vllm",),
            in_config=True,
        ),
    ] = None
    send_prompt_cache_key: Annotated[
        bool,
        Setting(
            help="Send a hash of the frames as `prompt_cache_key`, so that requests on the same "
            "frames reach the same cache."
        ),
    ] = False

    def document(self) -> dict[str, Any]:
        """See `ServedOptions`."""
        return super().document() | {name: False for name in _OF_AGENTS if not getattr(self, name)}


@dataclass(frozen=True, kw_only=True)
class AnthropicOptions(ServedOptions):
    """Options of requests to a server of Anthropic's messages, beside `ServedOptions`."""

    base_url: Annotated[str, Setting(help="Address of the server without /messages.")] = (
        "https://api.anthropic.com/v1"
    )
    api_key_env: _KeyName = "ANTHROPIC_API_KEY"
    prompt_cache: Annotated[
        str,
        Setting(
            help="How long the server caches what is before the question, frames included; what is "
            "put into the cache has a price of its own.",
            choices=("5m", "1h", "off"),
        ),
    ] = "5m"


@dataclass(frozen=True, kw_only=True)
class GeminiOptions(ServedOptions):
    """Options of requests to a server of the Gemini API, beside `ServedOptions`."""

    base_url: Annotated[str, Setting(help="Address of the server without /models.")] = (
        "https://generativelanguage.googleapis.com/v1beta"
    )
    api_key_env: _KeyName = "GEMINI_API_KEY"
    send_seed: Annotated[
        bool, Setting(help="Send the seed of sampled replies.", in_config=True)
    ] = True

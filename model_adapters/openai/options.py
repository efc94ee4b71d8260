"""Options of models behind a server: address, form of requests, rate limits and spend caps.

To add an option of served models: a field here, in `_IN_IDENTITY` if it can change a reply; its
effect in `model.py`, `messages.py` or `endpoint.py`.
"""

import re
from dataclasses import dataclass
from typing import Any

from model_adapters.addresses import is_local, server_address

__all__ = ["OpenAIOptions"]

_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_ONE_OF = {
    "image_format": ("png", "jpeg"),
    "detail": (None, "auto", "low", "high"),
    "max_tokens_field": ("max_tokens", "max_completion_tokens"),
    "guided": (None, "vllm"),
}
_RANGES = {"max_in_flight": (1, 256), "retries": (0, 20), "timeout_s": (0.01, 86_400)}
_ABOVE_ZERO = ("requests_per_minute", "tokens_per_minute", "max_tokens_total", "max_cost")
_PRICES = ("price_per_m_input", "price_per_m_cached", "price_per_m_output")
_IN_IDENTITY = (  # options that can change a reply; rates and prices cannot
    "model",
    "image_format",
    "detail",
    "max_tokens_field",
    "send_seed",
    "send_temperature",
    "send_stop",
    "guided",
)
# Only requests of agents have these: what others ask is the same whatever they are, so that the
# document names them only where they are not at their default.
_OF_AGENTS = ("send_repetition_penalty", "send_skip_special_tokens")


@dataclass(frozen=True, kw_only=True)
class OpenAIOptions:
    """Options of requests to a server.

    Attributes:
        model: the server's name of the model.
        base_url: address of the server without `/chat/completions`.
        api_key_env: name of the environment variable with the key; the key itself is never an
            option.
        insecure: allow requests to another machine without encryption.
        image_format: encoding of frames: png is lossless, jpeg (quality 95) is smaller.
        detail: value of `detail` for every frame; not sent where None.
        max_tokens_field: name of the field that limits the reply.
        send_seed: send the seed of sampled replies.
        send_temperature: send temperature and top_p; some models refuse them and decode in their
            own way.
        send_stop: send stop strings, at most 4; replies are cut here in any case.
        send_repetition_penalty: send the penalty of requests that have one, as agents' have; OpenAI
            itself refuses it.
        send_skip_special_tokens: send `skip_special_tokens: false` with stop strings, as agents
            have: else vLLM and SGLang strip `<|act|>` from the text before they look for it. OpenAI
            itself refuses it.
        guided: method that restricts replies to choices: `vllm` sends its `structured_outputs`;
            None for no support.
        max_in_flight: requests at the same time.
        timeout_s: limit for a whole reply, from the connection to its last byte, in seconds.
        retries: repetitions of a request after transient failures.
        requests_per_minute: rate limit, kept evenly; None for none.
        tokens_per_minute: rate limit of the tokens of requests and replies, kept evenly; None for
            none.
        price_per_m_input: US dollars per million tokens of requests.
        price_per_m_cached: US dollars per million cached tokens of requests; as the others where
            None.
        price_per_m_output: US dollars per million tokens of replies.
        max_tokens_total: cap on the tokens of a run; no request is sent once it is reached.
        max_cost: cap on the cost of a run in US dollars; no request is sent once it is reached.
    """

    model: str = ""
    base_url: str = "https://api.openai.com/v1"
    api_key_env: str = "OPENAI_API_KEY"
    insecure: bool = False
    image_format: str = "png"
    detail: str | None = None
    max_tokens_field: str = "max_tokens"
    send_seed: bool = True
    send_temperature: bool = True
    send_stop: bool = True
    send_repetition_penalty: bool = True
    send_skip_special_tokens: bool = True
    guided: str | None = None
    max_in_flight: int = 4
    timeout_s: float = 300.0
    retries: int = 4
    requests_per_minute: float | None = None
    tokens_per_minute: float | None = None
    price_per_m_input: float | None = None
    price_per_m_cached: float | None = None
    price_per_m_output: float | None = None
    max_tokens_total: int | None = None
    max_cost: float | None = None

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
        self._check_values()
        self._check_money()

    @property
    def url(self) -> str:
        """The address without a slash at its end."""
        return self.base_url.rstrip("/")

    def document(self) -> dict[str, Any]:
        """Return everything that can change a reply, as JSON values."""
        document = {"base_url": self.url} | {name: getattr(self, name) for name in _IN_IDENTITY}
        return document | {name: False for name in _OF_AGENTS if not getattr(self, name)}

    def _check_address(self) -> None:
        address = server_address("base_url", self.base_url)
        if address.scheme == "http" and not (is_local(address) or self.insecure):
            raise ValueError(
                f"base_url leads to {address.hostname} without encryption, readable by everyone in "
                "between; use https, or set insecure=true"
            )

    def _check_values(self) -> None:
        for name, allowed in _ONE_OF.items():
            if getattr(self, name) not in allowed:
                known = " or ".join(value for value in allowed if value is not None)
                raise ValueError(f"{name}={getattr(self, name)} is not {known}")
        for name, (least, most) in _RANGES.items():
            value = getattr(self, name)
            if value is not None and not least <= value <= most:
                raise ValueError(f"{name}={value} is not from {least:,} to {most:,}")
        for name in _ABOVE_ZERO:
            if getattr(self, name) is not None and not getattr(self, name) > 0:
                raise ValueError(f"{name}={getattr(self, name)} is not above 0")

    def _check_money(self) -> None:
        for name in _PRICES:
            if getattr(self, name) is not None and not getattr(self, name) >= 0:
                raise ValueError(f"{name}={getattr(self, name)} is below 0")
        needed = (self.price_per_m_input, self.price_per_m_output)
        money_options = [name for name in ("max_cost", *_PRICES) if getattr(self, name) is not None]
        if money_options and None in needed:
            raise ValueError(
                f"{money_options[0]} needs price_per_m_input and price_per_m_output; give both"
            )

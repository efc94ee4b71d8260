"""Options of models behind a server: whom to ask and how, how fast, and what it may cost."""

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
_ACTING = (  # on a reply; how fast and how dear a server may be asked is not
    "model",
    "image_format",
    "detail",
    "max_tokens_field",
    "send_seed",
    "send_temperature",
    "send_stop",
    "guided",
)


@dataclass(frozen=True, kw_only=True)
class OpenAIOptions:
    """How a server is asked.

    Attributes:
        model: as the server calls it.
        base_url: of the server, up to where `/chat/completions` follows.
        api_key_env: name of the environment variable with the key; the key itself is never an option.
        insecure: whether another machine may be asked without encryption.
        image_format: how frames are sent: png loses nothing, jpeg (quality 95) is smaller.
        detail: sent with every frame where it is given; what it means is the server's business.
        max_tokens_field: what the server calls the limit of a reply.
        send_seed: whether the seed of a draw is sent.
        send_temperature: whether temperature and top_p are sent; some models take none and decode in their own way.
        send_stop: whether stop strings are sent, at most 4; replies are cut here in any case.
        guided: how replies are held to choices: `vllm` sends its `structured_outputs`; None holds none.
        max_in_flight: requests at the same time.
        timeout_s: for a whole reply, from the connection to its last byte.
        retries: how often a request is sent again after a passing failure.
        requests_per_minute: that are sent at most, evenly; None sets no limit.
        tokens_per_minute: of requests and replies, likewise.
        price_per_m_input: US dollars of a million tokens that are read.
        price_per_m_cached: of those among them that the server had in its cache; as the others where None.
        price_per_m_output: of those that are written.
        max_tokens_total: no request is begun once a run has taken so many tokens.
        max_cost: nor once it has cost so many US dollars.
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
        """Refuse what cannot be, without a word of what may be a secret.

        Raises:
            ValueError: names the option.
        """
        if not self.model:
            raise ValueError("it needs model=..., as the server calls it")
        if not _NAME.fullmatch(self.api_key_env):
            raise ValueError("api_key_env is no name of an environment variable; put the key there, never on a command")
        self._check_address()
        self._check_values()
        self._check_money()

    @property
    def url(self) -> str:
        """The address without a stroke at its end."""
        return self.base_url.rstrip("/")

    def document(self) -> dict[str, Any]:
        """All that can change a reply, as JSON values."""
        return {"base_url": self.url} | {name: getattr(self, name) for name in _ACTING}

    def _check_address(self) -> None:
        address = server_address("base_url", self.base_url)
        if address.scheme == "http" and not (is_local(address) or self.insecure):
            raise ValueError(
                f"base_url leads to {address.hostname} without encryption, for all on the way to read; "
                "use https, or say insecure=true"
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
        asked = [name for name in ("max_cost", *_PRICES) if getattr(self, name) is not None]
        if asked and None in needed:
            raise ValueError(f"{asked[0]} needs price_per_m_input and price_per_m_output; give both")

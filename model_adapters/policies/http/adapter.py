"""The adapter `vla-http`: any policy that a server answers for."""

from typing import Any, ClassVar

import numpy as np

from infthor_eval.errors import ModelError
from infthor_eval.formats.frames import FrameRef
from model_adapters.addresses import act_url
from model_adapters.options.policies import VlaHttpOptions
from model_adapters.policies.http.client import JsonClient
from model_adapters.policies.http.json_numpy import decoded_numbers, encoded
from model_adapters.policies.policy import arm_deltas
from model_adapters.protocols import ArmDelta, Capabilities

__all__ = ["HttpPolicy", "VlaHttp"]


class HttpPolicy:
    """A policy behind a server.

    Args:
        name: the registry's name.
        options: how it is asked.
    """

    def __init__(self, name: str, options: VlaHttpOptions) -> None:
        self.name = name
        self._options = options
        self._url = act_url(options.url)
        self._client = JsonClient(self._url, timeout_s=options.timeout_s, retries=options.retries)

    @property
    def capabilities(self) -> Capabilities:
        """Nothing is promised of a server that is not known."""
        return Capabilities(counts_tokens=False, token_ids=False, deterministic=False)

    def identity(self) -> dict[str, Any]:
        """Address and how it is asked, as JSON values; what stands behind the address is not known."""
        options = self._options
        return {
            "adapter": self.name,
            "url": self._url,
            "unnorm_key": options.unnorm_key,
            "image": options.image,
            "execute": options.execute,
        }

    def reset(self) -> None:
        """Nothing: the convention knows no episodes."""

    def act(self, frame: FrameRef, instruction: str) -> tuple[ArmDelta, ...]:
        """The next steps; see `Policy.act`."""
        pixels = np.asarray(frame.load())
        asked: dict[str, Any] = {
            "image": pixels.tolist() if self._options.image == "list" else encoded(pixels),
            "instruction": instruction,
        }
        if self._options.unnorm_key is not None:
            asked["unnorm_key"] = self._options.unnorm_key
        reply = self._client.post(asked)
        try:
            numbers = decoded_numbers(reply)
        except (ValueError, OverflowError) as error:
            raise ModelError(f"{self._url} answers no action of numbers: {error}; see its log") from error
        actions = numbers[None] if numbers.ndim == 1 else numbers
        return arm_deltas(f"{self.name} ({self._url})", actions)[: self._options.execute]

    def close(self) -> None:
        """Nothing is kept open."""


class VlaHttp:
    """The adapter `vla-http`."""

    Options: ClassVar[type] = VlaHttpOptions

    @classmethod
    def build(cls, name: str, options: VlaHttpOptions, seed: int) -> HttpPolicy:  # noqa: ARG003
        """Make the client; the server is asked when it is to act."""
        return HttpPolicy(name, options)

"""The adapter `vla-http`: any policy behind a server."""

from typing import Any, ClassVar

import numpy as np

from infthor_eval.errors import ModelError
from infthor_eval.formats.frames import FrameRef
from model_adapters.addresses import act_url
from model_adapters.options.policies import VlaHttpOptions
from model_adapters.policies.http.client import JsonClient
from model_adapters.policies.http.json_numpy import decode_numbers, encode_array
from model_adapters.policies.policy import arm_deltas
from model_adapters.protocols import ArmDelta, Capabilities


class HttpPolicy:
    """A policy behind a server."""

    def __init__(self, name: str, options: VlaHttpOptions) -> None:
        self.name = name
        self._options = options
        self._url = act_url(options.url)
        self._client = JsonClient(self._url, timeout_s=options.timeout_s, retries=options.retries)

    @property
    def capabilities(self) -> Capabilities:
        """No guarantees: the server is unknown."""
        return Capabilities(counts_tokens=False, token_ids=False, deterministic=False)

    def identity(self) -> dict[str, Any]:
        """Return address and form of requests, as JSON values; the policy is unknown."""
        options = self._options
        return {
            "adapter": self.name,
            "url": self._url,
            "unnorm_key": options.unnorm_key,
            "image": options.image,
            "execute": options.execute,
        }

    def reset(self) -> None:
        """Do nothing: the convention has no episodes."""

    def act(self, frame: FrameRef, instruction: str) -> tuple[ArmDelta, ...]:
        """Return the next steps; see `Policy.act`."""
        pixels = np.asarray(frame.load())
        request: dict[str, Any] = {
            "image": pixels.tolist() if self._options.image == "list" else encode_array(pixels),
            "instruction": instruction,
        }
        if self._options.unnorm_key is not None:
            request["unnorm_key"] = self._options.unnorm_key
        reply = self._client.post(request)
        try:
            numbers = decode_numbers(reply)
        except (ValueError, OverflowError) as error:
            raise ModelError(
                f"{self._url} answers without an action of numbers: {error}; see its log"
            ) from error
        actions = numbers[None] if numbers.ndim == 1 else numbers
        return arm_deltas(f"{self.name} ({self._url})", actions)[: self._options.execute]

    def close(self) -> None:
        """Do nothing: no connection is kept open."""


class VlaHttp:
    """The adapter `vla-http`."""

    Options: ClassVar[type] = VlaHttpOptions

    @classmethod
    def build(cls, name: str, options: VlaHttpOptions, seed: int) -> HttpPolicy:  # noqa: ARG003
        """Build the client; the first request is sent by `act`."""
        return HttpPolicy(name, options)

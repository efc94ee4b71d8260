"""The adapters of models behind a server, one for each dialect."""

from dataclasses import fields
from typing import TYPE_CHECKING, ClassVar
from urllib.parse import urlsplit

from model_adapters.served.options import (
    AnthropicOptions,
    GeminiOptions,
    OpenAIOptions,
    ServedOptions,
)
from model_adapters.served.secret import Secret, read_key

if TYPE_CHECKING:
    from model_adapters.served.model import ServedModel


class OpenAI:
    """The adapter `openai`: any model behind a server with OpenAI's chat completions."""

    Options: ClassVar[type] = OpenAIOptions

    @classmethod
    def build(cls, name: str, options: OpenAIOptions, seed: int) -> "ServedModel":  # noqa: ARG003
        """Build the client; the first request is sent by the first reply."""
        from model_adapters.served.model import ServedModel
        from model_adapters.served.openai import OpenAIDialect

        return ServedModel(name, options, _key(options), OpenAIDialect(name, options))


class Anthropic:
    """The adapter `anthropic`: any model behind a server with Anthropic's messages."""

    Options: ClassVar[type] = AnthropicOptions

    @classmethod
    def build(
        cls,
        name: str,
        options: AnthropicOptions,
        seed: int,  # noqa: ARG003
    ) -> "ServedModel":
        """See `OpenAI`."""
        from model_adapters.served.anthropic import AnthropicDialect
        from model_adapters.served.model import ServedModel

        return ServedModel(name, options, _key(options), AnthropicDialect(name, options))


class Gemini:
    """The adapter `gemini`: any model behind a server with the Gemini API."""

    Options: ClassVar[type] = GeminiOptions

    @classmethod
    def build(cls, name: str, options: GeminiOptions, seed: int) -> "ServedModel":  # noqa: ARG003
        """See `OpenAI`."""
        from model_adapters.served.gemini import GeminiDialect
        from model_adapters.served.model import ServedModel

        return ServedModel(name, options, _key(options), GeminiDialect(name, options))


def _key(options: ServedOptions) -> Secret:
    """Return the key; the servers of the dialects' makers require one."""
    defaults = {field.name: str(field.default) for field in fields(options)}
    needed = urlsplit(options.url).hostname == urlsplit(defaults["base_url"]).hostname
    return read_key(options.api_key_env, usual=defaults["api_key_env"], needed=needed)

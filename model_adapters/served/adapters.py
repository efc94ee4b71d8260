"""The adapters of models behind a server, one for each dialect."""

from dataclasses import fields
from typing import Any, ClassVar
from urllib.parse import urlsplit

from model_adapters.served.anthropic import AnthropicDialect
from model_adapters.served.gemini import GeminiDialect
from model_adapters.served.model import ServedModel
from model_adapters.served.openai import OpenAIDialect
from model_adapters.served.options import (
    AnthropicOptions,
    GeminiOptions,
    OpenAIOptions,
    ServedOptions,
)
from model_adapters.served.secret import Secret, read_key


class _ServedAdapter:
    """Base of the adapters, each with the options and the class of its dialect."""

    Options: ClassVar[type[ServedOptions]]
    dialect: ClassVar[type[Any]]

    @classmethod
    def build(cls, name: str, options: ServedOptions, seed: int) -> ServedModel:  # noqa: ARG003
        """Build the client; the first request is sent by the first reply."""
        return ServedModel(name, options, _key(options), cls.dialect(name, options))


class OpenAI(_ServedAdapter):
    """The adapter `openai`: any model behind a server with OpenAI's chat completions."""

    Options = OpenAIOptions
    dialect = OpenAIDialect


class Anthropic(_ServedAdapter):
    """The adapter `anthropic`: any model behind a server with Anthropic's messages."""

    Options = AnthropicOptions
    dialect = AnthropicDialect


class Gemini(_ServedAdapter):
    """The adapter `gemini`: any model behind a server with the Gemini API."""

    Options = GeminiOptions
    dialect = GeminiDialect


def _key(options: ServedOptions) -> Secret:
    """Return the key; the servers of the dialects' makers require one."""
    defaults = {field.name: str(field.default) for field in fields(options)}
    needed = urlsplit(options.url).hostname == urlsplit(defaults["base_url"]).hostname
    return read_key(options.api_key_env, usual=defaults["api_key_env"], needed=needed)

"""The adapter `openai`: any model behind a server with OpenAI's chat completions."""

from typing import TYPE_CHECKING, ClassVar
from urllib.parse import urlsplit

from infthor_eval.errors import ModelError, wrap_errors
from model_adapters.openai.options import OpenAIOptions
from model_adapters.openai.secret import read_key

if TYPE_CHECKING:
    from model_adapters.openai.model import ServedModel

__all__ = ["OpenAI"]

_NEEDS_KEY = "api.openai.com"


class OpenAI:
    """The adapter `openai`."""

    Options: ClassVar[type] = OpenAIOptions

    @classmethod
    def build(cls, name: str, options: OpenAIOptions, seed: int) -> "ServedModel":  # noqa: ARG003
        """Build the client; the first request is sent by the first reply.

        Raises:
            ModelError: the client library is not installed, or a required key is missing.
        """
        hint = "pip install 'infthor-eval[openai]'"
        with wrap_errors(
            f"{name} needs the package openai, 3 or newer",
            hint,
            catch=ImportError,
            raise_as=ModelError,
        ):
            from model_adapters.openai.model import ServedModel
        key = read_key(options.api_key_env, needed=urlsplit(options.url).hostname == _NEEDS_KEY)
        return ServedModel(name, options, key)

"""How large, deep or long what is read may be.

All of it comes from elsewhere, and a small file can ask for all memory, or for ever. The limits are far above what real
data need; each can be raised by an environment variable, which the message names.
"""

import os
from dataclasses import dataclass

from infthor_eval.errors import UsageError

__all__ = [
    "ALIAS_NODES",
    "FILE_MB",
    "IMAGE_ASPECT",
    "IMAGE_MEGAPIXELS",
    "LINE_MB",
    "TEMPLATE_CHARACTERS",
    "TEMPLATE_MB",
    "TEMPLATE_SECONDS",
    "TRAJECTORIES",
    "Limit",
]


@dataclass(frozen=True)
class Limit:
    """One limit.

    Attributes:
        name: of the environment variable that raises it.
        default: the limit where that is not set.
    """

    name: str
    default: int

    @property
    def value(self) -> int:
        """The limit in force.

        Raises:
            UsageError: the variable is no whole number above 0.
        """
        given = os.environ.get(self.name)
        if given is None:
            return self.default
        if not (given.isascii() and given.isdecimal() and len(given) <= 18 and int(given) > 0):
            raise UsageError(f"{self.name}={given[:40]}: not a whole number above 0; set it to one, or unset it")
        return int(given)

    @property
    def hint(self) -> str:
        """How to raise it."""
        return f"if it is meant, set {self.name} to more than {self.value}"


FILE_MB = Limit("INFTHOR_EVAL_MAX_FILE_MB", 2048)  # of a file that is read as a whole; unpacked, where it is packed
LINE_MB = Limit("INFTHOR_EVAL_MAX_LINE_MB", 256)  # of a line of a file that is read by lines
IMAGE_MEGAPIXELS = Limit("INFTHOR_EVAL_MAX_IMAGE_MEGAPIXELS", 50)
IMAGE_ASPECT = Limit("INFTHOR_EVAL_MAX_IMAGE_ASPECT", 100)  # longer side over shorter; image processors refuse 200
ALIAS_NODES = Limit("INFTHOR_EVAL_MAX_YAML_NODES", 100_000)  # of a YAML document with its aliases written out
TRAJECTORIES = Limit("INFTHOR_EVAL_MAX_TRAJECTORIES", 1_000_000)  # that one command is to make
TEMPLATE_SECONDS = Limit("INFTHOR_EVAL_MAX_TEMPLATE_SECONDS", 60)  # of computing, for one text from a chat template
TEMPLATE_MB = Limit("INFTHOR_EVAL_MAX_TEMPLATE_MB", 2048)  # of memory, likewise
TEMPLATE_CHARACTERS = Limit("INFTHOR_EVAL_MAX_TEMPLATE_CHARACTERS", 16_000_000)  # of that text

"""Limits on the size of files that are read, and on the time that others may take.

Input is untrusted: a small file can unpack to more than the memory, or keep a template engine busy
for ever. The limits are far above what real data need. Each can be raised by an environment
variable, which the error message names.
"""

import os
from dataclasses import dataclass

from infthor_eval.errors import UsageError


@dataclass(frozen=True)
class Limit:
    """A limit, named as the environment variable that changes it."""

    name: str
    default: int

    @property
    def value(self) -> int:
        """The limit in force.

        Raises:
            UsageError: the variable is not a whole number above 0.
        """
        text = os.environ.get(self.name)
        if text is None:
            return self.default
        if not (text.isascii() and text.isdecimal() and len(text) <= 18 and int(text) > 0):
            raise UsageError(
                f"{self.name}={text[:40]}: not a whole number above 0; set it to one, or unset it"
            )
        return int(text)

    @property
    def hint(self) -> str:
        """The way to raise it, for messages."""
        return f"if this is intended, set {self.name} to more than {self.value}"


FILE_MB = Limit("INFTHOR_EVAL_MAX_FILE_MB", 2048)  # size of a file, unpacked
# Size of one line in files that are read line by line.
LINE_MB = Limit("INFTHOR_EVAL_MAX_LINE_MB", 256)
# Size of one line of a CSV file, whose reader takes several times that of memory.
CSV_LINE_MB = Limit("INFTHOR_EVAL_MAX_CSV_LINE_MB", 16)
IMAGE_MEGAPIXELS = Limit("INFTHOR_EVAL_MAX_IMAGE_MEGAPIXELS", 50)
# Longer side over shorter; image processors refuse 200.
IMAGE_ASPECT = Limit("INFTHOR_EVAL_MAX_IMAGE_ASPECT", 100)
# Values of a YAML document with all aliases expanded.
ALIAS_NODES = Limit("INFTHOR_EVAL_MAX_YAML_NODES", 100_000)
# Recorded poses of one scene; real ones have up to 60.
OBJECT_POSES = Limit("INFTHOR_EVAL_MAX_OBJECT_POSES", 1000)
# Low-level actions, at least, that a trajectory may be asked to have.
STEPS = Limit("INFTHOR_EVAL_MAX_STEPS", 100_000)
# Trajectories that one command may generate.
TRAJECTORIES = Limit("INFTHOR_EVAL_MAX_TRAJECTORIES", 1_000_000)
# Time of a chat template, per text.
TEMPLATE_SECONDS = Limit("INFTHOR_EVAL_MAX_TEMPLATE_SECONDS", 60)
TEMPLATE_MB = Limit("INFTHOR_EVAL_MAX_TEMPLATE_MB", 2048)  # memory of a chat template, per text
# Length of the text it produces.
TEMPLATE_CHARACTERS = Limit("INFTHOR_EVAL_MAX_TEMPLATE_CHARACTERS", 16_000_000)
# Time of one action in the embedded simulator.
ACTION_SECONDS = Limit("INFTHOR_EVAL_MAX_ACTION_SECONDS", 30)
# Time of a memory for one step, or to recall, without what it asks the model.
MEMORY_SECONDS = Limit("INFTHOR_EVAL_MAX_MEMORY_SECONDS", 600)
# Time of a scorer, or of a task's own metrics, for one reply.
SCORER_SECONDS = Limit("INFTHOR_EVAL_MAX_SCORER_SECONDS", 60)
JUDGE_SECONDS = Limit("INFTHOR_EVAL_MAX_JUDGE_SECONDS", 600)  # time of a judge for one verdict
# Time of a file of one's own to be imported, and of whatever is one's own to be closed.
OWN_CODE_SECONDS = Limit("INFTHOR_EVAL_MAX_OWN_CODE_SECONDS", 600)
# In Unity; AI2-THOR's own limit.
UNITY_ACTION_SECONDS = Limit("INFTHOR_EVAL_MAX_UNITY_ACTION_SECONDS", 100)

"""The bundled set as a folder, and its trajectories by their scene: seeds may change."""

from infthor_eval.formats.packed.writing import unpack_set
from infthor_eval.storage.folders import packaged_folder
from infthor_eval.storage.scratch import ScratchFolder

PACKED = packaged_folder("sets/nieh_mini")
_scratch = ScratchFolder()
BUNDLED = _scratch.path
unpack_set(PACKED, BUNDLED, skip_damaged=False)


def bundled_name(scene: str) -> str:
    """The name of the trajectory in a scene."""
    (folder,) = (BUNDLED / "metadata").glob(f"{scene}-seed*")
    return folder.name

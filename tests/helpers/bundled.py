"""The bundled set's trajectories by their scene: their seeds change when the set is made again."""

from infthor_eval.storage.folders import packaged_folder

BUNDLED = packaged_folder("sets/nieh_mini")


def bundled_name(scene: str) -> str:
    """The name of the trajectory in a scene."""
    (folder,) = (BUNDLED / "metadata").glob(f"{scene}-seed*")
    return folder.name

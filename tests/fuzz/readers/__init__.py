"""Every reader of the project, by name. A new reader is a row in one of these modules."""

from ..reader import Reader
from . import files, models, runs, sets, simulator, texts, trajectories, twins, yaml_files

__all__ = ["READERS"]

_MODULES = (trajectories, sets, files, yaml_files, runs, models, texts, twins, simulator)
READERS: dict[str, Reader] = {
    reader.name: reader for module in _MODULES for reader in module.READERS
}

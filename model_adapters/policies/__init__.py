"""Vision-language-action policies: ports of published checkpoints, and a client of any server.

Remote code, timm and torchvision are not needed: the keys of a checkpoint are mapped to modules of
this package or of transformers.
"""

import model_adapters.lean_transformers  # noqa: F401 - before any module imports transformers

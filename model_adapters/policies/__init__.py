"""Vision-language-action policies: published checkpoints as native ports, and a client for any other behind a server.

No remote code, no timm, no torchvision: what a checkpoint's file holds is mapped, key by key, to modules written here
or in transformers.
"""

import model_adapters.lean_transformers  # noqa: F401 - before any module imports transformers

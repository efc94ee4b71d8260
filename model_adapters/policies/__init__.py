"""Vision-language-action policies: ports of published checkpoints, and a client of any server.

Remote code, timm and torchvision are not needed: the keys of a checkpoint are mapped to modules of
this package or of transformers.

To add a policy: a package here (network, keys of its checkpoint, action tokens), its line in
`model_adapters/built_in.py`, options in `model_adapters/options/policies.py`, a twin in
`model_adapters/tiny/`, and a section in `docs/policies.md`.
"""

import model_adapters.lean_transformers  # noqa: F401 - before any module imports transformers

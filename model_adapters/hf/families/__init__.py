"""One module per model family: its tokens per frame, features and positions.

To add a model family of transformers: a module here, its line in `model_adapters/built_in.py`, its
options and usual checkpoint in `model_adapters/options/families.py`, a twin in
`model_adapters/tiny/`.
"""

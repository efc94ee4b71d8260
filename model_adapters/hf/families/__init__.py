"""One module per model family: its tokens per frame, features and positions.

To add a model family of transformers: a module here, its line with its usual checkpoint in
`model_adapters/built_in.py`, options that others do not have in
`model_adapters/options/families.py`, a twin in `model_adapters/tiny/`.
"""

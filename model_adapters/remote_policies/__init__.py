"""Policies behind servers of websockets; nothing here imports torch.

To add a protocol: a module here with its `Session`, options in
`model_adapters/options/policies.py`, and its line in `model_adapters/built_in.py`.
"""

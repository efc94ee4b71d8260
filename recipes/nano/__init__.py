"""A small Qwen2.5-VL of nine million weights, trained from scratch on two cores.

To add or change the small model: here; its weights and card are in `infthor_eval/models/`.
"""

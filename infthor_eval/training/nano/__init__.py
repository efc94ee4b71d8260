"""A small Qwen2.5-VL of two million weights, trained from scratch in minutes.

To add or change the small model: here; its weights and card are in `infthor_eval/models/`.
"""

"""A small Qwen2.5-VL of two million weights, trained from scratch in minutes."""

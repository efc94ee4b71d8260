"""A small model that has learned something: a Qwen2.5-VL of two million weights, trained from nothing in minutes."""

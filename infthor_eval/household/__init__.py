"""What is to be done in a home: tasks, what they need of objects, plans for them, and their words."""

__all__: list[str] = []

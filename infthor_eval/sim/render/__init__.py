"""Pictures of the world: primitives, a ray caster with a z-buffer, shading, and the shapes of object types."""

__all__: list[str] = []

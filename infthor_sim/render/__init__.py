"""The renderer: primitives, a ray caster with a depth buffer, shading, shapes of object types."""

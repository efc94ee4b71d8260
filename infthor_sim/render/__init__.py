"""The renderer: primitives, a ray caster with a depth buffer, shading, and the shapes of object
types."""

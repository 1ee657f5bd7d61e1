"""A camera in a world: light, exposure, motion blur, noise, and what covers the lens."""

"""A robot in a world: commands, contact, slip, and what its own sensors say of it."""

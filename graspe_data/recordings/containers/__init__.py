"""Files to raw messages: one storage a container format, whole or damaged."""

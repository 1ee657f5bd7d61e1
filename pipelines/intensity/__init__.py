"""The intensity maps of a recording, made and drawn."""

"""Kinds of things that stand in a world: their settings, footprints and surfaces."""

"""Worlds and sensors that write recordings."""

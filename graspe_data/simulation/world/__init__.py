"""Worlds: what stands where, what it is made of, and how it stops a robot."""

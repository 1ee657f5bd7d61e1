"""Closed-loop trials: a planner drives through the simulated field, and what comes of it."""

"""The stages: each a function from files to files, keyed by its inputs, parameters and version."""

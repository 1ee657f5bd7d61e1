"""The stages from recordings to datasets, and the command line."""

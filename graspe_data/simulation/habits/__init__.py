"""Drives as the drivers of real robots write them: the same truth under other habits."""

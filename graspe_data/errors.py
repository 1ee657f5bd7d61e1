"""One error class a layer; every text says what, where, found and expected, and what to do next."""


class GraspeError(Exception):
    """A fault that a user can cause and mend. The command line prints its text alone."""


class FileError(GraspeError):
    """A file that cannot be written."""


class ManifestError(GraspeError):
    """A manifest that cannot be read or does not validate."""


class GeometryError(GraspeError):
    """Frames that do not connect, or numbers that describe no rotation."""


class RecordingError(GraspeError):
    """A recording that cannot be opened, read, decoded or synchronised."""


class ObservationError(GraspeError):
    """Sensor data from which no observation can be computed."""


class ShardError(GraspeError):
    """A dataset or a shard that is missing, damaged or not what its manifest says."""


class StageError(GraspeError):
    """A stage of the pipeline that cannot do its work."""


class ZooError(GraspeError):
    """A model, recipe, checkpoint or evaluation that does not fit what it is used with."""


class PlannerError(GraspeError):
    """A bundle that cannot be used, or a planner that is set up wrongly."""

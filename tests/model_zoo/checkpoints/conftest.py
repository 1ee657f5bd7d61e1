from tests.model_zoo.checkpoints.tiny_fixtures import tiny_in_registry, write_tiny

__all__ = ["tiny_in_registry", "write_tiny"]

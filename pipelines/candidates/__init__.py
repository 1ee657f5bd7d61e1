"""A bundle asked about a row of a dataset, and its answers as a picture."""

from pipelines.candidates.candidates_picture import write_candidates_picture
from pipelines.candidates.scored_scene import ScoredScene, columns_of, most_telling, score_row

__all__ = ["ScoredScene", "columns_of", "most_telling", "score_row", "write_candidates_picture"]

"""The report of a dataset, and the picture of a row."""

from pipelines.report.page import write_report
from pipelines.report.row_at import find_row
from pipelines.report.row_picture import write_row_picture

__all__ = ["find_row", "write_report", "write_row_picture"]

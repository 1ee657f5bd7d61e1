"""What ``dataset.json`` tells of its recordings' agreements and disagreements."""

from __future__ import annotations

from collections.abc import Iterator

from graspe_data.shards.dataset_manifest import RecordingEntry


def findings_of(entry: RecordingEntry) -> Iterator[tuple[str, str]]:
    """Course and text of each finding of a recording; none of a dataset that has none."""
    findings = entry.details.get("findings")
    for finding in findings if isinstance(findings, list) else []:
        if isinstance(finding, dict):
            yield str(finding.get("course", "")), str(finding.get("text", ""))

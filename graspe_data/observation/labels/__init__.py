"""Labels: failures that rules propose and people decide, and the success vector of every row."""

from graspe_data.observation.labels.anchor_state import (
    AnchorState,
    anchor_states,
    failing_by_events,
    failing_by_labels,
    steps_to_failure,
)
from graspe_data.observation.labels.annotations import (
    annotation_path,
    draft_annotation,
    read_annotation,
    redraft_annotation,
    write_annotation,
)
from graspe_data.observation.labels.events import Event, EventKind
from graspe_data.observation.labels.motion_series import (
    CommandSeries,
    InertialSeries,
    MotionSeries,
    OdometrySeries,
)
from graspe_data.observation.labels.proposals import Proposals, ProposalSettings, propose
from graspe_data.observation.labels.review import Decided, Unreviewed, decide
from graspe_data.observation.labels.trajectory_labels import (
    LabelSettings,
    LabelSource,
    RowLabels,
    label_rows,
)
from graspe_data.observation.labels.verdicts import Annotation, Interval

__all__ = [
    "AnchorState",
    "Annotation",
    "CommandSeries",
    "Decided",
    "Event",
    "EventKind",
    "InertialSeries",
    "Interval",
    "LabelSettings",
    "LabelSource",
    "MotionSeries",
    "OdometrySeries",
    "ProposalSettings",
    "Proposals",
    "RowLabels",
    "Unreviewed",
    "anchor_states",
    "annotation_path",
    "decide",
    "draft_annotation",
    "failing_by_events",
    "failing_by_labels",
    "label_rows",
    "propose",
    "read_annotation",
    "redraft_annotation",
    "steps_to_failure",
    "write_annotation",
]

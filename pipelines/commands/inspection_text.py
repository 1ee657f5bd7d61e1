"""An inspection as a compact block of text, readable at 80 columns and more."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Final

from rich.console import Console
from rich.text import Text

from graspe_data.inspection.inspection import Inspection, TopicReport
from graspe_data.inspection.pairing import TOLERANCE_S, Pairing
from graspe_data.inspection.topic_content import (
    CalibrationContent,
    CloudContent,
    Content,
    FramesContent,
    MotionContent,
    PictureContent,
    ScanContent,
)
from graspe_data.inspection.topic_statistics import Skew, TopicStatistics
from graspe_data.inspection.verdict import Verdict
from graspe_data.recordings import Damage

_LATEST_DATE_NS: Final = 4_102_444_800 * 1_000_000_000
_MILLISECONDS_BELOW_S: Final = 0.5
_EDGES_SHOWN: Final = 6
_HANGING: Final = 2
_NARROWEST: Final = 20
_STYLES: Final = {"agrees": "green", "mended": "magenta", "noted": "yellow", "refused": "red"}


def print_inspection(console: Console, inspection: Inspection) -> None:
    """Print one recording: a head line, its topics, losses, pairs and the verdict."""
    _line(console, 0, (str(inspection.path), "bold"))
    _line(console, 2, (_head(inspection), ""))
    for topic in inspection.topics:
        if topic.serves:
            _print_topic(console, topic)
    others = [f"{t.name} ({t.count})" for t in inspection.topics if not t.serves]
    if others:
        _line(console, 2, ("serve nothing here: ", "dim"), (", ".join(others), "dim"))
    for loss in inspection.losses:
        _line(console, 2, ("lost: ", "yellow"), (_loss(loss), ""))
    for note in inspection.notes:
        _line(console, 2, ("note: ", "yellow"), (note, ""))
    for pairing in inspection.pairings:
        _line(console, 2, ("pairs: ", "cyan"), (_pairing(pairing), ""))
    _print_verdict(console, inspection.verdict)
    for name, share in inspection.suggested:
        text = f"{100 * share:.0f} % of the topics of {name}, which ships: --robot {name}"
        _line(console, 2, ("looks like: ", "cyan"), (text, ""))


def _head(inspection: Inspection) -> str:
    files = len(inspection.files)
    form = inspection.format + (f", {files} files" if files != 1 else "")
    if inspection.start_ns is None:
        return f"{form}, no messages"
    start = f"{inspection.start_ns / 1e9:.3f} s"
    if 0 <= inspection.start_ns < _LATEST_DATE_NS:
        date = datetime.fromtimestamp(inspection.start_ns // 1_000_000_000, UTC)
        start = f"{date:%Y-%m-%d %H:%M:%S} UTC"
    return f"{form}, {inspection.messages} messages, {inspection.duration_s:.1f} s from {start}"


def _print_topic(console: Console, topic: TopicReport) -> None:
    rate = topic.time.rate_hz if topic.time and "tf" not in topic.serves else None
    count = f"{topic.count} message{'s' if topic.count != 1 else ''}" + (
        f", {rate:.1f} Hz" if rate else ""
    )
    roles = " or ".join(topic.serves)
    _line(console, 2, (topic.name, "bold"), ("  ", ""), (roles, "green"), (f"  {count}", ""))
    frame = f"frame {topic.frame}" if topic.frame else ""
    what = [topic.message_type, frame, _content(topic.content)]
    _line(console, 6, (", ".join(part for part in what if part), "dim"))
    if topic.time is not None and (facts := _time(topic.time)):
        _line(console, 6, (facts, ""))
    if topic.undecodable:
        faults = f"{topic.undecodable} do not decode; the first: {topic.fault}"
        _line(console, 6, (faults, "yellow"))


def _content(content: Content | None) -> str:
    text = ""
    match content:
        case PictureContent():
            text = f"{content.width}x{content.height} {content.encoding}"
        case CloudContent(points=(low, high)):
            rings = f"{content.rings} rings" if content.rings else "no ring field"
            fields = f"; fields {' '.join(content.fields)}" if content.fields else ""
            text = f"{low} to {high} points, {rings}{fields}"
        case MotionContent():
            text = _motion(content)
        case ScanContent():
            text = f"{content.rays} rays, {content.not_a_number} of them NaN"
        case CalibrationContent(camera):
            size = f"{camera.width}x{camera.height}"
            text = f"{size}, fx {camera.fx:.1f}, distortion {camera.distortion_model}"
        case FramesContent(edges):
            shown = [f"{edge.parent} -> {edge.child}" for edge in edges[:_EDGES_SHOWN]]
            more = f" and {len(edges) - len(shown)} more" if len(edges) > len(shown) else ""
            text = ", ".join(shown) + more
    return text


def _motion(content: MotionContent) -> str:
    parts = [f"of {content.child_frame}"] if content.child_frame else []
    if content.linear_velocity is not None:
        low, high = content.linear_velocity
        parts.append(f"{low:.2f} to {high:.2f} m/s")
    if content.yaw_rate is not None:
        low, high = content.yaw_rate
        parts.append(f"{low:.2f} to {high:.2f} rad/s")
    if content.distance_m is not None:
        parts.append(f"{content.distance_m:.1f} m driven")
    return ", ".join(parts)


def _time(time: TopicStatistics) -> str:
    facts = [] if time.skew is None else [_skew(time.skew)]
    if time.gaps is not None:
        number = f"{time.gaps.number} gaps, the longest" if time.gaps.number > 1 else "1 gap,"
        facts.append(f"{number} {time.gaps.longest_s:.1f} s at {time.gaps.at_s:.1f} s")
    if time.out_of_order:
        facts.append(f"stamps out of order: {time.out_of_order}")
    if time.repeated and time.clock == "header":
        facts.append(f"repeated stamps: {time.repeated}")
    if time.zero_stamps:
        facts.append(f"zero stamps: {time.zero_stamps}")
    return "; ".join(facts)


def _skew(skew: Skew) -> str:
    """In milliseconds where all of it is small, else in seconds."""
    largest = max(abs(skew.minimum_s), abs(skew.maximum_s))
    scale, unit, digits = (1e3, "ms", 0) if largest < _MILLISECONDS_BELOW_S else (1.0, "s", 3)

    def say(value: float) -> str:
        return f"{value * scale:z.{digits}f}"

    median, low, high = say(skew.median_s), say(skew.low_s), say(skew.high_s)
    smallest, largest_seen = say(skew.minimum_s), say(skew.maximum_s)
    if smallest == largest_seen:
        return f"bag time - stamp: {median} {unit}"
    within = f"5-95 % {low} to {high}, all {smallest} to {largest_seen}"
    drift = f"drift {skew.drift_s * scale:+z.{digits}f} {unit}"
    return f"bag time - stamp in {unit}: median {median}, {within}, {drift}"


def _loss(loss: Damage) -> str:
    known = [loss.topic or ""]
    known.append("" if loss.messages is None else f"{loss.messages} messages")
    known.append("" if loss.seconds is None else f"{loss.seconds:.1f} s")
    amount = ", ".join(part for part in known if part)
    return f"{amount}: {loss.reason}" if amount else loss.reason


def _pairing(pairing: Pairing) -> str:
    header = "no header stamps" if pairing.by_header is None else f"{pairing.by_header} by header"
    counts = f"{header}, {pairing.by_bag} by bag time, of {pairing.messages}"
    within = f"within {TOLERANCE_S * 1e3:.0f} ms"
    reason = "" if pairing.reason is None else f". {pairing.reason}"
    return f"{pairing.sensor} with {pairing.odometry} {within}: {counts}{reason}"


def _print_verdict(console: Console, verdict: Verdict) -> None:
    for finding in verdict.findings:
        _line(console, 2, (f"{finding.course}: ", _STYLES[finding.course]), (finding.text, ""))
    if verdict.possible:
        rows = f", {verdict.rows} with the usual windows" if verdict.rows else ""
        _line(console, 2, ("can make rows: yes", "bold green"), (rows + _choice(verdict), ""))
    else:
        reasons = "; ".join(verdict.reasons)
        _line(console, 2, ("can make rows: no", "bold red"), (f": {reasons}", ""))
    for note in verdict.notes:
        _line(console, 2, ("note: ", "yellow"), (note, ""))


def _choice(verdict: Verdict) -> str:
    return ": " + ", ".join(f"{role} {topic}" for role, topic in verdict.topics.items())


def _line(console: Console, indent: int, *parts: tuple[str, str]) -> None:
    """Print one line, wrapped under its indent; what a terminal would obey is replaced."""
    text = Text()
    for part, style in parts:
        text.append("".join(c if c.isprintable() else "?" for c in part), style)
    inner = max(console.width - indent - _HANGING, _NARROWEST)
    for number, line in enumerate(text.wrap(console, inner)):
        line.rstrip()
        margin = " " * (indent + (_HANGING if number else 0))
        console.print(Text(margin).append_text(line), highlight=False, soft_wrap=True)

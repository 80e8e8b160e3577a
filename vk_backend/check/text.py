"""The check of a device as text, to be pasted into a report: no paths or names of the machine."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

Report = dict[str, Any]
LABEL_WIDTH, WAY_WIDTH = 12, 28


def device_text(report: Report, model: Report) -> str:
    """report: of Checker.device_report; model: of Checker.model_report."""
    rows = [
        ("device", f"{report['device']}: {report['name']}, {report['type']}, {_ids(report)}"),
        ("driver", _driver(report)),
        ("memory", _heaps(report["heaps"])),
        ("extensions", _present(report["extensions"])),
        ("features", _present(report["features"])),
        *(("limits", _limit(limit, report["paths"])) for limit in report["limits"]),
        ("model", _model(model, report)),
    ]
    lines = [
        f"{label if label != before else '':{LABEL_WIDTH}}{value}"
        for (label, value), before in zip(rows, ["", *(label for label, _ in rows)])
    ]
    ways = [_way(way) for way in report["ways"]]
    head = f"{'':{WAY_WIDTH}}{'ms a frame':>11}{'of vertex':>11}{'first, s':>10}"
    return "\n".join([*lines, head, *ways])


def wrong_ways(report: Report) -> list[str]:
    """The ways of a device that do not draw, or not rightly."""
    return [way["way"] for way in report["ways"] if way["result"] in ("wrong", "failed")]


def _ids(report: Report) -> str:
    return f"{report['vendor_id']:04x}:{report['device_id']:04x}"


def _driver(report: Report) -> str:
    driver = report["driver"]
    names = (driver.get("name"), driver.get("info"), driver["version"])
    parts = dict.fromkeys(part for part in names if part)
    return f"{' '.join(parts)}, Vulkan {report['api_version']}"


def _heaps(heaps: Iterable[Report]) -> str:
    return ", ".join(
        f"{heap['bytes'] / 1e9:.1f} GB{' on the device' if heap['device_local'] else ''}"
        for heap in heaps
    )


def _present(found: dict[str, bool]) -> str:
    missing = [name for name, there in found.items() if not there]
    return f"without {', '.join(missing)}" if missing else f"all {len(found)} that are used"


def _limit(limit: Report, paths: int) -> str:
    """paths: the number of those that the device offers."""
    whose = "every path" if len(limit["paths"]) == paths else ", ".join(limit["paths"])
    return f"{limit['most']:,} {limit['of']} ({whose})"


def _model(model: Report, report: Report) -> str:
    checked, timed = (
        "{} x {} pixels".format(*size) for size in (model["checked_pixels"], report["timed_pixels"])
    )
    return (
        f"{model['triangles']:,} triangles in {model['meshlets']:,} meshlets of "
        f"{model['instances']} instances; compared at {checked}, timed at {timed}"
    )


def _way(way: Report) -> str:
    if "milliseconds" not in way:
        return f"{way['way']:{WAY_WIDTH}}{way['result']}: {way['why']}"
    share = way["of_uncompressed"]
    times = (
        f"{way['milliseconds']:11.2f}{'-' if share is None else f'{share:.2f}':>11}"
        f"{way['first_seconds']:10.1f}"
    )
    why = f": {way['why']}" if "why" in way else ""
    return f"{way['way']:{WAY_WIDTH}}{times}  {way['result']}{why}"

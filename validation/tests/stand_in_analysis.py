"""Stands in for measurement, comparison and report where a test is about the order of jobs and about what is missing.

Copied as `sitecustomize.py` to a folder on PYTHONPATH it gives every Python process these functions instead of the real ones.
"""

import json
import sys
import types


def measure(folder, wanted):
    from dembark.validation.judge.result import QuantityRecord, Result

    replicas = sorted(folder.glob("replica-*/run.json"))
    if (folder / "unmeasurable").exists():
        raise ValueError("cannot be measured")
    first = json.loads(replicas[0].read_text())
    quantity = QuantityRecord("replicas", len(replicas), "fail" if first["variant"] == "wet" else "pass", interval=(0.5, 1.5),
                              reference=1.0, deviation=0.0, tolerance=0.1, control="friction off")
    parameters = first["parameters"] | {"replicas": wanted}
    return Result(*(first[key] for key in ("case", "variant", "engine")), (quantity,), first["profile"], parameters=parameters)


def picture(folder):
    return None


def study(planned, folders):
    from dembark.validation.judge.result import Result, read

    points = [read(folder / "metrics.json") for folder in folders]
    numbers = [point.parameters[planned.along] for point in points]
    return Result(points[0].case, planned.folder_name, points[0].engine, (), parameters={"numbers": numbers})


def compare(folder):
    from dembark.validation.judge.result import Comparison

    return Comparison(folder.parent.name, folder.name, tuple(sorted(path.parent.name for path in folder.glob("*/metrics.json"))), ())


def build(folder):
    found = sorted(str(path.relative_to(folder)) for path in folder.glob("*/*/*/metrics.json"))
    (folder / "report.html").write_text("\n".join(found))
    (folder / "report.pdf").write_text("pdf")


def write(folder, found=None, inputs_hash=""):
    (folder / "verification.json").write_text(json.dumps({"items": [], "inputs_hash": inputs_hash}))


STAND_INS = [("verification", write), ("metrics", measure), ("metrics", picture), ("metrics", study), ("judge.comparison", compare),
             ("report", build), ("campaigns.report.build", build)]
if __name__ == "sitecustomize":
    for name, function in STAND_INS:
        module = sys.modules.setdefault(f"dembark.validation.{name}", types.ModuleType(f"dembark.validation.{name}"))
        setattr(module, function.__name__, function)

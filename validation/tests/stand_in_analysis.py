"""Stands in for measurement, comparison and report where a test is about the order of jobs and about what is missing.

Copied as `sitecustomize.py` to a folder on PYTHONPATH it gives every Python process these functions instead of the real ones.
"""

import json
import sys
import types


def measure(folder):
    replicas = sorted(folder.glob("replica-*/run.json"))
    if (folder / "unmeasurable").exists():
        raise ValueError("cannot be measured")
    first = json.loads(replicas[0].read_text())
    quantity = {"name": "replicas", "value": len(replicas), "unit": "1", "interval": [0.5, 1.5], "reference": 1.0, "deviation": 0.0,
                "tolerance": 0.1, "verdict": "fail" if first["variant"] == "wet" else "pass"}
    return {**{key: first[key] for key in ("case", "variant", "engine", "profile", "parameters")}, "quantities": [quantity]}


def study(planned, folders):
    points = [json.loads((folder / "metrics.json").read_text()) for folder in folders]
    numbers = [point["parameters"][planned.along] for point in points]
    return {"case": points[0]["case"], "variant": planned.folder_name, "engine": points[0]["engine"], "quantities": [], "numbers": numbers}


def compare(folder):
    return {"case": folder.parent.name, "variant": folder.name,
            "engines": sorted(path.parent.name for path in folder.glob("*/metrics.json")), "quantities": []}


def build(folder):
    found = sorted(str(path.relative_to(folder)) for path in folder.glob("*/*/*/metrics.json"))
    (folder / "report.html").write_text("\n".join(found))
    (folder / "report.pdf").write_text("pdf")


def write(folder):
    pass


for name, function in (("verification", write), ("metrics", measure), ("metrics", study), ("compare", compare), ("report", build),
                       ("campaigns.report", build)):
    module = sys.modules.setdefault(f"dembark.validation.{name}", types.ModuleType(f"dembark.validation.{name}"))
    setattr(module, function.__name__, function)

"""The compiled combinations of contact models: (normal, tangential, cohesion, rolling, surface), in the words of a script."""

import itertools
import re
from pathlib import Path

KINDS = ("NORMAL", "TANGENTIAL", "COHESION", "ROLLING", "SURFACE")
_TEXT = (Path(__file__).resolve().parents[3] / "plugins/liggghts/granular_combinations_list.h").read_text(encoding="utf-8")
LIST = [tuple(model.removeprefix(f"{kind}_").lower() for kind, model in zip(KINDS, each, strict=True))
        for line in re.findall(r"^GRAN_MODELS\((.*)\)$", _TEXT, re.MULTILINE)
        for each in itertools.product(*(re.findall(r"\w+", part) for part in re.findall(r"\([^)]*\)|\w+", line)))]

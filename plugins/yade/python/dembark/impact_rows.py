"""What a script may write for LcpImpact, as rows of numbers, which are saved with the scene: ids of materials (-1: all), then values."""

import math
from numbers import Real

from yade import Omega
from yade.dembark.report import fail

O = Omega()

KEYS = {"stiffness": 1, "damping": 1, "friction": 2}  # materials of a row
# Words of a friction law, and what they are where they are not given; kinetic: as static.
FRICTION = {"static": None, "kinetic": None, "slip": 0.0, "strength": 1e30, "healing": 0.0, "area": 0.0}


def read(kind, value, name):
    """Rows of an attribute of `kind`: of one value for all, or of a dict by materials or, of friction, by pairs of them.

    `name`: the attribute, for messages. RuntimeError with one line where something is wrong.
    """
    keys = KEYS[kind]
    if not isinstance(value, dict) or not value or (keys == 2 and isinstance(next(iter(value)), str)):
        return [*[-1.0] * keys, *_values(kind, value, name)]
    rows, known = [], set()
    for key, each in value.items():
        if keys == 2 and not (isinstance(key, tuple) and len(key) == 2):
            fail(f"{name}: the key {key} is no pair; write {{(material, material): friction, ...}}")
        materials = [_material(one, name) for one in (key if keys == 2 else (key,))]
        if frozenset(materials) in known:
            fail(f"{name}: the key {key} is given twice")
        known.add(frozenset(materials))
        rows += [*materials, *_values(kind, each, f"{name}[{key}]")]
    return rows


def show(kind, rows):
    """The value that rows are of, None where there are none."""
    keys, width = KEYS[kind], len(FRICTION) if kind == "friction" else 1
    shown = {}
    for at in range(0, len(rows), keys + width):
        ids, numbers = tuple(map(int, rows[at:at + keys])), rows[at + keys:at + keys + width]
        shown[ids if keys == 2 else ids[0]] = friction_words(numbers) if kind == "friction" else numbers[0]
    return next(iter(shown.values()), None) if not rows or rows[0] < 0 else shown


def friction_words(numbers):
    """The words of one friction law."""
    return dict(zip(FRICTION, numbers, strict=True))


def _number(value, what):
    if not isinstance(value, Real) or isinstance(value, bool) or not math.isfinite(value):
        fail(f"{what} is {value}; it must be a finite number")
    return float(value)


def _material(key, what):
    """Id of a shared material, from its id or its label."""
    for k, each in enumerate(O.materials):
        if (each.label == key) if isinstance(key, str) else (k == key and not isinstance(key, bool)):
            return k
    return fail(f"{what}: no material {key}; give the id or the label of one in O.materials (there are {len(O.materials)})")


def _values(kind, value, what):
    if kind == "friction":
        return friction_numbers(value, what)
    number = _number(value, what)
    if kind == "stiffness" and not number > 0.0:
        fail(f"{what} is {number:g}; it must be > 0 N/m")
    if kind == "damping" and not number >= 0.0:
        fail(f"{what} is {number:g}; it must be >= 0 N s/m")
    return [number]


def friction_numbers(value, what):
    """Numbers of one friction law, in the order of FRICTION: of a coefficient, or of a dict of words."""
    given = value if isinstance(value, dict) else {"static": _number(value, what)}
    for word in given:
        if word not in FRICTION:
            fail(f"{what}: '{word}' is unknown; the words are {', '.join(FRICTION)}")
    if "static" not in given:
        fail(f"{what} has no 'static'; give at least the static friction coefficient")
    law = FRICTION | {word: _number(number, f"{what}['{word}']") for word, number in given.items()}
    if law["kinetic"] is None:
        law["kinetic"] = law["static"]
    if not law["area"] >= 0.0:
        fail(f"{what}: area is {law['area']:g}; it must be > 0 m^2, or 0 = that of the contact of two circles")
    return list(law.values())

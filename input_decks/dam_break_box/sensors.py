"""Where pressures and levels are measured."""

# m: heights of the sensors on the face of the box, distances from that face of those on its top, and y of both from the box's middle.
FACE, TOP, ACROSS = (0.021, 0.061, 0.101, 0.141), (0.021, 0.061, 0.101, 0.141), -0.026
# m: heights of the sensors on the far wall.
WALL = (0.003, 0.015, 0.030, 0.080)
# m: places of the gauges of the level along the tank, from the column's front.
GAUGES = {"H1": 1.496, "H2": 1.000, "H3": 0.504, "H4": -0.646}


def sensors(scene: str, face: float, top: float, length: float) -> dict[str, tuple[float, float, float]]:
    """Places (m) of the sensors of the `scene` by name, with the face of box or wall at x = `face` (m) and the box `top` (m) high and
    `length` (m) long; those that such a box would not carry are left out."""
    if scene == "wall":
        return {f"at_{1e3 * z:g}_mm": (face, 0.0, z) for z in WALL}
    return {**{f"P{k + 1}": (face, ACROSS, z) for k, z in enumerate(FACE) if z <= top},
            **{f"P{k + 5}": (face + x, ACROSS, top) for k, x in enumerate(TOP) if x <= length}}

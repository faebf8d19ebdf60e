"""One floor z = 0, |x|, |y| <= 20 mm, as STL files of CAD programs have it; files that are none. Plain Python, for YADE too."""

import math
import struct

HALF = 0.02
RADIUS = 0.0025
HEIGHT = 0.00249
STEP, STEPS = 1e-4, 400
# Grains that are dragged at one height: across the seam x = 0, along it on either side, and over a diagonal. Start (m) and velocity (m/s).
PATHS = [((-0.004, 0.008), (0.2, 0.0)), ((5e-5, -0.004), (0.0, 0.15)), ((-5e-5, -0.016), (0.0, 0.15)), ((-0.014, -0.003), (0.1, 0.08))]


def quad(x0, x1, y0, y1, z=0.0):
    return [((x0, y0, z), (x1, y0, z), (x1, y1, z)), ((x0, y0, z), (x1, y1, z), (x0, y1, z))]


def text(triangles, normal="0 0 1", form="%.9g"):
    lines = ["solid floor"]
    for triangle in triangles:
        corners = ["vertex " + " ".join(form % c for c in p) for p in triangle]
        lines += [f"facet normal {normal}", "outer loop", *corners, "endloop", "endfacet"]
    return ("\n".join([*lines, "endsolid floor"]) + "\n").encode()


def binary(triangles, head=b"", normal=(0.0, 0.0, 1.0), attribute=0):
    rows = [struct.pack("<12fH", *normal, *(c for p in triangle for c in p), attribute) for triangle in triangles]
    return head.ljust(80)[:80] + struct.pack("<I", len(rows)) + b"".join(rows)


def files():
    """Contents by name; `plain` is the first."""
    h, plain = HALF, quad(-HALF, 0, -HALF, HALF) + quad(0, HALF, -HALF, HALF)
    turned = [(b, c, a) for a, b, c in plain] + [(c, b, a) for a, b, c in plain]
    fan = [tuple((h * r * math.cos(a), h * r * math.sin(a), 0.0) for r, a in ((0, 0), (1, k * math.pi / 30), (1, (k + 1) * math.pi / 30)))
           for k in range(60)]
    shapes = {
        "plain": plain,
        "hanging nodes": quad(-h, 0, -h, h) + [t for k in range(7) for t in quad(0, h, -h + k * h / 3.5, -h + (k + 1) * h / 3.5)],
        "upside down": [plain[0], plain[1][::-1], plain[2][::-1], plain[3]],
        "given twice": plain + plain[:2],
        "given again in other orders": plain + turned,
        "given again, 5 nm off": [*plain, *(tuple((x + 5e-9, y, z - 5e-9) for x, y, z in t) for t in plain)],
        "a sheet 0.3 um below": plain + quad(-h, h, -h, h, -3e-7),
        "overlap": quad(-h, 1e-3, -h, h) + quad(-1e-3, h, -h, h),
        "crossing bars": [*plain, *quad(-h, h, -1e-3, 2e-3), *quad(-1e-3, 1e-3, -h, h)],
        "cut another way": [*plain, ((-h, -h, 0), (h, -h, 0), (-h, h, 0)), ((h, h, 0), (-h, h, 0), (h, -h, 0))],
        "without area": [*plain, ((0, -h, 0), (0, 0, 0), (0, h, 0)), ((0, 0, 0), (0, 0, 0), (h, h, 0))],
        "open by 20 nm": quad(-h, -1e-8, -h, h) + quad(1e-8, h, -h, h),
        "open by 2 um": quad(-h, -1e-6, -h, h) + quad(1e-6, h, -h, h),
        "fan": fan,
        "a rib 0.2 um below": [*plain, ((1e-4, -h, -2e-7), (1e-4, h, -2e-7), (1e-4, 0, -h))],
    }
    found = {name: text(triangles) for name, triangles in shapes.items()}
    ascii_ = found["plain"]
    return found | {
        "binary": binary(plain), "binary, headed solid": binary(plain, b"solid of a CAD program", (math.nan,) * 3, 0xFFFF),
        "upper case": ascii_.upper(), "mixed case": ascii_.replace(b"facet", b"Facet").replace(b"vertex", b"VERTEX"),
        "CR LF": ascii_.replace(b"\n", b"\r\n"), "CR": ascii_.replace(b"\n", b"\r"), "tabs": ascii_.replace(b" ", b"\t"),
        "end loop": ascii_.replace(b"endloop", b"end loop"), "normals of zero": text(plain, "0 0 0"),
        "normals nan": text(plain, "nan nan nan"),
        "odd name": ascii_.replace(b"solid floor", "solid K\u00f6rper (mm), facet normal".encode()),
        "no name": ascii_.replace(b" floor", b""), "digits": text(plain, form="%.9E"),
        "two solids": text(plain[:2]) + text(plain[2:]).replace(b"floor", b"other")}


def refused():
    """Contents that no engine reads, by the words of the line that says so."""
    plain = quad(-HALF, 0, -HALF, HALF)
    cut = text(plain)
    return {"is empty; it must be an STL file": b"",
            "ends within a facet": cut[: cut.index(b"endfacet") - 2],
            "is cut off or no STL file: a binary one of 2 triangles has 184 bytes, this has 150": binary(plain, b"solid")[:150],
            "line 4: 'nan' is not a number": cut.replace(b"vertex -0.02", b"vertex nan", 1),
            "holds no triangle with an area": text([((0, 0, 0), (0, 0, 0), (1, 0, 0))])}

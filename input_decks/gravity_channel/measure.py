"""Gravity-driven channel: grains fall between two flat frictional walls, periodic along the flow, at a given mean solid fraction.

Velocities are shown over sqrt(g W). What falls steadily is held by the walls' friction: mean(left + right) = weight, and while the mean
velocity u still changes, weight times 1 - (du/dt) / g. The velocity at the wall is that of the layer within one diameter, the greatest
velocity the mean over the middle half; the thickness of the shear zones is the length of the exponential that fits what is missing to the
latter, in cells of one diameter. The studies ask how these grow with the width.
"""


import numpy as np

from dembark.postproc.instruments.channel import read_periodic
from dembark.postproc.instruments.channel_gravity import common_exponential, estimates, profiles, scaled_curves
from dembark.postproc.instruments.growth import Growth, ordered
from dembark.postproc.measurement import Estimate, Measurement, Points, Replicas, Value, exact, pooled

# Quantities without a verdict where no steady flow was found.
FLOW = ("greatest_velocity", "slip_velocity", "velocity_ratio", "shear_zone_thickness", "core_flatness")
# What grows with the width: the curve's title and label, and the published power.
GROWN = {"greatest_velocity": ("Maximum velocity", "u_max (m/s)", 0.5), "slip_velocity": ("Velocity at the wall", "u_slip (m/s)", 0.5),
         "thickness": ("Thickness of the shear zones", "thickness / d", 1.0)}


def measure(replicas: Replicas) -> Measurement:
    """Values, profiles and remarks of all replicas of a series."""
    channels = [read_periodic(replica) for replica in replicas]
    found = [estimates(one) for one in channels]
    unsteady, zero = next((one.remark for one in channels if one.remark), ""), exact(0.0)
    references = {"core_flatness": zero, "force_balance_error": zero}
    details = {"wall_mobilisation": f"the wall's static friction is {replicas[0].derived['wall_static']:g}"}
    values = {name: Value(pooled(found, name), references.get(name), reason=unsteady if name in FLOW else "",
                          detail=details.get(name, "")) for name in found[0]}
    share = channels[0].steady_share
    remark = f"The steady part holds {share:.0%} of the measuring window (MSER-5 and a drift test on the kinetic energy)."
    return Measurement(values, profiles(channels), [unsteady[0].upper() + unsteady[1:] + "." if unsteady else remark])


def study(_name: str, points: Points, along: str) -> Measurement:
    """Exponents of velocities and thickness in the width, and the scaled profiles of all widths."""
    points, widths = ordered(points, along)
    given, cells = points[0]["parameters"], widths / float(points[0]["parameters"]["grain_diameter"])
    speeds = np.sqrt(widths * float(given["gravity"]))
    grown = {"greatest_velocity": Growth.of(points, "greatest_velocity", cells, speeds),
             "slip_velocity": Growth.of(points, "slip_velocity", cells, speeds),
             "thickness": Growth.of(points, "shear_zone_thickness", cells)}
    reasons = [next(one["reason"] for one in point["quantities"] if one["name"] == "greatest_velocity") for point in points]
    broken = next((f"W = {width:.0f} d: {reason}" for width, reason in zip(cells, reasons, strict=True) if reason), "")
    short = f"the abstract refers to sufficiently wide channels without a width; these are {cells[0]:.0f} to {cells[-1]:.0f} d"
    scaled = [tuple(np.array(one[part], float) for part in ("place", "value"))
              for point in points for one in point["profiles"] if one["name"] == "scaled_velocity"]
    amplitude, worst = common_exponential(scaled)
    ratio = Growth.of(points, "velocity_ratio", cells)
    spread = Estimate(float(np.abs(ratio.values / ratio.values.mean() - 1.0).max()), float((ratio.halves / ratio.values).max()),
                      "largest of the widths")
    values = {
        **{f"exponent_{name}": Value(grown[name].exponent, exact(power), reason=broken or short) for name, (*_, power) in GROWN.items()},
        "ratio_spread": Value(spread, exact(0.0), reason=broken),
        "profile_collapse": Value(
            Estimate(worst, 0.0, "largest over all positions and widths"), exact(0.0),
            reason=broken or "the abstract does not state how the profile is scaled; this scaling was chosen here after the first runs",
            detail=f"(u_max − u)/(u_max − u_slip) against {amplitude:.2f} exp(−distance/thickness) in cells of one diameter; the distance "
                   "is measured from the layer at the wall"),
    }
    curves = [grown[name].curve(name, title, "width W / d", label, power, "proportional to " + ("√W" if power == 0.5 else "W"))
              for name, (title, label, power) in GROWN.items()]
    curves += scaled_curves(scaled, cells, amplitude)
    core, wall = (Growth.of(points, name, cells).values for name in ("solid_fraction", "wall_solid_fraction"))
    loose = ", ".join(f"{one:.3f} and {other:.3f} at {width:.0f} d" for one, other, width in zip(core, wall, cells, strict=True))
    return Measurement(values, curves, [
        (f"Solid fraction of the core and within two diameters of the walls: {loose}. Velocities proportional to √W require shear zones "
         "of the same solid fraction; in a channel in which the plug leaves room for only one or two layers they become looser with the "
         "width, and the flow becomes faster.")])

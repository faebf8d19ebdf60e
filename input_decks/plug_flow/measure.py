"""Plug flow: a packing sinks between two vertical walls on a plate that moves down at the constant speed v0.

Only the steady part is used; it is detected in the wall friction (MSER-5 and a drift test).
"""


from dembark.postproc.instruments import channel, channel_fields, channel_plug
from dembark.postproc.instruments.liquid import liquid_values
from dembark.postproc.measurement import Estimate, Measurement, Replicas, Value, pooled

# A wall zone whose velocity deficit is below this cannot be told from the core's own scatter.
LEAST_DEFICIT = 0.02
# What nothing is said of when no steady part was found.
JUDGED = ("core_flatness", "flux_error", "inertial_number", "force_balance_error")
REMARKS = (
    "The published flow is driven by gravity alone; here the plate sets the speed, so the widths are shown without a verdict.",
    ("Published widths of shear zones exist for rough and smooth walls; none of these papers was available for this report, so no range is "
     "given."),
)


def measure(replicas: Replicas) -> Measurement:
    """Values, profiles, remarks and fields of all replicas of a series."""
    channels = [channel.read(replica) for replica in replicas]
    found = [channel_plug.estimates(one) for one in channels]
    over = {name: pooled(found, name) for name in found[0]}
    first, unsteady, slip = channels[0], next((one.remark for one in channels if one.remark), ""), 1.0 - over["wall_slip"].value
    faint = f"the layer at the walls lags by only {slip:.1%}: no shear zone to measure" if slip < LEAST_DEFICIT else ""
    values = {name: Value(one) for name, one in over.items()}
    values |= {name: Value(over[name], Estimate(0.0, 0.0), reason=unsteady) for name in JUDGED}
    values |= {name: Value(over[name], reason=faint, compared=not faint) for name in ("shear_zone_width", "shear_zone_width_90")}
    told = f"the wall's static friction is {replicas[0].derived['wall_static']:g}"
    values["wall_mobilisation"] = Value(over["wall_mobilisation"], detail=told)
    fields = channel_fields.measured(replicas, unsteady)
    steady = f"The steady part holds {first.steady_share:.0%} of the measuring window (MSER-5 and a drift test on the wall friction)."
    d, window = first.diameter, first.levels[-1] - first.levels[0]
    size = (f"The channel is {first.width / d:.0f} d wide and filled {first.height / d:.0f} d high; the cells, which are at rest in the "
            f"laboratory frame, cover {window / d:.0f} d of it.")
    remarks = [unsteady + "." if unsteady else steady, size, *REMARKS]
    return Measurement({**values, **liquid_values(replicas), **fields.values}, channel_plug.profiles(channels), remarks, fields.fields)

"""What decks of vibrated machines write: the columns of the energy account, and the grains that touch a part."""

import math

from yade import EnergyAccount, Omega
from yade.dembark.moving import motion_columns, motion_values
from yade.dembark.writers import DumpWriter, EnergyWriter

O = Omega()

# LIGGGHTS has no numerical damping; rolling resistance is off in these decks.
_LEFT_OUT = ("kinetic", "numerical_damping", "rolling_elastic", "rolling_viscous", "rolling_stored")


def machine_history(bodies, weight, moving):
    """EnergyWriter of time.csv: energies of the scene's EnergyAccount by the names of the LIGGGHTS decks, `weight_height`, weight times
    height of the `bodies` (ids), J, for `weight` (m/s^2) along z, and what belongs to the engines `moving` of `motion`."""
    names = EnergyAccount().keys()
    columns = {"kinetic_energy": "kinetic"} | {name: name for name in names if name not in _LEFT_OUT}

    def values():
        moment = math.fsum(O.bodies[k].state.mass * O.bodies[k].state.pos[2] for k in bodies)
        return (-weight[2] * moment, *motion_values(moving))

    return EnergyWriter("time.csv", columns, ("weight_height", *motion_columns(moving)), values)


class TouchWriter(DumpWriter):
    """Appends frames of the grains that the wall `name`, made of the bodies `ids`, pushes to touches.dump; `bounds` and `more` as for
    DumpWriter."""

    def __init__(self, name, ids, bounds, **more):
        super().__init__({name: ids}, bounds, grains="touches.dump", contacts=None, **more)

    def _chosen(self, rows):
        # The wall's force stands last.
        return "".join(row for row in rows.splitlines(keepends=True) if any(float(x) for x in row.split()[-3:]))

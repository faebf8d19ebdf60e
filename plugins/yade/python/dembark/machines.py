"""What decks of vibrated machines write: the columns of the energy account, and the grains that touch a part."""

import math

from yade import EnergyAccount, Omega
from yade.dembark.moving import motion_columns, motion_values
from yade.dembark.writers import DumpWriter, EnergyWriter
from yade.minieigenHP import Vector3

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


class PartWriter(DumpWriter):
    """Appends frames of the grains that touch a free part, the spheres `part` (ids), to touches.dump, with the part's first and last sphere
    and all that the wall `name`, made of the bodies `ids`, pushes; `bounds` and `more` as for DumpWriter."""

    def __init__(self, name, ids, part, bounds, **more):
        super().__init__({name: ids}, bounds, grains="touches.dump", contacts=None, **more)
        self._wall, self._part = frozenset(ids), tuple(part)

    def write(self):
        """Append the present state."""
        chosen = {self._part[0], self._part[-1]}
        for number in self._part:
            for touch in O.bodies[number].intrs():
                if touch.isReal:
                    other = touch.id1 + touch.id2 - number
                    chosen.add(number if other in self._wall else other)
        shot = self._snapshot.current()
        shot.types = [int(number in chosen) for number in range(len(O.bodies))]
        super().write()

    def _chosen(self, rows):
        first = O.bodies[self._part[0]]
        return rows if first.isStandalone else "".join(map(self._of_clump(O.bodies[first.clumpId].state), rows.splitlines()))

    def _of_clump(self, clump):
        """Function of a row: the row, with the velocity at the time of the position if it is that of a member of the clump; the snapshot
        moves a member on by the force on it alone."""
        force, torque = Vector3.Zero, Vector3.Zero
        for number in self._part:
            force += O.forces.f(number)
            torque += O.forces.t(number) + (O.bodies[number].state.pos - clump.pos).cross(O.forces.f(number))
        velocity = clump.vel + 0.5 * O.dt * (force / clump.mass + Vector3(*self._snapshot.gravity))
        spin = Vector3(0, clump.angVel[1] + 0.5 * O.dt * torque[1] / clump.inertia[1], 0)

        def row(text):
            words = text.split()
            number = int(words[0]) - 1
            if number >= self._part[0]:
                own = velocity + spin.cross(O.bodies[number].state.pos - clump.pos)
                words[8:14] = [f"{x:.9g}" for x in (own[0], 0, own[2], *spin)]
            return " ".join(words) + "\n"
        return row


class TouchWriter(DumpWriter):
    """Appends frames of the grains that the wall `name`, made of the bodies `ids`, pushes to touches.dump; `bounds` and `more` as for
    DumpWriter."""

    def __init__(self, name, ids, bounds, **more):
        super().__init__({name: ids}, bounds, grains="touches.dump", contacts=None, **more)

    def _chosen(self, rows):
        # The wall's force stands last.
        return "".join(row for row in rows.splitlines(keepends=True) if any(float(x) for x in row.split()[-3:]))

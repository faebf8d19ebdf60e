"""Two plates of glued grains with a layer of grains between them: the lower one rests, the upper one is rigid and carries a load."""

from types import SimpleNamespace

from yade import DembarkSnapshot, Omega
from yade.dembark.frames import StepMeans
from yade.dembark.scene import Recorder, box
from yade.dembark.states import table
from yade.dembark.writers import DumpWriter

O = Omega()


class LoadedPlates:
    """The plates of a deck with the numbers `p`, as the part plates.in of the other engines has them.

    The glued grains `ids`, first those of the lower plate, were added as held. The upper plate keeps its velocity `p.shear_speed` along x
    and is free along z. `load(factor)`, once in every step, pushes it down with the part `p.grain_load` of the load times `factor` for each
    of its grains: YADE forgets a permanent force when it loads a scene, as it does after each saved state. `record()`, once in every step,
    writes what is due: the rows of time.csv are means over their steps.
    """

    def __init__(self, p, ids):
        self._p, half = p, len(ids) // 2
        self._count = half
        self._plate = O.bodies.clump(ids[half:])
        O.bodies[self._plate].state.blockedDOFs = "xyXYZ"
        O.bodies[self._plate].state.vel = (p.shear_speed, 0, 0)
        kinds, sides = [-1] * len(O.bodies), [-1] * len(O.bodies)
        for number, k in enumerate(ids):
            kinds[k], sides[k] = 2, number // half
        self._snapshot = DembarkSnapshot(types=kinds, columns=sides, wallCount=2)
        self._table = table("time.csv", "step,time,kinetic_energy,lower_fx,lower_fz,upper_fx,upper_fz")
        self._means, self._row = StepMeans(p.every), []
        self.save, self.restore = self._means.save, self._means.load
        self._recorder = Recorder(p, {}, history=SimpleNamespace(write=self._write), report=p.stride)
        self._recorder.dump = DumpWriter({}, box(), "pp pp ff", gravity=(0, 0, 0), types=dict.fromkeys(ids, 2))

    def load(self, factor):
        """Push the plate down in this step."""
        O.forces.setPermF(self._plate, (0, 0, -factor * self._p.grain_load * self._count))

    def _write(self):
        self._table.write(",".join([str(O.iter), *(f"{x:.17g}" for x in (O.time, self._snapshot.kineticEnergy(), *self._row))]) + "\n")
        self._table.flush()

    def record(self):
        """Once in every step."""
        self._row = self._means.add(*(force[axis] for force in self._snapshot.wallForces() for axis in (0, 2))) or self._row
        self._recorder()

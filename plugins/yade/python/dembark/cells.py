"""A periodic cell whose sides follow given stresses."""

from types import SimpleNamespace

from yade import DembarkSnapshot, Omega, utils
from yade.dembark.frames import StepMeans
from yade.dembark.scene import Recorder
from yade.dembark.states import table
from yade.minieigenHP import Matrix3

O = Omega()


class StressedCell:
    """The cell of a deck with the numbers `p`: `confining_stress`, `gain`, `integral_time`.

    `follow(integrate)`, `strain(rates)` and `record()`, each once in every step. The rates (1/s) of `follow` are `gain` times the share of
    the confining stress that is lacking or too much, and its integral over the steps with `integrate`, divided by `integral_time`.
    YADE's PeriTriaxController would hold stresses, too, but with a law of its own: here cells move as those of LIGGGHTS and LAMMPS do.
    """

    def __init__(self, p):
        self._p, self._late = p, [0.0] * 3
        # The cell moves its bodies: they have its velocities already.
        for body in O.bodies:
            body.state.vel = (0, 0, 0)
        self._snapshot = DembarkSnapshot()
        self._table = table("time.csv", "step,time,kinetic_energy,size_x,size_y,size_z,stress_x,stress_y,stress_z")
        self._means, self._row = StepMeans(p.every), []
        self._recorder = Recorder(p, {}, boundary="pp pp pp", gravity=(0, 0, 0), history=SimpleNamespace(write=self._write),
                                  report=p.stride)

    def _stress(self):
        stress = utils.getStress()
        return [-stress[axis][axis] for axis in range(3)]

    def follow(self, integrate):
        """Rates of the three sides."""
        errors = [one / self._p.confining_stress - 1 for one in self._stress()]
        if integrate:
            self._late = [late + error * self._p.time_step / self._p.integral_time for late, error in zip(self._late, errors, strict=True)]
        return [self._p.gain * (error + late) for error, late in zip(errors, self._late, strict=True)]

    def strain(self, rates):
        """Let the sides change at these rates."""
        O.cell.velGrad = Matrix3(rates[0], 0, 0, 0, rates[1], 0, 0, 0, rates[2])

    def _write(self):
        numbers = (O.time, self._snapshot.kineticEnergy(), *O.cell.size, *self._row)
        self._table.write(",".join([str(O.iter), *(f"{x:.17g}" for x in numbers)]) + "\n")
        self._table.flush()

    def record(self):
        """Write what is due."""
        self._row = self._means.add(*self._stress()) or self._row
        self._recorder.dump.bounds = tuple((0.0, side) for side in O.cell.size)
        self._recorder()

    def save(self):
        """Keep in the scene what the next step needs."""
        self._means.save()
        O.tags["late"] = " ".join(value.hex() for value in self._late)

    def restore(self):
        """Get it back."""
        self._means.load()
        self._late = [float.fromhex(word) for word in O.tags["late"].split()]

"""Compressed chain: elastic spheres under Hooke's law between two that are held."""

from yade import dembark

p = dembark.parameters()
materials, ids = dembark.begin(p)
# Held by the integrator's mask: held spheres would be of infinite mass to Hooke's stiffness.
for k in ids[1]:
    O.bodies[k].mask = 3
for k in ids[2]:
    O.bodies[k].mask = 2
for k in ids[1]:
    # At rest at the first step: velocities are half a step behind.
    off = O.bodies[k].state.pos[0] - (p.grain_diameter - p.overlap) * k
    O.bodies[k].state.vel = Vector3(0.5 * O.dt * p.angular**2 * off, 0, 0)
writer = dembark.FrameWriter()


def record():
    """Write what is due at this step."""
    if O.iter > 0 and O.iter % p.stride == 0:
        writer.write()
    if O.iter == p.steps:
        found = watch.figures()
        with open("monitor.txt", "w", encoding="ascii") as file:
            file.write(" ".join(f"{found[name]:.17g}" for name in ("position_rms", "velocity_rms", "contact_steps")) + "\n")


law = Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz(normalLaw="hooke", characteristicVelocity=p.characteristic_velocity)
loop = dembark.contact_loop(p, materials, [])
loop.lawDispatcher.functors = [law]
O.engines = dembark.engine_loop(loop, [Bo1_Sphere_Aabb()], 0.1 * p.grain_diameter, (0, 0, 0))
# Errors in m and m/s; the measurement has them over the true ones.
watch = IntegrationMonitor(speed=1.0, length=1.0, limit=1e9, every=p.sample, reaction="report")
O.engines = [*O.engines[:-1], watch, O.engines[-1]]
O.engines[-1].mask = 1
dembark.run(p.steps, outputs=("grains.dump",))

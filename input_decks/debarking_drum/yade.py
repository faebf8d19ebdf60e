"""Debarking drum: logs of unequal diameters tumble in a turning drum, in cross-section (the plane x-z)."""

from yade import dembark

p = dembark.parameters()
O.dt = p.time_step
weight = (0, 0, -p.gravity)
dembark.logs([O.materials.append(FrictMat(label="wood"))], axis="y")
drum = O.bodies.append(dembark.drum((0, 0, 0), p.inner_radius, axis="y", omega=p.drum_speed))
O.engines = dembark.log_loop(
    LcpImpact(stiffness=p.log_stiffness, contactDamping=p.contact_damping, theta=p.theta, friction=p.friction,
              tangentialRatio=p.tangential_ratio, velocityAtStart=True, impactsFile="impacts.txt", label="hits",
              walls=[dict(bodies=[drum], stiffness=p.shell_stiffness, friction=p.shell_friction, name="shell")]),
    "record()", gravity=weight)

writer = dembark.FrameWriter(
    ["shell_fx", "shell_fy", "shell_fz", "potential_energy", "elastic_energy", "dissipated_energy", "torque", "contacts", "active", "begun",
     "impulse_sum", "pivots", "certificate", "peak_force"], gravity=weight)
means = dembark.StepMeans(p.every)


def record() -> None:
    """Average the moment and force of the shell on the logs over the steps of a row; write what is due at this step."""
    force = hits.walls[0].force
    averaged = means.add(-O.forces.t(drum)[1], -force[0], -force[2])
    if averaged:
        torque, sideways, upward = averaged
        height = p.gravity * sum(body.state.mass * body.state.pos[2] for body in O.bodies if body.id != drum)
        writer.row(sideways, 0, upward, height, hits.elasticEnergy, hits.dissipatedEnergy, torque, hits.contactCount, hits.activeCount,
                   hits.impactsBegun, hits.impulseSum, hits.pivotsTotal, hits.worstCertificate, hits.highestForce)
    if O.iter >= p.first and (O.iter - p.first) % p.stride == 0:
        writer.frame()


dembark.run(p.steps, saving=means.save, loaded=means.load)

"""Runs inside YADE: one body of spheres by its file, as rigid_bodies.py describes it."""

import json
import os
import sys

from yade import utils

sys.path.append(os.getcwd())
import one_body

with open("flight.json", encoding="utf-8") as stored:
    flight = json.load(stored)
O.materials.append(FrictMat(young=flight["young"], poisson=flight["poisson"], density=2500, frictionAngle=0.0))
number, members = one_body.add(tuple(one_body.CENTRE))
state = O.bodies[number].state
state.vel, state.angVel = flight["velocity"], flight["spin"]
# Bodies whose moments differ are moved by their angular momentum.
own = state.ori.conjugate() * state.angVel
state.angMom = state.ori * Vector3(*(state.inertia[k] * own[k] for k in range(3)))
shown = list(members)
for row in flight["grains"]:
    grain = utils.sphere(row[:3], flight["grain_radius"])
    grain.state.mass = flight["grain_mass"]
    grain.state.inertia = Vector3(1, 1, 1) * (0.4 * flight["grain_mass"] * flight["grain_radius"]**2)
    grain.state.vel = row[3:]
    shown.append(O.bodies.append(grain))
if flight["floor"]:
    O.bodies.append(utils.wall(0, 2, sense=1))
loop = SphereContactLoop if flight["own_loop"] else InteractionLoop
O.engines = [ForceResetter(), InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Wall_Aabb()], verletDist=1e-3),
             loop([Ig2_Sphere_Sphere_ScGeom(), Ig2_Wall_Sphere_ScGeom()],
                  [Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys(**flight["pair"])],
                  [Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz(**flight["law"])]),
             NewtonIntegrator(damping=0, exactAsphericalRot=True, gravity=(0, 0, -flight["gravity"]))]
O.dt = flight["time_step"]
with open("grains.dump", "w", encoding="utf-8") as out:
    for _ in range(flight["frames"]):
        O.run(flight["steps"] // flight["frames"], True)
        out.write(f"ITEM: TIMESTEP\n{O.iter}\nITEM: NUMBER OF ATOMS\n{len(shown)}\nITEM: BOX BOUNDS ff ff ff\n0 1\n0 1\n0 1\nITEM: ATOMS\n")
        states = [O.bodies[one].state for one in shown]
        out.writelines(" ".join(map(repr, (row, *one.pos, *one.vel))) + "\n" for row, one in enumerate(states, 1))
print("rig: finished", flush=True)

"""A drum of logs in YADE, timed.

    yade -n -j1 -x yade_drum.py drum=FILE.json steps=STEPS

The file has the words of `dembark.log`, and of the drum `radius` (m), `omega` (rad/s), `length` (m, 0: logs in cross-section), `step` (s),
`shell` (N/m), `gravity` (m/s^2) and the words of LcpImpact. Prints one line of JSON: processor time of a step (ms), places of the logs (m).
"""

import json
import sys
import time

from yade import dembark

options = dict(word.partition("=")[::2] for word in sys.argv[1:])
with open(options["drum"], encoding="utf-8") as file:
    drum = json.load(file)
steps = int(options["steps"])

O.materials.append(FrictMat(density=850))
logs = O.bodies.append([dembark.log(**log) for log in drum["logs"]])
walls = [O.bodies.append(dembark.drum((0, 0, 0), drum["radius"], omega=drum["omega"]))]
if drum["length"]:
    walls += [O.bodies.append(utils.wall(-0.5 * side * drum["length"], axis=2, sense=side)) for side in (1, -1)]
    for plate in walls[1:]:
        O.bodies[plate].state.angVel = (0, 0, drum["omega"])
O.dt = drum["step"]
impacts = LcpImpact(**drum["impact"], velocityAtStart=True, walls=[dict(bodies=[body], stiffness=drum["shell"]) for body in walls])
O.engines = [ForceResetter(), impacts, NewtonIntegrator(damping=0, gravity=(0, -drum["gravity"], 0))]
begin = time.process_time()
O.run(steps, True)
spent = time.process_time() - begin
print(json.dumps({"ms_per_step": 1e3 * spent / steps, "places": [list(O.bodies[k].state.pos) for k in logs]}))

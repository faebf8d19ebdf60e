"""The Python side: dumps, histories, packings, and the lines for wrong input."""

import json
import textwrap

import numpy as np
import pytest

from dembark.validation import engines

LOW, HIGH = np.array([-0.05, 0.0, -0.01]), np.array([0.05, 0.02, 0.05])


def frames(text):
    """[(step, columns, rows)] of a LAMMPS text dump."""
    result = []
    for part in text.split("ITEM: TIMESTEP\n")[1:]:
        lines = part.splitlines()
        assert lines[3] == "ITEM: BOX BOUNDS ff pp ff"
        assert [list(map(float, line.split())) for line in lines[4:7]] == [[a, b] for a, b in zip(LOW, HIGH, strict=True)]
        columns = lines[7].split()[2:]
        rows = np.array([[float(word) for word in line.split()] for line in lines[8:]])
        assert int(lines[2]) == len(rows)
        assert rows.shape[1] == len(columns)
        result.append((int(lines[0]), columns, rows))
    return result


@pytest.fixture(scope="module")
def dumps(yade):
    return yade.scenes("dumps")["dumps"]


def test_grains_dump_has_full_step_velocities_and_forces_with_weight(dumps):
    found = frames(dumps["grains"])
    assert [step for step, _, _ in found] == [50, 100]
    expected = ("id type x y z ix iy iz vx vy vz omegax omegay omegaz fx fy fz radius mass f_force_base[1] f_force_base[2] f_force_base[3] "
                "f_force_left[1] f_force_left[2] f_force_left[3]").split()
    for (_, columns, rows), seen in zip(found, dumps["seen"], strict=True):
        assert columns == expected
        assert rows[:, 0].tolist() == [2, 3, 4, 5]
        assert rows[:, 1].tolist() == [2, 1, 1, 1]
        for row in rows:
            force, velocity, position, mass = (np.array(v) for v in seen[int(row[0]) - 1])
            if row[1] == 1:
                force = force + mass * np.array([0, 0, -9.81])
                velocity = velocity + 0.5 * 2e-6 * force / mass
            assert row[14:17] == pytest.approx(force, rel=1e-6, abs=1e-12)
            assert row[8:11] == pytest.approx(velocity, rel=1e-6, abs=1e-9)
            # Wrapped along y only; the image flag leads back.
            assert row[2:5] + row[5:8] * [0, 0.02, 0] == pytest.approx(position, rel=1e-9)
            assert 0.0 <= row[3] < 0.02
    assert found[0][2][3, 6] == 1


def test_forces_of_walls_and_contacts_add_up_to_the_force_of_a_grain(dumps):
    for (_, _, grains), (_, columns, contacts) in zip(frames(dumps["grains"]), frames(dumps["contacts"]), strict=True):
        assert columns == [f"c_contacts[{i}]" for i in range(1, 13)]
        total = {int(row[0]): row[14:17] - row[18] * np.array([0, 0, -9.81]) for row in grains if row[1] == 1}
        sums = {int(row[0]): row[19:22].copy() for row in grains if row[1] == 1}
        for row in contacts:
            for number, sign in ((int(row[6]), 1.0), (int(row[7]), -1.0)):
                if number in sums:
                    sums[number] += sign * row[9:12]
        for number, force in total.items():
            assert sums[number] == pytest.approx(force, rel=1e-5, abs=1e-9)
        across = {tuple(sorted(map(int, row[6:8]))): int(row[8]) for row in contacts}
        assert across == {(2, 3): 0, (4, 5): 1}


def test_glued_grain_counts_to_its_wall(dumps):
    for (_, _, grains), (_, _, contacts) in zip(frames(dumps["grains"]), frames(dumps["contacts"]), strict=True):
        pair = next(row for row in contacts if {int(row[6]), int(row[7])} == {2, 3})
        on_grain = pair[9:12] * (1.0 if int(pair[6]) == 3 else -1.0)
        assert grains[1, 22:25] == pytest.approx(on_grain, rel=1e-6)
        assert np.all(grains[2:, 22:25] == 0.0)


def test_history_sums_walls_and_energy(dumps):
    header, *lines = dumps["time"].splitlines()
    assert header == "step,time,kinetic_energy,base_fx,base_fy,base_fz,left_fx,left_fy,left_fz"
    for line, (step, _, grains) in zip(lines, frames(dumps["grains"]), strict=True):
        values = [float(word) for word in line.split(",")]
        moving = grains[grains[:, 1] == 1]
        assert values[0] == step
        assert values[1] == pytest.approx(step * 2e-6)
        assert values[2] == pytest.approx((0.5 * moving[:, 18] * (moving[:, 8:11] ** 2).sum(axis=1)).sum(), rel=1e-6)
        assert values[3:6] == pytest.approx(moving[:, 19:22].sum(axis=0), rel=1e-5, abs=1e-9)
        assert values[6:9] == pytest.approx(moving[:, 22:25].sum(axis=0), rel=1e-5, abs=1e-9)


def script(yade, name, body):
    path = yade.folder / f"{name}.py"
    path.write_text("from yade import dembark\n" + textwrap.dedent(body))
    return path


PACKING = """dembark packing

3 atoms
2 atom types
-1 1 xlo xhi
-1 1 ylo yhi
-1 2 zlo zhi

Atoms

2 1 0.006 2000 0.1 0 0
1 1 0.005 2500 0 0 0.5
3 2 0.004 2500 0.2 0 0

Velocities

1 0 0 -0.25 0 3 0
"""


def test_a_packing_becomes_spheres_in_its_order(yade):
    (yade.folder / "packing.data").write_text(PACKING)
    path = script(yade, "packed", """
        import json
        O.dt = 1e-3
        one, other = (O.materials.append(FrictMat(density=2500)) for _ in range(2))
        ids = dembark.grains(one, gravity=(0, 0, -10), held=(other, 2))
        bodies = [(list(b.state.pos), b.shape.radius, list(b.state.vel), list(b.state.angVel), b.dynamic, b.mask, b.state.mass)
                  for b in O.bodies]
        json.dump([ids, bodies], open("packed.json", "w"))
        print("done")
        """)
    done = yade(path)
    assert "done" in done.stdout, done.stderr
    ids, bodies = json.loads((yade.folder / "packed.json").read_text())
    assert ids == {"1": [0, 1], "2": [2]}
    # Velocities are half a step behind positions.
    assert bodies[0][:6] == [[0, 0, 0.5], 0.0025, [0, 0, -0.245], [0, 3, 0], True, 1]
    assert bodies[1][1] == 0.003 and bodies[1][2] == [0, 0, 0.005] and bodies[2][4:6] == [False, 2]
    # Densities are those of the packing, not of the material.
    assert bodies[0][6] / bodies[1][6] == pytest.approx(2500 / 2000 * (5 / 6) ** 3)


@pytest.mark.parametrize(("word", "parts"), [("restart_every=often", ("restart_every=often", "number of steps")),
                                             ("resume=perhaps", ("resume=perhaps", "yes or no"))])
def test_a_wrong_word_for_restarts_is_one_line_and_code_2(yade, word, parts):
    done = yade(script(yade, "wrong", "dembark.run(1)\nprint('went on')\n"), word)
    assert_one_line(done, parts)


def test_a_run_does_not_contradict_the_words_that_its_writers_have_read(yade):
    done = yade(script(yade, "wrong", "dembark.run(1, resume=True)\nprint('went on')\n"))
    assert_one_line(done, ("resume=True", "start it with resume=yes"))


def test_means_of_two_kinds_come_back_as_they_were(yade):
    done = yade(script(yade, "means", """
        one, other = dembark.StepMeans(10), dembark.StepMeans(20)
        O.dt, O.engines = 1e-3, []
        O.run(1, True)
        one.add(1.0, 2.0), other.add(3.0)
        one.save(), other.save()
        one.sums, other.sums = [], []
        one.load(), other.load()
        print("found", one.sums, other.sums)
        """))
    assert "found [1.0, 2.0] [3.0]" in done.stdout, done.stderr


def test_output_files_are_cut_behind_the_state_or_left(yade):
    """To their length in the state; by their format if the state does not know them; never when their rows do not begin with the step."""
    frame = "ITEM: TIMESTEP\n{}\nITEM: NUMBER OF ATOMS\n1\nITEM: BOX BOUNDS ff ff ff\n0 1\n0 1\n0 1\nITEM: ATOMS id\n7\n"
    files = {"grains.dump": "".join(frame.format(n) for n in (0, 50, 100)), "half.csv": "step,x\n0,1\n50,2\n10",
             "known.txt": "no step\nat all\n", "means.txt": "# Means\n# TimeStep x\n50 1\n100 2\n", "other.txt": "two steps\nat all\n",
             "short.txt": "x", "table.csv": "step,x\n0,1\n50,2\n100,3\n150,4\n", "times.csv": "time,x\n0.5,1\n1.5,2\n"}
    for name, text in files.items():
        (yade.folder / name).write_text(text)
    done = yade(script(yade, "cuts", f"""
        open("then.txt", "w").write("no step\\n")
        record = DembarkStates.record(["then.txt"])
        known = "".join(record.replace("then.txt", name) for name in ("known.txt", "short.txt", "other.txt"))
        for line in DembarkStates.cut({list(files)}, known, 100):
            print(line)
        print("done")
        """))
    assert "done" in done.stdout, done.stderr
    found = {name: (yade.folder / name).read_text() for name in files}
    cut = {"grains.dump": frame.format(0) + frame.format(50), "half.csv": "step,x\n0,1\n50,2\n", "known.txt": "no step\n",
           "means.txt": "# Means\n# TimeStep x\n50 1\n", "table.csv": "step,x\n0,1\n50,2\n"}
    assert found == files | cut
    left = [line.split()[1] for line in done.stdout.splitlines() if "is left as it is" in line]
    assert left == [name for name in files if name not in cut]


def test_a_deck_without_numbers_says_where_they_come_from(yade):
    assert_one_line(yade(script(yade, "bare", "p = dembark.parameters()\nprint('went on')\n")), ("dembark deck",))


def test_a_deck_takes_the_words_of_restarts_only(yade):
    deck = script(yade, "words", "p = dembark.parameters(size=0.1)\nprint('went on', dembark.options())\n")
    assert_one_line(yade(deck, "size=0.2"), ("argument 'size=0.2'", "write the deck anew"))
    for word in ("restart_evry=5", "diameter=0.2", "resume"):
        assert_one_line(yade(deck, word), (f"argument '{word}' is not known to a deck", "restart_every=<steps> and resume=yes|no"))
    assert "went on (5, False)" in yade(deck, "restart_every=5", "resume=no").stdout


@pytest.mark.parametrize("exits", [["-x"], []])
def test_a_script_that_is_not_there_is_one_line(yade, exits):
    done = engines.call([yade.engine.executable, "-n", *exits, "absent.py"], yade.folder, yade.engine.environment())
    assert (done.returncode, done.stderr) == (2, "dembark: there is no script absent.py\n") and "Yade" not in done.stdout


@pytest.mark.parametrize("run", ["O.run(5, True)", "O.step()"])
def test_a_mistake_in_a_runner_is_one_line_with_its_code(yade, run):
    body = f"""
        O.engines = [PyRunner(command="dembark.fail('no word', 3)", iterPeriod=1, initRun=True)]
        O.dt = 1
        {run}
        print('went on')
        """
    assert_one_line(yade(script(yade, "runner", body)), ("no word",), 3)


def assert_one_line(done, parts, code=2):
    lines = [line for line in done.stderr.splitlines() if line.startswith("dembark: ")]
    assert len(lines) == 1, done.stderr
    assert all(part in lines[0] for part in parts), lines[0]
    assert done.returncode == code
    assert "Traceback" not in done.stderr and "terminate" not in done.stderr
    assert "went on" not in done.stdout


DROP = """
def drop(ip2, law={{}}, speed=0.0, friction_of=None, **rest):
    g = O.materials.append(FrictMat(young=5e6, poisson=0.3, density=2500))
    O.bodies.append([box((0, 0, -0.01), (1, 1, 0.01), fixed=True), sphere((0, 0, 0.0024), 0.0025)])
    O.bodies[1].state.vel = (0, 0, -speed)
    O.engines = [ForceResetter(), InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Box_Aabb()]),
                 InteractionLoop([Ig2_Box_Sphere_ScGeom()], [Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys(**ip2)],
                                 [Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz(**law)]), NewtonIntegrator()]
    O.dt = 1e-5
    O.run(3000, True)
    print('went on')

full = dict(restitution=0.5, staticFriction=0.5, kineticFriction=0.4, criticalSlipDistance=1e-5)
{call}
"""


def test_wrong_word_of_the_law_is_one_line_without_a_trace(yade):
    path = script(yade, "word", "Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz(presliding='bent')\nprint('went on')\n")
    assert_one_line(yade(path), ("presliding", "'bent'", "linear, exponential or partial_slip"))


def test_cylinder_along_x_in_a_periodic_cell_is_one_line(yade):
    """Raised in YADE's own thread."""
    path = script(yade, "cell", """
        wall = Body()
        wall.shape = CylinderWall(radius=0.02, axis=(1, 0, 0))
        O.bodies.append([wall, sphere((0, 0, 0), 0.001)])
        O.periodic = True
        O.engines = [InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_CylinderWall_Aabb()]), NewtonIntegrator()]
        O.run(1, True)
        print("went on")
        """)
    assert_one_line(yade(path), ("CylinderWall", "periodic", "along y or z"))


@pytest.mark.parametrize(("call", "parts", "code"), [
    ("del full['restitution']; drop(full)", ("restitution is not set",), 2),
    # Other values of the same path.
    *(pytest.param(*each, marks=pytest.mark.full) for each in [
        ("drop(full | dict(staticFriction=MatchMaker(matches=((0, 1, 0.5),))))",
         ("staticFriction has no value", "materials 0 and 0", "matches"), 2),
        ("drop(full | dict(kineticFriction=0.6))", ("kinetic friction must not exceed static friction", "materials 0 and 0"), 2),
        ("drop(full | dict(restitution=1.5))", ("restitution", "1.5", "<= 1"), 2),
        ("drop(full | dict(bridgeVolume=1e-10))", ("surfaceTension", "N/m"), 2),
        ("drop(full | dict(bridgeVolume=1e-10, surfaceTension=0.07), dict(capillaryModel='exact'))", ("contactAngle is not set",), 2),
        ("drop(full | dict(bridgeVolume=1e-10, surfaceTension=0.07, contactAngle=2.0), dict(capillaryModel='exact'))",
         ("contactAngle", "1.5708"), 2)]),
    ("drop(full, dict(normalLaw='hooke'))", ("characteristicVelocity", "m/s"), 2),
    # Of laws that are off, and in another unit.
    *((f"drop(full | dict({given}), dict({law}))", words, 2) for given, law, words in [
        ("bridgeVolume=1e-10, surfaceTension=0.07, contactAngle=0", "",
         ("bridgeVolume is given, but cohesion is none; it needs bridge, which a capillaryModel is, bodies 0 and 1",)),
        ("rollingFriction=0.2", "", ("rollingFriction is given, but rollingResistance is off; it needs constant_torque or",)),
        ("workOfAdhesion=0.2", "cohesion='constant'", ("workOfAdhesion is given, but cohesion is constant; it needs dmt or jkr",)),
        ("", "characteristicVelocity=2", ("characteristicVelocity is given, but normalLaw is hertz; it needs hooke",)),
        ("bridgeVolume=8e-2, surfaceTension=0.07, contactAngle=0", "capillaryModel='exact'",
         ("bridgeVolume (m^3) is 5.12e+06 cubes of the largest radius; ",))]),
    ("drop(full, speed=300.0)", ("sphere 1 went through wall 0", "time step"), 1)])
def test_wrong_property_is_one_line_even_from_the_loop(yade, call, parts, code):
    assert_one_line(yade(script(yade, "property", DROP.format(call=call))), parts, code)

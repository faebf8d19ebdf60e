"""The command clear, after which stock LIGGGHTS begins anew: the styles are there again."""

from pathlib import Path

from rig.liggghts_driver import head, models, properties, run_deck
from rig.scenarios import Material

FALL = """\
region domain block 0 0.1 0 0.1 0 0.1 units box
create_box 2 domain
create_atoms 1 single 0.05 0.05 0.0025 units box
set group all diameter 0.005 density 2500
neighbor 0.002 bin
neigh_modify delay 0
timestep 1e-5
{properties}
pair_style gran {models}
pair_coeff * *
fix weight all gravity 9.81 vector 0 0 -1
fix floor all wall/gran {wall}
fix motion all nve/sphere
fix account all energy/account
fix watch all integration/monitor speed 1.0
variable kinetic equal f_account[1]
fix rows all print 100 "$(step) $(v_kinetic)" screen no file {rows} title none
run 500
"""


def test_styles_are_there_after_clear(tmp_path: Path) -> None:
    law = Material(static_friction=0.5, kinetic_friction=0.4, restitution=0.6, youngs_modulus=5e6)

    def once(rows: str) -> str:
        wall = models(law, wall="primitive type 2 zplane 0.0")
        return head() + "\n" + FALL.format(properties=properties(law), models=models(law), wall=wall, rows=rows)

    fluid = "units si\npair_style sph/coupled spacing 0.02 sound_speed 35\nclear\n"
    done = run_deck(tmp_path, "clear\n" + once("first") + "clear\n" + fluid + once("second"))
    assert done.code == 0, done.error or done.output[-1500:]
    assert (tmp_path / "second").read_text() == (tmp_path / "first").read_text()
    assert "Style collision" not in done.output


def test_a_state_that_was_read_before_clear_is_forgotten(tmp_path: Path) -> None:
    """One run goes on, and then, after clear, another one from its own restart file: with its own forces, not with those of the first."""
    law = Material(static_friction=0.5, kinetic_friction=0.4, restitution=0.6, youngs_modulus=5e6)
    text = head() + "\n" + FALL.format(properties=properties(law), models=models(law), wall=models(law, wall="primitive type 2 zplane 0.0"),
                                       rows="rows").replace("fix watch", "fix state all resume/exact 100 state\nfix watch")
    other = text.replace("gravity 9.81", "gravity 4.0").replace("100 state", "100 other").replace("file rows", "file whole")
    for one in (text, other.replace("run 500", "run 600")):
        assert run_deck(tmp_path, one).code == 0
    made = text[text.index("region domain"):text.index("neighbor 0.002")]
    first = text.replace(made, "resume_state state\n").replace("file rows", "file again")
    second = other.replace(made, "read_restart other.400.restart\n").replace("file whole", "file late")
    done = run_deck(tmp_path, first.replace("run 500", "run 500 upto") + "clear\n" + second.replace("run 500", "run 600 upto"))
    assert done.code == 0, done.error or done.output[-1500:]
    assert done.output.count("resumed at step 400 exactly") == 2
    assert (tmp_path / "late").read_text().splitlines()[-1] == (tmp_path / "whole").read_text().splitlines()[-1]

"""The files of sites: their mistakes in one line, and the scripts that they give for each scheduler."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from dembark.common.errors import DembarkError
from dembark.validation.campaigns.plan import Resources
from dembark.validation.engines.liggghts import Liggghts
from dembark.validation.runs import site

SLURM = site.find("slurm")
TEXT = (site.SHIPPED / "slurm.toml").read_text(encoding="utf-8")


def written(folder: Path, text: str) -> site.Site:
    (folder / "site.toml").write_text(text, encoding="utf-8")
    return site.find(str(folder / "site.toml"))


@pytest.mark.parametrize(("before", "after", "words"), [
    ("#SBATCH --nodes=1", "#SBATCH --partition=<partition>", "<partition> in header is a placeholder"),
    ("at_a_time = 100", "at_a_time = 0", "at_a_time = 0 is out of range"),
    ('time = "30 min"', 'time = "30"', "'30' is not a duration"),
    ('memory = "2 GB"', "memory = 2", "memory = 2 has the wrong type"),
    ("at_a_time = 100", "at_once = 5", "unknown key 'at_once'"),
    ("{script}", "{skript}", "{skript} in submit is not known"),
    ("{minutes}", "{hours}", "{hours} in header is not known"),
    ('index = "$SLURM_ARRAY_TASK_ID"', "", "index is missing"),
    ("array = ", "a = [1\narray = ", "cannot be read"),
])
def test_a_mistake_in_a_sites_file_is_reported_in_one_line(tmp_path: Path, before: str, after: str, words: str) -> None:
    assert before in TEXT
    with pytest.raises(DembarkError) as caught:
        written(tmp_path, TEXT.replace(before, after))
    assert words in str(caught.value) and "\n" not in str(caught.value) and str(tmp_path / "site.toml") in str(caught.value)


def test_a_site_that_is_not_there_and_the_examples() -> None:
    with pytest.raises(DembarkError, match="did you mean slurm"):
        site.find("slrum")
    for name in ("pbs", "lsf"):
        with pytest.raises(DembarkError, match=rf"<queue> in header is a placeholder.*{name}\.toml"):
            site.find(name)


EXPECTED = {
    "slurm": ['#SBATCH --output="/log"', "#SBATCH --ntasks=3", "#SBATCH --mem=500M", "#SBATCH --time=10", "#SBATCH --array=0-4%7",
              "#SBATCH --dependency=afterany:11:12"],
    "pbs": ["#PBS -l select=1:ncpus=6:mpiprocs=3:mem=500mb", "#PBS -l walltime=590", "#PBS -J 0-5%7", "#PBS -W depend=afterany:11:12"],
    "lsf": ['#BSUB -J "job[1-5]%7"', "#BSUB -n 6", "#BSUB -W 10", '#BSUB -w "ended(one) && ended(two)"'],
}


@pytest.mark.parametrize("name", EXPECTED)
def test_scripts_of_all_schedulers(tmp_path: Path, name: str) -> None:
    one = written(tmp_path, (site.SHIPPED / f"{name}.toml").read_text().replace("<queue>", "main"))
    lines = one.script("job", Path("/log"), Resources(3, 2, 5e8, 590.0), 5, [("11", "one"), ("12", "two")], "run it", 7).splitlines()
    assert lines[0] == "#!/bin/bash" and lines[-1] == "run it" and set(EXPECTED[name]) <= set(lines)
    alone = one.script("job", Path("/log"), Resources(), 1, [], "run it")
    assert "%100" in alone and not any(word in alone for word in ("afterany", "ended"))


def test_jobs_that_wait_or_run_are_known_by_their_names(tmp_path: Path) -> None:
    asked = re.sub(r'queued = ".*"', 'queued = "test {name} = known && printf \'7\\\\n7\\\\n8\\\\n\'"', TEXT)
    one = written(tmp_path, asked)
    assert one.waiting("known") == ["7", "8"] and one.waiting("other name") == []
    silent = written(tmp_path, re.sub(r'queued = ".*"', "", TEXT))
    assert silent.waiting("known") == []


def test_the_preamble_sets_the_environment(tmp_path: Path) -> None:
    text = "preamble = '''\necho Loading openmpi\nexport SITE=\"two\nlines\" DEMBARK_MPIRUN=\"srun --mpi=pmix\"\necho $UNSET\n'''\n"
    body = TEXT.partition("\n# Read by bash")[0] + "\n"
    found = written(tmp_path, body + text).environment()
    assert found["SITE"] == "two\nlines" and found["DEMBARK_MPIRUN"] == "srun --mpi=pmix" and not any("openmpi" in key for key in found)
    with pytest.raises(DembarkError, match=r"preamble of .*site\.toml fails.*module"):
        written(tmp_path, body + "preamble = 'module load nothing'\n").environment()
    for remarks in ("", "   ", "# nothing", "\\n# one\\n\\n# two\\n", "true # a remark"):
        assert written(tmp_path, body + f'preamble = "{remarks}"\n').environment()["PATH"]


@pytest.mark.parametrize(("submit", "words"), [("echo 12[].server", ""), ("echo '17;cluster'", ""),
                                               ("echo 'sbatch: error: no such partition' >&2; false", "refused a job, no such partition"),
                                               ("no-such-program", "refused a job, .*no-such-program"), ("true", "without a message")])
def test_the_answer_to_a_submission(tmp_path: Path, submit: str, words: str) -> None:
    one = written(tmp_path, TEXT.replace("sbatch --parsable {script}", submit))
    if words:
        with pytest.raises(DembarkError, match=words):
            one.send(tmp_path / "script")
    else:
        assert one.send(tmp_path / "script") in ("12[].server", "17")


def test_a_launcher_by_name(monkeypatch: pytest.MonkeyPatch) -> None:
    for key, value in {"SLURM_JOB_ID": "1", "SLURM_NODELIST": "n1", "PMI_RANK": "0", "SLURM_CONF": "/c"}.items():
        monkeypatch.setenv(key, value)
    engine = Liggghts(Path("/bin/lmp"), "", "")

    def known() -> set[str]:
        return {key for key in engine.environment() if key.startswith(("SLURM_", "PMI"))}

    assert engine.command(Path("d"), {}, 3)[:3] == ["mpirun", "-np", "3"] and known() == {"SLURM_CONF"}
    monkeypatch.setenv("DEMBARK_MPIRUN", "srun --mpi=pmix")
    words = engine.command(Path("d"), {}, 3)
    assert words[:4] == ["srun", "--mpi=pmix", "-n", "3"] and "/bin/lmp" in words and known() == {"SLURM_CONF", "SLURM_JOB_ID"}
    assert "srun" not in engine.command(Path("d"), {}, 1)

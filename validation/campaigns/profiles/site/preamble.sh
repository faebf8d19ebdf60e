# Site text of this profile: read by bash where `dembark submit` starts and again in every job, before the run.
# It may be read twice in one shell. Nothing here may print to standard output or end the shell.

# Modules that the engines were built with. Where `module` is unknown in scripts, read its definition first:
# . /etc/profile.d/modules.sh
# module purge
# module load gcc/12.3 openmpi/4.1.6

# Your own engines; without these lines those of `make` in the checkout, or of `module load`, are used.
# export DEMBARK_LIGGGHTS=$HOME/dembark/build/bin/liggghts-dembark
# export DEMBARK_YADE=$HOME/dembark/build/yade-overlay

# How MPI programs are started (only runs with ranks > 1 are). `-n <ranks>` is added.
#   srun --mpi=pmix    Slurm starts the ranks, on one node or more; `srun --mpi=list` says what your Slurm was built with
#   mpiexec            the MPI's own starter, on one node
# Without this line: mpirun of Open MPI, on one node.
# export DEMBARK_MPIRUN="srun --mpi=pmix"

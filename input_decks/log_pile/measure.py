"""Log pile: forces of a stack at rest, its contacts, and the state after the first impacts, in which engines must agree."""

from dembark.postproc.instruments import log_stack
from dembark.postproc.instruments.logs import read, solver_values
from dembark.postproc.measurement import Measurement, Replicas

REST = 0.1  # the share of the run, at its end, in which the stack is at rest


def measure(replicas: Replicas) -> Measurement:
    """Values of all piles; the curves and the state after the first impacts, in which engines must agree, of the first one."""
    runs = [read(replica) for replica in replicas]
    stacks, run = [log_stack.loads(one, log_stack.WALLS) for one in runs], runs[0]
    rest = slice(int((1.0 - REST) * len(run.times)), None)
    piles = [{**log_stack.at_rest(one, stack, rest), **log_stack.energy(one), **solver_values(one)}
             for one, stack in zip(runs, stacks, strict=True)]
    values = {**log_stack.together(piles), **log_stack.first_impacts(run), **log_stack.impact_values(runs)}
    remarks = [
        f"Measured at rest: the last {REST:.0%} of the run, {run.times[rest][-1] - run.times[rest][0]:.2f} s.",
        ("All engines must agree to round-off, which grows at each impact; a bound is set for the state after the "
         f"first {log_stack.FIRST} impacts of the first pile, later quantities are compared within the intervals over the piles."),
    ]
    if run.parameters["stake_friction"] > 0.0:
        remarks.append("The stakes are rough and carry part of the weight.")
    return Measurement(values, log_stack.curves(run, stacks[0]), remarks)

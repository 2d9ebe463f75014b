"""Trials of two coupled models; what each measures is described where it is computed, in fem/trials."""

from reflowshock.cases.hard.trials import elements as of
from reflowshock.workflow.stress_test.solver_trial import solver_trial

TRANSFER = "rigid_error linear_error tie_error cut_error mass_error"
TRIALS = {
    "window": solver_trial(of.PairTrial, "reflowshock.cases.hard.trials.windows:window", "growth substeps"),
    "windows": solver_trial(
        of.PairRun,
        "reflowshock.cases.hard.trials.windows:run",
        "energy_drift interface_energy energy_error momentum_error",
    ),
    "transfer": solver_trial(of.PairTransfer, "reflowshock.cases.hard.trials.windows:transfer", TRANSFER),
    "restart": solver_trial(of.PairTrial, "reflowshock.cases.hard.trials.windows:restart", "difference"),
    "yielding_pair": solver_trial(
        of.Yielding, "reflowshock.cases.hard.trials.windows:yielding", "energy_error plastic_share interface_energy"
    ),
    "reflection": solver_trial(
        of.Reflection,
        "reflowshock.cases.hard.trials.windows:reflection",
        "reflection_error reflected energy_error interface_energy substeps",
    ),
    "layout": solver_trial(of.Layout, "reflowshock.cases.hard.trials.layouts:layout", f"growth substeps {TRANSFER}"),
}

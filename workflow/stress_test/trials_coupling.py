"""Trials of two coupled models; what each measures is described where it is computed, in fem/trials."""

from reflowshock.fem.trials import parameters as of
from reflowshock.workflow.stress_test.solver_trial import solver_trial

TRANSFER = "rigid_error linear_error tie_error cut_error mass_error"
TRIALS = {
    "window": solver_trial(of.PairTrial, "reflowshock.fem.trials.windows:window", "growth substeps"),
    "windows": solver_trial(
        of.PairRun, "reflowshock.fem.trials.windows:run", "energy_drift interface_energy energy_error momentum_error"
    ),
    "transfer": solver_trial(of.PairTransfer, "reflowshock.fem.trials.windows:transfer", TRANSFER),
    "restart": solver_trial(of.PairTrial, "reflowshock.fem.trials.windows:restart", "difference"),
    "yielding_pair": solver_trial(
        of.Yielding, "reflowshock.fem.trials.windows:yielding", "energy_error plastic_share interface_energy"
    ),
    "reflection": solver_trial(
        of.Reflection,
        "reflowshock.fem.trials.reflection:reflection",
        "reflection_error reflected energy_error interface_energy substeps",
    ),
    "layout": solver_trial(of.Layout, "reflowshock.fem.trials.layouts:layout", f"growth substeps {TRANSFER}"),
}

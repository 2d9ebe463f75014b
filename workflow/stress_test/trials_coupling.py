"""Trials of two coupled models; what each measures is described where it is computed, in fem/trials."""

from fem.trials import parameters as of
from workflow.stress_test.solver_trial import solver_trial

TRANSFER = "rigid_error linear_error tie_error cut_error mass_error"
TRIALS = {
    "window": solver_trial(of.PairTrial, "fem.trials.windows:window", "growth substeps"),
    "windows": solver_trial(
        of.PairRun, "fem.trials.windows:run", "energy_drift interface_energy energy_error momentum_error"
    ),
    "transfer": solver_trial(of.PairTransfer, "fem.trials.windows:transfer", TRANSFER),
    "restart": solver_trial(of.PairTrial, "fem.trials.windows:restart", "difference"),
    "yielding_pair": solver_trial(
        of.Yielding, "fem.trials.windows:yielding", "energy_error plastic_share interface_energy"
    ),
    "reflection": solver_trial(
        of.Reflection,
        "fem.trials.reflection:reflection",
        "reflection_error reflected energy_error interface_energy substeps",
    ),
    "layout": solver_trial(of.Layout, "fem.trials.layouts:layout", f"growth substeps {TRANSFER}"),
}

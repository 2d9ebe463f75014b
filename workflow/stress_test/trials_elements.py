"""Trials of elements and of one model that moves; what they measure is described in fem/trials."""

from fem.trials import parameters as of
from workflow.stress_test.solver_trial import solver_trial

MEASURES_OF_FLIGHT = "energy_error momentum_error angular_momentum_error energy_left step_gain"
TRIALS = {
    "patch": solver_trial(of.Patch, "fem.trials.fields:patch", "force_error stress_error softest_mode rigid_mode"),
    "turns": solver_trial(of.Turns, "fem.trials.fields:turns", "force_error stress_error"),
    "tension": solver_trial(of.Tension, "fem.trials.fields:tension", "stress_error stress_scatter force_error"),
    "compression": solver_trial(
        of.Compression, "fem.trials.fields:compression", "stress_error stress_scatter force_error"
    ),
    "bending": solver_trial(of.Bending, "fem.trials.bending:bending", "deflection_error"),
    "order": solver_trial(of.Order, "fem.trials.order:order", "displacement_order strain_order"),
    "hinge": solver_trial(of.Hinge, "fem.trials.bending:hinge", "moment_error"),
    "flight": solver_trial(of.Flight, "fem.trials.flight:flight", MEASURES_OF_FLIGHT),
    "impact": solver_trial(
        of.Impact, "fem.trials.impact:impact", "energy_error plastic_share plastic_return hourglass_share"
    ),
    "tied_blocks": solver_trial(of.Tied, "fem.trials.tied:tied", "stress_error mean_stress_error pull_error"),
    "pulse": solver_trial(
        of.PulseTrial, "fem.trials.pulses:pulse", "velocity_error displacement_error strain_energy energy_error"
    ),
}

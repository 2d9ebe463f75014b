"""Trials of elements and of one model that moves; what they measure is described in fem/trials."""

from reflowshock.cases.hard.trials import elements as of
from reflowshock.workflow.stress_test.solver_trial import solver_trial

MEASURES_OF_FLIGHT = "energy_error momentum_error angular_momentum_error energy_left step_gain"
TRIALS = {
    "patch": solver_trial(
        of.Patch, "reflowshock.cases.hard.trials.fields:patch", "force_error stress_error softest_mode rigid_mode"
    ),
    "turns": solver_trial(of.Turns, "reflowshock.cases.hard.trials.fields:turns", "force_error stress_error"),
    "tension": solver_trial(
        of.Tension, "reflowshock.cases.hard.trials.fields:tension", "stress_error stress_scatter force_error"
    ),
    "compression": solver_trial(
        of.Compression, "reflowshock.cases.hard.trials.fields:compression", "stress_error stress_scatter force_error"
    ),
    "bending": solver_trial(of.Bending, "reflowshock.cases.hard.trials.beams:bending", "deflection_error"),
    "order": solver_trial(of.Order, "reflowshock.cases.hard.trials.beams:order", "displacement_order strain_order"),
    "hinge": solver_trial(of.Hinge, "reflowshock.cases.hard.trials.beams:hinge", "moment_error"),
    "flight": solver_trial(of.Flight, "reflowshock.cases.hard.trials.motion:flight", MEASURES_OF_FLIGHT),
    "impact": solver_trial(
        of.Impact,
        "reflowshock.cases.hard.trials.motion:impact",
        "energy_error plastic_share plastic_return hourglass_share",
    ),
    "tied_blocks": solver_trial(
        of.Tied, "reflowshock.cases.hard.trials.fields:tied", "stress_error mean_stress_error pull_error"
    ),
    "pulse": solver_trial(
        of.PulseTrial,
        "reflowshock.cases.hard.trials.motion:pulse",
        "velocity_error displacement_error strain_energy energy_error",
    ),
}

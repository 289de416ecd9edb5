"""All experiments by name, in the thesis's order."""

from sara_lab.experiments import in_place, orientation, rest, school, square_fusions, square_odometry, turns

EXPERIMENTS = {
    experiment.name: experiment
    for experiment in (
        *rest.EXPERIMENTS,
        *orientation.EXPERIMENTS,
        turns.EXPERIMENT,
        in_place.EXPERIMENT,
        square_odometry.EXPERIMENT,
        square_fusions.EXPERIMENT,
        school.EXPERIMENT,
    )
}

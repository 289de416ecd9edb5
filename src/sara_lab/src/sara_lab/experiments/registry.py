"""All experiments by name, in the thesis's order."""

from sara_lab.experiments import (
    in_place,
    orientation_report,
    rest,
    school,
    square_fusions,
    square_odometry,
    turns,
    variances,
    yaw_at_rest,
)

EXPERIMENTS = {
    experiment.name: experiment
    for experiment in (
        *rest.EXPERIMENTS,
        yaw_at_rest.EXPERIMENT,
        orientation_report.EXPERIMENT,
        variances.EXPERIMENT,
        turns.EXPERIMENT,
        in_place.EXPERIMENT,
        square_odometry.EXPERIMENT,
        square_fusions.EXPERIMENT,
        school.EXPERIMENT,
    )
}

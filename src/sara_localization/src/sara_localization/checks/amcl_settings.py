"""What can be started as amcl but will not do what its author wants, each in one sentence with its remedy."""

from __future__ import annotations

from sara_localization.checks.findings import Finding, of_parameters
from sara_localization.particles.amcl_config import AmclConfig

_ITS_OWN = ('laser_', 'odom_alpha', 'odom_model_type', 'min_particles', 'max_particles', 'kld_', 'resample_interval')
_LONG_WAY, _LONG_TURN = 1.0, 1.6
"""m and rad between two scans used, from which on the odometry's error may exceed what a scan can mend."""
_LARGE_ALPHA = 0.1
_SIGMAS = 3.0
_GREAT_POWER, _GREAT_POWER_OF_PRODUCT = 6.0, 1.0
"""Of laser_likelihood_power, above which the covariance is smaller than the errors: `campaign amcl_nees`."""


def is_for_amcl(params: dict[str, object]) -> bool:
    """Whether a file's parameters are amcl's, by their names."""
    return any(name.startswith(_ITS_OWN) for name in params)


def check_amcl(params: dict[str, object]) -> list[Finding]:
    """Everything found in amcl's parameters."""
    return of_parameters(AmclConfig.from_params, params, _doubtful)


def _doubtful(c):
    return (*_of_particles(c), *_of_scans(c))


def _of_particles(c):
    alphas = [c.odom_alpha1, c.odom_alpha2, c.odom_alpha3, c.odom_alpha4]
    slow, fast = c.recovery_alpha_slow, c.recovery_alpha_fast
    return (
        (
            c.odom_model_type.endswith('-corrected') and max(alphas) >= _LARGE_ALPHA,
            'odom_alpha',
            f'odom_alpha1 to 4 reach {max(alphas):g}, right for diff and omni; {c.odom_model_type} takes them for '
            'variances: 0.005 to 0.05 is usual.',
        ),
        (
            slow >= fast > 0.0,
            'recovery_alpha_slow',
            f'recovery_alpha_slow ({slow:g}) is not below recovery_alpha_fast ({fast:g}): random particles never come. '
            '0.001 and 0.1 are usual, 0 and 0 for none.',
        ),
        (
            c.lost_limit < 0.5,
            'lost_limit',
            f'lost_limit is {c.lost_limit:g}: the place is searched for although the pose is more probably right. '
            '0.9 is usual.',
        ),
        (
            c.lost_keeps_heading > 0.0 and not c.lost_recovery,
            'lost_keeps_heading',
            'lost_keeps_heading has no effect without lost_recovery: true.',
        ),
        (
            c.first_map_only and not c.use_map_topic,
            'first_map_only',
            'first_map_only has no effect without use_map_topic: true.',
        ),
        (
            c.update_min_d > _LONG_WAY or c.update_min_a > _LONG_TURN,
            'update_min_d',
            f'a scan is used only every {c.update_min_d:g} m or {c.update_min_a:g} rad: the odometry drifts meanwhile. '
            '0.2 m and 0.5 rad are usual.',
        ),
        (
            c.transform_tolerance == 0.0,
            'transform_tolerance',
            'transform_tolerance is 0: map -> odom is older than what others ask for. 0.1 s is usual.',
        ),
    )


def _of_scans(c):
    product = c.laser_model_type == 'likelihood_field_prob'
    return (
        (
            c.laser_likelihood_max_dist < _SIGMAS * c.laser_sigma_hit and c.laser_model_type != 'beam',
            'laser_likelihood_max_dist',
            f'laser_likelihood_max_dist is {c.laser_likelihood_max_dist:g} m, less than {_SIGMAS:g} laser_sigma_hit: '
            'scans hardly tell poses apart. 2 m is usual.',
        ),
        (
            c.do_beamskip and c.laser_model_type != 'likelihood_field_prob',
            'do_beamskip',
            f'do_beamskip has no effect with laser_model_type {c.laser_model_type}: only likelihood_field_prob skips '
            'beams.',
        ),
        (
            c.laser_likelihood_power > (_GREAT_POWER_OF_PRODUCT if product else _GREAT_POWER),
            'laser_likelihood_power',
            f'laser_likelihood_power is {c.laser_likelihood_power:g}: the covariance of {c.laser_model_type} becomes '
            f"smaller than the errors. {0.1 if product else 5:g} makes it as large as they are, 1 is the C++ node's.",
        ),
    )

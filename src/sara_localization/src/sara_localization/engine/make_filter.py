"""The filter that a configuration asks for: kind, backend, noise, start, control and biases."""

from __future__ import annotations

from sara_localization.config.filter_config import FilterConfig
from sara_localization.filters.control import Control
from sara_localization.filters.ekf import Ekf
from sara_localization.filters.estimator import Biases, Estimator
from sara_localization.filters.ukf import Ukf


def make_filter(
    config: FilterConfig, control: Control | None = None, biases: dict[str, dict[int, int]] | None = None
) -> Estimator:
    """The EKF or UKF of a configuration, by its backend; biases: as Preprocessor.biases."""
    noise, variance = [], []
    for name, states in (biases or {}).items():
        noise += [config.input(name).gyro_bias_noise] * len(states)
        variance += [config.input(name).gyro_bias_variance] * len(states)
    arguments = dict(
        process_noise=config.process_noise_covariance,
        initial_covariance=config.initial_estimate_covariance,
        initial_state=config.initial_state,
        control=control,
        biases=Biases(noise, variance),
        dynamic_process_noise=config.dynamic_process_noise_covariance,
    )
    if config.filter == 'ukf':
        arguments.update(alpha=config.alpha, beta=config.beta, kappa=config.kappa)
    return _filter_class(config)(**arguments)


def _filter_class(config: FilterConfig) -> type[Estimator]:
    if config.backend == 'compiled':
        return Ukf if config.filter == 'ukf' else Ekf
    # Imported where it is asked for: filterpy brings scipy along.
    from sara_localization.filters.filterpy_backend import FilterpyEkf, FilterpyUkf

    return FilterpyUkf if config.filter == 'ukf' else FilterpyEkf

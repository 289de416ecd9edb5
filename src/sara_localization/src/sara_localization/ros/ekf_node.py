"""ekf_localization_node."""

from sara_localization.ros.filter_node import run


def main() -> None:
    run('ekf')

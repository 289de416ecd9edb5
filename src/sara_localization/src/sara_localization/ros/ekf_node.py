"""ekf_localization_node."""
from .filter_node import run


def main():
    run('ekf')

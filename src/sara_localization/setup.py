from setuptools import setup
from catkin_pkg.python_setup import generate_distutils_setup

setup(**generate_distutils_setup(
    packages=['sara_localization', 'sara_localization.ros'],
    package_dir={'': 'src'}))

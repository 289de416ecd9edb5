from catkin_pkg.python_setup import generate_distutils_setup
from setuptools import setup

setup(**generate_distutils_setup(packages=['ahead_of_time'], package_dir={'': 'src'}))

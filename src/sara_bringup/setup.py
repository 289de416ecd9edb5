from setuptools import setup

from catkin_pkg.python_setup import generate_distutils_setup

setup(**generate_distutils_setup(packages=['sara_bringup', 'sara_bringup.benches', 'sara_bringup.experiments', 'sara_bringup.ros'], package_dir={'': 'src'}))

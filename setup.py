"""Catkin's hook for the Python package; pip users get the same package from pyproject.toml."""

from setuptools import find_packages, setup

try:
    from catkin_pkg.python_setup import generate_distutils_setup
except ImportError:  # a pip installation on a machine without ROS
    setup()
else:
    setup(**generate_distutils_setup(packages=find_packages("src"), package_dir={"": "src"}))

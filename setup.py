"""Installs the Python package: for catkin as package.xml says, for pip alone as pyproject.toml says."""

import os
import sys

from setuptools import Distribution, find_packages, setup


class CatkinDistribution(Distribution):
    """A distribution that does not read pyproject.toml.

    Under catkin, package.xml is the manifest; with pyproject.toml read as well, `catkin_make install` would add pip's
    console scripts to the launchers that `catkin_install_python` installs.
    """

    def parse_config_files(self, *_args, **_kwargs):
        """Reads nothing: all there is to know is passed to `setup`."""


def files_below(folder):
    """The paths of all files below `folder` but Python sources and what they are compiled to."""
    return [
        os.path.join(parent, name)
        for parent, _, names in os.walk(folder)
        for name in sorted(names)
        if not name.endswith((".py", ".pyc"))
    ]


def package_data():
    """The files of the package that are not Python sources, relative to it."""
    return {"xplane_bridge": [os.path.relpath(path, "src/xplane_bridge") for path in files_below("src/xplane_bridge")]}


def configuration():
    """config/ as share/xplane_bridge/config/ of the prefix, where catkin puts it and xplane_bridge.resources looks."""
    folders = {}
    for path in files_below("config"):
        folders.setdefault(os.path.join("share", "xplane_bridge", os.path.dirname(path)), []).append(path)
    return sorted(folders.items())


if "setuptools.build_meta" in sys.modules:  # pip, or another PEP 517 front end
    setup(package_data=package_data(), data_files=configuration())
else:
    from catkin_pkg.python_setup import generate_distutils_setup

    setup(
        **generate_distutils_setup(
            packages=find_packages("src"),
            package_dir={"": "src"},
            package_data=package_data(),
            distclass=CatkinDistribution,
        )
    )

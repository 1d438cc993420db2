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


def package_data(package):
    """The paths, relative to `package` (a folder), of all its files that are not Python sources."""
    return [
        os.path.relpath(os.path.join(folder, name), package)
        for folder, _, names in os.walk(package)
        for name in names
        if not name.endswith((".py", ".pyc"))
    ]


if "setuptools.build_meta" in sys.modules:  # pip, or another PEP 517 front end
    setup()
else:
    from catkin_pkg.python_setup import generate_distutils_setup

    setup(
        **generate_distutils_setup(
            packages=find_packages("src"),
            package_dir={"": "src"},
            package_data={"xplane_bridge": package_data("src/xplane_bridge")},
            distclass=CatkinDistribution,
        )
    )

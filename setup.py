"""Installs the Python package: for catkin as package.xml says, for pip alone as pyproject.toml says."""

import os
import subprocess
import sys

from setuptools import Distribution, Extension, find_packages, setup
from setuptools.command.build_ext import build_ext


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


class BuildWithMessageCode(build_ext):
    """Compiles after cmake/message_code has written the headers that follow from the messages."""

    def run(self):
        """Writes them where the extension looks for them."""
        generated = os.path.join(self.build_temp, "generated")
        # Where it fails, so does the compilation, which is optional: everything else is installed all the same.
        subprocess.run([sys.executable, "-B", os.path.join("cmake", "message_code"), "core", generated], check=False)
        self.include_dirs.append(generated)
        super().run()


#: Where Eigen's headers may lie.
EIGEN = ("/usr/include/eigen3", "/usr/local/include/eigen3", "/opt/homebrew/include/eigen3")


def compiled_module():
    """xplane_bridge._core, of the same files as lib/bindings/CMakeLists.txt makes it; left out without a compiler."""
    control = ["control_arbiter", "control_channels", "control_command", "control_rows"]
    bindings = ["arbiter", "datagrams", "flight_truth", "module"]
    bindings += ["state_reader", "twin_frame", "twin_loop", "twin_physics"]
    include_dirs, macros = ["include"], []
    core = [f"control/{name}" for name in control]
    eigen = [path for path in EIGEN if os.path.exists(os.path.join(path, "unsupported", "Eigen", "FFT"))]
    if eigen:  # else without flights in process: the emulator's own parts alone
        core += ["control/excitation", "state/air_data", "state/flight_computation", "state/frames"]
        bindings += ["excitation", "flight_view"]
        include_dirs.append(eigen[0])
        macros.append(("XPLANE_BRIDGE_WITH_EIGEN", None))
    # The same bits as Python's own arithmetic: nothing fused, and every function the C library's.
    exact = ["-ffp-contract=off", "-fno-builtin"]
    return Extension(
        "xplane_bridge._core",
        [f"lib/core/{name}.cpp" for name in core] + [f"lib/bindings/{name}.cpp" for name in bindings],
        include_dirs=include_dirs,
        define_macros=macros,
        extra_compile_args=["-std=c++17", "-O2", "-fvisibility=hidden", *exact],
        language="c++",
        optional=True,
    )


if "setuptools.build_meta" in sys.modules:  # pip, or another PEP 517 front end
    setup(
        package_data=package_data(),
        data_files=configuration(),
        ext_modules=[compiled_module()],
        cmdclass={"build_ext": BuildWithMessageCode},
    )
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

"""Starts one of the package's Python programs with an interpreter that can run it.

Every Python program in scripts/ is a few lines that call `launch`. They work from a clone after scripts/setup (with
whatever python3 comes first on PATH), from a catkin workspace, and from the install space, where they lie in
lib/xplane_bridge/. (After `pip install` the same programs are console scripts and need none of this.)
"""

import importlib
import os
import re
import sys

# Where this file is, links resolved.
_HERE = os.path.dirname(os.path.realpath(__file__))
_CLONE = os.path.dirname(_HERE)


def launch(name):
    """Runs `xplane_bridge.cli.<name>.main()` and exits with what it returns.

    Args:
        name: the module's name below `xplane_bridge.cli`; its last part is the program's.
    """
    if os.path.isfile(os.path.join(_CLONE, "package.xml")):
        _use_clone()
    else:
        _use_install_space()
    try:
        program = importlib.import_module("xplane_bridge.cli." + name)
    except ModuleNotFoundError as error:
        sys.exit(_explain(error))
    # What its error messages begin with, also when a shell script calls this.
    sys.argv[0] = os.path.join(_HERE, name.split(".")[-1])
    sys.exit(program.main())


def _explain(error):
    """Says what to do about a module that is not there."""
    if (error.name or "").split(".")[0] == "xplane_bridge":
        return (
            f"the Python package xplane_bridge ({error.name}) is not where {os.path.realpath(sys.argv[0])} expects it: "
            "run scripts/setup in the clone, or source the setup.bash of the workspace it was built in"
        )
    return (
        f"{sys.executable} has no Python module '{error.name}': "
        "run scripts/setup in the clone, or pip install -r requirements.txt"
    )


def _use_clone():
    """Takes the interpreter and the generated messages that scripts/setup made, where it has been run."""
    _use_interpreter(os.path.join(_CLONE, ".venv", "bin", "python"))
    generated = os.path.join(_CLONE, ".workspace", "devel", "lib", "python3", "dist-packages")
    # A catkin workspace that has this clone, and is sourced, has messages of its own, and perhaps newer ones.
    sourced = any(map(_is_built_of_clone, os.environ.get("PYTHONPATH", "").split(os.pathsep)))
    if os.path.isdir(generated) and not sourced:
        _add_to_path(generated, first=True)
    _add_to_path(os.path.join(_CLONE, "src"), first=False)


def _is_built_of_clone(folder):
    """Whether a folder of Python packages is that of a devel space with messages of this clone, not of another one."""
    package = os.path.join(folder, "xplane_bridge")
    try:
        with open(os.path.join(package, "__init__.py"), encoding="utf-8") as file:
            # catkin's file names the folder of the sources.
            sources = re.search(r"^__extended_path = '(.*)'\.split", file.read(), re.MULTILINE)
    except OSError:
        return False
    is_ours = sources and os.path.realpath(sources.group(1)) == os.path.join(_CLONE, "src")
    return bool(is_ours) and os.path.isdir(os.path.join(package, "msg"))


def _use_install_space():
    """Takes the interpreter noted at installation, and the packages of the prefix this file is installed in."""
    with open(os.path.join(_HERE, "python_executable"), encoding="utf-8") as note:
        _use_interpreter(note.read().strip())
    _add_to_path(os.path.join(os.path.dirname(_HERE), "python3", "dist-packages"), first=False)


def _use_interpreter(python):
    """Starts the program anew with `python` if that is there and is not what runs it now."""
    here = (os.path.realpath(sys.executable), os.path.realpath(sys.prefix))
    there = (os.path.realpath(python), os.path.realpath(os.path.dirname(os.path.dirname(python))))
    # exec keeps the process id: an interpreter whose prefix is not two folders up is not started again and again.
    started_by_us = os.environ.get("XPLANE_BRIDGE_LAUNCHER_PID") == str(os.getpid())
    if here != there and not started_by_us and os.access(python, os.X_OK):
        os.environ["XPLANE_BRIDGE_LAUNCHER_PID"] = str(os.getpid())
        os.execv(python, [python, os.path.abspath(sys.argv[0]), *sys.argv[1:]])


def _add_to_path(folder, first):
    """Adds `folder` to the import path of this process and of its children."""
    inherited = [path for path in os.environ.get("PYTHONPATH", "").split(os.pathsep) if path]
    if folder not in inherited:
        inherited.insert(0 if first else len(inherited), folder)
        os.environ["PYTHONPATH"] = os.pathsep.join(inherited)
    # The folder of the launchers must not offer its files as modules.
    sys.path[:] = [path for path in sys.path if os.path.realpath(path or os.curdir) != _HERE]
    if folder not in sys.path:
        sys.path.insert(0 if first else len(sys.path), folder)


if __name__ == "__main__":
    # For scripts that have made the environment themselves: launcher.py <name> [argument...]
    launch(sys.argv.pop(1))

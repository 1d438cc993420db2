"""The package as others get it: the install space, the devel space's relays, and pip without ROS."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
WORKSPACE = ROOT / ".workspace"


def run(command, **kwargs):
    """Runs a command and fails with all it said unless it ends well."""
    kwargs.setdefault("timeout", 300)
    done = subprocess.run(
        [str(part) for part in command],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
        **kwargs,
    )
    assert done.returncode == 0, f"{' '.join(map(str, command))}: status {done.returncode}\n{done.stdout}"
    return done.stdout


def in_shell(setup, command, **kwargs):
    """Runs a command in a new shell that has sourced nothing but `setup`."""
    env = {"HOME": kwargs.pop("home"), "PATH": "/usr/local/bin:/usr/bin:/bin"}
    return run(["bash", "-c", f'source "{setup}" && {command}'], env=env, **kwargs)


def launchers():
    return sorted(
        path.name
        for path in (ROOT / "scripts").iterdir()
        if path.is_file() and "from launcher import launch" in path.read_text(encoding="utf-8")
    )


@pytest.fixture(scope="module")
def install_space():
    """What `make install` gives; the build is the one that scripts/setup has made."""
    assert (WORKSPACE / "build" / "Makefile").is_file(), "there is no build in .workspace/: run scripts/setup --test"
    prefix = WORKSPACE / "install"
    shutil.rmtree(prefix, ignore_errors=True)
    env = {key: value for key, value in os.environ.items() if key not in ("MAKEFLAGS", "MAKELEVEL", "DESTDIR")}
    # Without building: a new commit alone would have the libraries linked anew under the nodes of other tests.
    run(["make", "-C", WORKSPACE / "build", "install/fast"], env=env)
    yield prefix
    shutil.rmtree(prefix)  # where it lies, rosrun finds two programs of each name in a clone


def test_ros_finds_the_installed_package_and_its_messages(install_space, tmp_path):
    setup = install_space / "setup.bash"
    found = in_shell(setup, "rospack find xplane_bridge", home=str(tmp_path)).strip()
    assert found == str(install_space / "share" / "xplane_bridge")
    assert "sim_time" in in_shell(setup, "rosmsg show xplane_bridge/FlightState", home=str(tmp_path))
    python = "/usr/bin/python3 -c 'import xplane_bridge.msg as m; print(m.__file__)'"
    assert in_shell(setup, python, home=str(tmp_path)).startswith(str(install_space))


def test_only_the_package_itself_is_installed_as_python(install_space):
    # catkin lets distutils install all that lies in <build>/lib.
    folder = install_space / "lib" / "python3" / "dist-packages"
    names = {path.name for path in folder.iterdir() if not path.name.endswith((".egg-info", ".dist-info"))}
    assert names == {"xplane_bridge"}
    assert not list((install_space / "bin").glob("*")) if (install_space / "bin").is_dir() else True


def test_every_python_file_and_every_data_file_is_installed(install_space):
    source = ROOT / "src" / "xplane_bridge"
    installed = install_space / "lib" / "python3" / "dist-packages" / "xplane_bridge"
    wanted = {p.relative_to(source) for p in source.rglob("*") if p.is_file() and "__pycache__" not in p.parts}
    assert sorted(str(p) for p in wanted if not (installed / p).is_file()) == []


def test_configuration_and_launch_files_are_installed(install_space):
    share = install_space / "share" / "xplane_bridge"
    wanted = [p for folder in ("config", "launch") for p in (ROOT / folder).rglob("*") if p.is_file()]
    assert wanted
    assert [str(p) for p in wanted if not (share / p.relative_to(ROOT)).is_file()] == []


def test_launch_files_of_the_install_space_look_at_their_arguments(install_space, tmp_path):
    command = "roslaunch xplane_bridge tx.launch aircraft:=zeppelin || true"
    said = in_shell(install_space / "setup.bash", command, home=str(tmp_path))
    assert "(aircraft:=zeppelin); there is a330_300, b737_800, " in said


def test_nodes_of_the_install_space_find_their_libraries(install_space):
    nodes = [path.stem for path in (ROOT / "src").glob("*.cpp")]
    assert nodes
    env = {"LD_LIBRARY_PATH": str(install_space / "lib")}
    for node in nodes:
        assert "not found" not in run(["ldd", install_space / "lib" / "xplane_bridge" / node], env=env)


def test_public_headers_are_installed_and_complete(install_space, tmp_path):
    include = ROOT / "include"
    headers = sorted(str(p.relative_to(include)) for p in include.rglob("*.hpp") if p.parent.name != "bindings")
    assert not (install_space / "include/xplane_bridge/bindings").exists()
    source = tmp_path / "all_headers.cpp"
    source.write_text("".join(f"#include <{name}>\n" for name in headers), encoding="utf-8")
    pkg_config = f"pkg-config --cflags xplane_bridge opencv4 | sed s,-I{ROOT}/include,,"
    flags = in_shell(install_space / "setup.bash", pkg_config, home=str(tmp_path)).split()
    assert not [flag for flag in flags if flag == f"-I{include}"]
    run(["g++", "-std=c++17", "-fsyntax-only", *flags, source])


@pytest.mark.parametrize("name", [*launchers(), "release_overrides"])
@pytest.mark.parametrize("place", ["clone", "devel", "install"])
def test_programs_start_from_everywhere(name, place, install_space, tmp_path):
    folder = {
        "clone": ROOT / "scripts",
        "devel": WORKSPACE / "devel" / "lib" / "xplane_bridge",
        "install": install_space / "lib" / "xplane_bridge",
    }[place]
    # A python3 first on PATH that has none of what is needed, as pyenv and conda put it there.
    foreign = tmp_path / "bin"
    foreign.mkdir()
    (foreign / "python3").write_text('#!/bin/sh\nexec /usr/bin/python3 -S "$@"\n', encoding="utf-8")
    (foreign / "python3").chmod(0o755)
    env = {"HOME": str(tmp_path), "PATH": f"{foreign}:/usr/bin:/bin"}
    assert "usage:" in run([folder / name, "--help"], env=env, cwd=tmp_path)


@pytest.fixture(scope="module")
def wheel_folder(tmp_path_factory):
    """What `pip install` puts into a site folder, without its dependencies."""
    source = tmp_path_factory.mktemp("source")
    for name in ("src", "config", "cmake", "include", "lib", "msg", "srv", "scripts"):
        shutil.copytree(ROOT / name, source / name, ignore=shutil.ignore_patterns("__pycache__", "*.egg-info"))
    for name in ("pyproject.toml", "setup.py", "README.md", "LICENSE", "requirements.txt", "package.xml"):
        shutil.copy(ROOT / name, source)
    site = tmp_path_factory.mktemp("site")
    options = ["--no-deps", "--no-build-isolation", "--disable-pip-version-check", "--target", site]
    # Not optimised, which is most of the time that compiling takes; pip's own flags come before these.
    run([sys.executable, "-m", "pip", "install", *options, source], env={**os.environ, "CFLAGS": "-O0"})
    return site


def test_pip_installs_all_files_and_the_configuration(wheel_folder):
    source = ROOT / "src" / "xplane_bridge"
    wanted = {p.relative_to(source) for p in source.rglob("*") if p.is_file() and "__pycache__" not in p.parts}
    assert sorted(str(p) for p in wanted if not (wheel_folder / "xplane_bridge" / p).is_file()) == []
    config = {p.relative_to(ROOT) for p in (ROOT / "config").rglob("*") if p.is_file()}
    share = wheel_folder / "share" / "xplane_bridge"
    assert sorted(str(p) for p in config if not (share / p).is_file()) == []


def test_pip_installs_what_gives_x_plane_back(wheel_folder, tmp_path):
    said = run([wheel_folder / "bin" / "release_overrides", "--list", "--folder", tmp_path])
    assert said == f"nothing to release: no journal in {tmp_path}\n"


def test_pip_compiles_what_campaigns_need(wheel_folder, tmp_path):
    campaign = ROOT / "config/campaigns/stuck_aileron.yaml"
    arguments = [campaign, "-o", tmp_path / "out", "--flights", "1", "--workers", "0"]
    done = without_ros("run_campaign", arguments, wheel_folder, tmp_path)
    assert done.returncode == 0, done.stderr
    assert "outcomes: 1 flown" in done.stdout


WITHOUT_ROS = """
import sys


class NoRos:
    @staticmethod
    def find_spec(name, *_):
        if name.split(".")[0] in ("rospy", "roslib", "rosgraph", "genpy"):
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)


site, program, module, *arguments = sys.argv[1:]
sys.meta_path.insert(0, NoRos)
sys.path.insert(0, site)
sys.argv = [program, *arguments]
from xplane_bridge.resources import config_file

assert config_file("scenarios", "demo.yaml").is_file()
exec(f"from xplane_bridge.cli.{module} import main")
sys.exit(main())
"""


def without_ros(name, arguments, wheel_folder, folder):
    """Runs a program that pip has installed where there is no ROS."""
    script = (ROOT / "scripts" / name).read_text(encoding="utf-8")
    module = re.search(r'launch\("([\w.]+)"\)', script).group(1)
    # -I: neither this process's PYTHONPATH nor the folder it is started in.
    command = [sys.executable, "-I", "-c", WITHOUT_ROS, wheel_folder, name, module, *arguments]
    return subprocess.run(list(map(str, command)), cwd=folder, capture_output=True, text=True, check=False)


@pytest.mark.parametrize("name", launchers())
def test_without_ros_programs_say_how_they_are_used(name, wheel_folder, tmp_path):
    done = without_ros(name, ["--help"], wheel_folder, tmp_path)
    assert done.returncode == 0, done.stderr
    assert "usage:" in done.stdout


@pytest.mark.parametrize(
    ("name", "arguments"),
    [
        ("attitude_hold", []),
        ("joy_reader", []),
        ("live_plot", ["--after", "1", "/xplane/flight_state/roll_deg"]),
        ("record_watch", []),
        ("scenario_player", ["demo"]),
    ],
)
def test_without_ros_nodes_say_that_they_need_it(name, arguments, wheel_folder, tmp_path):
    done = without_ros(name, arguments, wheel_folder, tmp_path)
    assert (done.returncode, done.stderr.count("\n")) == (1, 1), done.stderr
    assert "rospy is not there: source ROS's setup.bash" in done.stderr


def test_environment_leaves_the_arguments_of_a_script_alone(tmp_path):
    """catkin's setup.bash takes the arguments of the script that sources it, and answers --help itself."""
    script = f'set -- --help; source "{WORKSPACE}/env.bash"; echo "arguments: $*"'
    assert run(["bash", "-c", script], env={"HOME": str(tmp_path), "PATH": "/usr/bin:/bin"}) == "arguments: --help\n"

"""record.launch: a recording that gets no flight, or not all cameras, says so while it can still be put right."""

from __future__ import annotations

from xplane_bridge.harness import ManagedProcess, wait_until
from xplane_bridge.harness.ros import roslaunch


def test_it_warns_while_no_states_come_and_takes_it_back(world):
    import rospy
    from xplane_bridge.msg import FlightState

    namespace = world.namespace.strip("/")
    launch = roslaunch(world.master, world.folder, "record.launch", ns=namespace, bag=world.folder / "empty.bag")
    with launch:
        launch.wait_for_line(rf"no flight is recorded: no node publishes {world.namespace}/flight_state", 60)
        publisher = rospy.Publisher(f"{world.namespace}/flight_state", FlightState, queue_size=1, latch=True)
        publisher.publish(FlightState())
        launch.wait_for_line("flight states are recorded now", 60)
        launch.wait_for_line(rf"nothing on {world.namespace}/flight_state .*, though /tests\w+ would publish it", 60)
        publisher.unregister()


def test_further_cameras_are_recorded_by_their_names(world):
    import rosgraph

    namespace = world.namespace.strip("/")
    bag = world.folder / "cameras.bag"
    arguments = {"ns": namespace, "bag": bag, "topics": "control/mode", "cameras": "belly tail"}
    wanted = {f"{world.namespace}/control/mode"}
    for camera in ("belly", "tail"):
        topics = ("image_raw/compressed", "camera_info", "frame_state")
        wanted |= {f"{world.namespace}/{camera}/camera/{topic}" for topic in topics}

    def recorded() -> set:
        _, subscribers, _ = rosgraph.Master("/test_record").getSystemState()
        return {topic for topic, nodes in subscribers if f"{world.namespace}/record" in nodes}

    with roslaunch(world.master, world.folder, "record.launch", **arguments):
        wait_until(lambda: wanted <= recorded(), 60.0, "subscriptions of the recorder")


def test_a_camera_that_is_not_recorded_is_named(world):
    import rospy
    from xplane_bridge.msg import FrameState

    rospy.Publisher(f"{world.namespace}/belly/camera/frame_state", FrameState, queue_size=1)
    arguments = {"ns": world.namespace.strip("/"), "bag": world.folder / "one.bag"}
    topics = "flight_state camera/frame_state"
    with roslaunch(world.master, world.folder, "record.launch", topics=topics, **arguments) as launch:
        launch.wait_for_line("camera belly is not recorded: record.launch takes it with cameras:=belly", 60)


def test_a_recording_that_does_not_want_states_has_no_watch(world):
    namespace = world.namespace.strip("/")
    bag = world.folder / "modes.bag"
    launch = roslaunch(world.master, world.folder, "record.launch", ns=namespace, bag=bag, topics="control/mode")
    with launch:
        launch.wait_for_line(r"process\[.*record-\d+\]: started", 60)
    assert "record_watch" not in launch.output()


def test_the_recorder_of_lockstep_takes_the_arguments_of_the_other_and_answers(world):
    import rosbag
    import rospy
    from std_msgs.msg import Header
    from xplane_bridge.msg import FlightState

    answers = []
    listening = rospy.Subscriber(
        f"{world.namespace}/lockstep/done", Header, lambda header: answers.append(header.stamp)
    )
    publisher = rospy.Publisher(f"{world.namespace}/flight_state", FlightState, queue_size=1, latch=True)
    state = FlightState(frame_count=7)
    state.header.stamp = rospy.Time(12, 345)
    publisher.publish(state)
    arguments = {"ns": world.namespace.strip("/"), "prefix": world.folder / "steps", "compression": "lz4"}
    launch = roslaunch(world.master, world.folder, "record.launch", lockstep=True, topics="flight_state", **arguments)
    with launch:
        wait_until(lambda: answers, 60.0, "answer of the recorder to a frame")
    publisher.unregister()
    listening.unregister()
    assert answers == [state.header.stamp]
    (file,) = world.folder.glob("steps_20??-??-??-??-??-??.bag")
    with rosbag.Bag(str(file)) as bag:
        assert bag.get_compression_info().compression == "lz4"
        ((topic, message, _),) = bag.read_messages()
    assert (topic, message.frame_count) == (f"{world.namespace}/flight_state", 7)


def test_the_recorder_of_lockstep_ends_where_nothing_can_be_written(world):
    import rospy
    from xplane_bridge.msg import FlightState

    publisher = rospy.Publisher(f"{world.namespace}/flight_state", FlightState, queue_size=1)
    recorder = [world.program("lockstep_recorder"), f"--output-name={world.folder / 'full.bag'}", "--chunksize=1"]
    recorder += [f"--bridge={world.namespace}", f"{world.namespace}/flight_state"]
    with_little_room = ["bash", "-c", "trap '' XFSZ; ulimit -f 64; exec \"$@\"", "bash", *recorder]  # [KiB] of a file
    with ManagedProcess("recorder", with_little_room, world.folder, env=world.master.env) as process:

        def ends() -> bool:
            publisher.publish(FlightState())
            return not process.running

        wait_until(ends, 60.0, "end of a recorder that cannot write")
        assert process.returncode == 1
        assert f"lockstep_recorder: cannot write {world.folder / 'full.bag.active'}: " in process.output()
    publisher.unregister()
    assert not (world.folder / "full.bag").exists()

"""The screen with python mss, cv_bridge and rospy, as a peer to measure against.

usage: mss_node.py TOPIC WIDTH HEIGHT RATE
"""

from __future__ import annotations

import sys

import mss
import numpy as np
import rospy
from cv_bridge import CvBridge
from sensor_msgs.msg import Image


def main() -> None:
    """Runs until the master asks it to end."""
    topic, width, height, rate = rospy.myargv(sys.argv)[1:5]
    rospy.init_node("mss_node", anonymous=True)
    publisher = rospy.Publisher(topic, Image, queue_size=2, tcp_nodelay=True)
    bridge = CvBridge()
    area = {"left": 0, "top": 0, "width": int(width), "height": int(height)}
    pace = rospy.Rate(float(rate))
    with mss.mss() as screen:
        while not rospy.is_shutdown():
            stamp = rospy.Time.now()
            bgra = np.asarray(screen.grab(area))
            image = bridge.cv2_to_imgmsg(np.ascontiguousarray(bgra[:, :, :3]), "bgr8")
            image.header.stamp = stamp
            publisher.publish(image)
            pace.sleep()


if __name__ == "__main__":
    main()

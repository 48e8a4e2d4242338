#!/usr/bin/python3
"""Logs the received images once a second (chapter 8 of the course): an example in plain rospy.

Needs neither handsteer nor cv_bridge, only Debian's own Python packages.
"""

import rospy
from sensor_msgs.msg import Image


class ImageSubscriber:
    """Counts images and keeps the newest."""

    def __init__(self) -> None:
        self.count = 0
        self.newest = None
        # The default buffer would delay images while a callback is busy: see docs/ros1.md.
        rospy.Subscriber("image_raw", Image, self.on_image, queue_size=1, buff_size=2**24)
        rospy.Timer(rospy.Duration(1), self.report)

    def on_image(self, image: Image) -> None:
        """Store an image; this must be fast, as the next image waits."""
        self.count += 1
        self.newest = image

    def report(self, _event: rospy.timer.TimerEvent) -> None:
        """Log what was received since the last report."""
        count, self.count = self.count, 0
        image = self.newest
        if not count or image is None:
            rospy.loginfo("no image on %s", rospy.resolve_name("image_raw"))
            return
        age_ms = (rospy.Time.now() - image.header.stamp).to_sec() * 1000
        rospy.loginfo(
            "%dx%d %s, %d images in the last second, the newest is %.0f ms old",
            image.width, image.height, image.encoding, count, age_ms,
        )  # fmt: skip


if __name__ == "__main__":
    rospy.init_node("image_subscriber", anonymous=True)
    ImageSubscriber()
    rospy.spin()

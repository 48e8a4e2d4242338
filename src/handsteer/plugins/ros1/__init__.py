"""The transport over ROS 1; rospy is imported only with this package.

Imports the kernel only.
"""

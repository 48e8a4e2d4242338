"""ROS 2: the transport by its own library, rclpy, if it can be imported; and what every transport of ROS 2 shares.

``names``, ``stop_order`` and ``base_transport`` have what all of ROS 2 share: remapping, a reset that a Stop has
overtaken, profiles, encoded messages, late ones. rclpy's features are not reimplemented.

``session``, ``topics`` and ``matching`` are rclpy's. ``arguments``, ``base_session``, ``base_transport`` and
``parameter_services`` do without it what rclpy does, for DDS and Zenoh. Imports the kernel only.
"""

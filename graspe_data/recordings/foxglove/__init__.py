"""Foxglove's message schemas, in JSON and protobuf, as the ROS messages that say the same."""

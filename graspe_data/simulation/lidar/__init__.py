"""A spinning lidar in a world: beams of finite width, mixed returns, intensity."""

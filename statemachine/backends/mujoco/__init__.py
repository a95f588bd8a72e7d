"""MuJoCo behind the contract: what stands beside `mujoco_backend.py`."""

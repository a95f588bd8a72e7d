"""Tasks for reinforcement learning, made with the public interface: to be read and changed."""

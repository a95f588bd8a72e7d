"""What the backend of MotrixSim is made from."""

"""What a robot is asked to do on any engine: scenarios, controllers, and how a run is driven."""

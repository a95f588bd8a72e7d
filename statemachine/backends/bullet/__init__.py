"""PyBullet behind the contract: what it lacks and we compute."""

"""An engine in a Python of its own, behind the contract: a release of MuJoCo, or any other."""

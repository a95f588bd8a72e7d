"""PyBullet without us; `engines` says what the parts are."""

"""The specification's reference decoder and test vectors. Not installed with the package."""

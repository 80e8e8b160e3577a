"""verify and validate: what they compare, measure and check."""

"""A whole run in the compiled core."""

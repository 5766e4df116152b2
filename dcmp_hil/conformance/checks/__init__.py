"""The checks, by section of the page; registry.py has them all."""

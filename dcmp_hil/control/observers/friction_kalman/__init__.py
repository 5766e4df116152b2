"""An observer that knows Coulomb friction, and gives way where the innovations contradict its model."""

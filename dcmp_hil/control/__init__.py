"""The control law: observers, controllers, references, the motor's model, start and end of a motion."""

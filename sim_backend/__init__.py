"""The simulated rig: plant, encoder and amplifier behind the same read and write as a real device."""

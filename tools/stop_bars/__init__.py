"""STOP against controllers that are bad to their run, timed at the device."""

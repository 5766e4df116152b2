"""What can go wrong with a simulated rig, level by level: wire, firmware, plant, host."""

"""Access to the operating system: time, real-time scheduling, signals, descriptors, folders."""

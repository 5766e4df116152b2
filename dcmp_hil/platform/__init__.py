"""What is asked of the operating system: time, real-time scheduling, signals, descriptors, folders."""

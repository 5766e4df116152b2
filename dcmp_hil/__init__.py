"""The bridge between a host-side real-time control loop and the firmware of a lab servo."""

__version__ = "0.1.0"

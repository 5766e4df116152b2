"""Links: ways for frames to and from a device, and the tables that name them."""

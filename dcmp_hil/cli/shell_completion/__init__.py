"""Scripts with which a shell completes command lines of `dcmp-hil`."""

"""Every command with every option, on every kind of output, through the installed script."""

"""Classes of the user's own, named by a rig as `module:Class`."""

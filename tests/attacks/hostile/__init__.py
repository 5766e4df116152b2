"""What attacks: classes and scripts that the tests of this folder put into a run."""

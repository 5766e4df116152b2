"""A virtual machine whose kernel has CAN, for computers whose own has none: Debian's, under QEMU.

It needs neither root nor KVM. It sees this computer's whole file system, as it is and read-only; what it
writes, it writes to its memory.
"""

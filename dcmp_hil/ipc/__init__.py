"""Communication of a run's processes: memory without a name, ring, mailbox, child process."""

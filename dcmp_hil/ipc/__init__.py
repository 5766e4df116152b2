"""What processes of one run share: memory without a name, ring, mailbox, answers of a child process."""

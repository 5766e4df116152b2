/* A pseudo terminal's master as the board's end of a serial line. */
#ifndef PTY_H
#define PTY_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/types.h>

/* Returns the master, non-blocking, its other end raw and not open; -1 with errno set. */
int pty_open(void);

/* Whether a process has the other end open. */
bool pty_in_use(int master);

/* Returns how many bytes were read, 0 if there are none, -1 if the other end has been closed. */
ssize_t pty_read(int master, uint8_t *bytes, size_t room);

/* Never waits; returns how many bytes fitted. */
size_t pty_write(int master, const uint8_t *bytes, size_t length);

/* Forget what was written and not read, when no process has the other end open. */
void pty_flush(int master);

#endif

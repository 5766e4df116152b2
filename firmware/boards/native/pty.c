#include "pty.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <termios.h>
#include <unistd.h>

static bool make_raw(int slave)
{
    struct termios line;
    if (tcgetattr(slave, &line) != 0) {
        return false;
    }
    line.c_iflag = 0;
    line.c_oflag = 0;
    line.c_lflag = 0;
    line.c_cflag |= CS8 | CREAD | CLOCAL;
    line.c_cc[VMIN] = 1;
    line.c_cc[VTIME] = 0;
    return tcsetattr(slave, TCSANOW, &line) == 0;
}

/* Once opened and closed, a master says at every poll whether the other end is in use. */
static bool prepare(int master)
{
    if (grantpt(master) != 0 || unlockpt(master) != 0) {
        return false;
    }
    const int slave = open(ptsname(master), O_RDWR | O_NOCTTY);
    if (slave < 0) {
        return false;
    }
    const bool raw = make_raw(slave);
    return close(slave) == 0 && raw && fcntl(master, F_SETFL, O_NONBLOCK) == 0;
}

int pty_open(void)
{
    const int master = posix_openpt(O_RDWR | O_NOCTTY);
    if (master >= 0 && !prepare(master)) {
        close(master);
        return -1;
    }
    return master;
}

bool pty_in_use(int master)
{
    struct pollfd port = {.fd = master, .events = 0};
    return poll(&port, 1, 0) == 0;
}

ssize_t pty_read(int master, uint8_t *bytes, size_t room)
{
    const ssize_t length = read(master, bytes, room);
    if (length > 0) {
        return length;
    }
    return length < 0 && (errno == EAGAIN || errno == EINTR) ? 0 : -1;
}

size_t pty_write(int master, const uint8_t *bytes, size_t length)
{
    const ssize_t written = length > 0u ? write(master, bytes, length) : 0;
    return written > 0 ? (size_t)written : 0u;
}

/* What has been written lies at the other end already: only from there it can be thrown away. */
void pty_flush(int master)
{
    const int slave = open(ptsname(master), O_RDWR | O_NOCTTY | O_NONBLOCK);
    if (slave >= 0) {
        tcflush(slave, TCIFLUSH);
        close(slave);
    }
}

"""Floods a port of this machine until it is ended: python flood.py KIND TARGET [HOST:PORT or socket path]."""

from __future__ import annotations

import resource
import select
import socket
import sys

CONNECTION_COUNT = 1_100
_REQUEST = (
    b"POST /stop HTTP/1.1\r\nHost: 127.0.0.1:%d\r\nOrigin: http://127.0.0.1:%d\r\n"
    b"Cookie: x=wrong\r\nContent-Length: 2\r\n\r\n{}"
)


def _open(target: str) -> socket.socket:
    if target.startswith("/"):
        connection = socket.socket(socket.AF_UNIX)
        connection.settimeout(1.0)
        connection.connect(target)
    else:
        connection = socket.create_connection(("127.0.0.1", int(target)), timeout=1.0)
    return connection


def half_open(target: str) -> None:
    """Keep 1,100 connections open that say nothing, or a word now and then; a closed one is opened again."""
    held: list[socket.socket] = []
    while True:
        try:
            while len(held) < CONNECTION_COUNT:
                held.append(_open(target))
                if len(held) % 2:
                    held[-1].sendall(b"POST /stop HT")
        except OSError:
            pass
        _drop_the_closed(held)


def _drop_the_closed(held: list[socket.socket]) -> None:
    told = select.poll()
    for one in held:
        told.register(one, select.POLLIN)
    speak = {number for number, _ in told.poll(10)}
    for one in [one for one in held if one.fileno() in speak]:
        try:
            gone = not one.recv(4096)
        except OSError:
            gone = True
        if gone:
            held.remove(one)
            one.close()


def requests(target: str) -> None:
    """Send whole requests of a stranger, one after the other, as fast as they go."""
    port = int(target)
    while True:
        try:
            with _open(target) as connection:
                connection.sendall(_REQUEST % (port, port))
                connection.recv(4096)
        except OSError:
            pass


def lines(target: str) -> None:
    """Send a run's control socket lines as fast as it takes them, on 50 connections."""
    held: list[socket.socket] = []
    line = b'{"do": "status"}\n' * 100
    while True:
        for one in tuple(held):
            try:
                one.sendall(line, socket.MSG_DONTWAIT)
                one.recv(1 << 16, socket.MSG_DONTWAIT)
            except BlockingIOError:
                pass
            except OSError:
                held.remove(one)
                one.close()
        try:
            while len(held) < 50:
                held.append(_open(target))
        except OSError:
            pass


if __name__ == "__main__":
    most = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(most, 8192), most))
    {"half_open": half_open, "requests": requests, "lines": lines}[sys.argv[1]](sys.argv[2])

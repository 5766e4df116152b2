/* Written by tools/protocol.py from dcmp.dbc. */
#ifndef DCMP_PROTOCOL_HASH_H
#define DCMP_PROTOCOL_HASH_H

#define DCMP_PROTOCOL_HASH 0x074280f0u

#endif

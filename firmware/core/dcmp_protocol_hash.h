/* Written by tools/protocol.py from dcmp.dbc. */
#ifndef DCMP_PROTOCOL_HASH_H
#define DCMP_PROTOCOL_HASH_H

#define DCMP_PROTOCOL_HASH 0xe982b180u

#endif

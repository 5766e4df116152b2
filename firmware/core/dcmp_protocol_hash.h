/* Written by tools/protocol.py from dcmp.dbc. */
#ifndef DCMP_PROTOCOL_HASH_H
#define DCMP_PROTOCOL_HASH_H

#define DCMP_PROTOCOL_HASH 0xeb5b950bu

#endif

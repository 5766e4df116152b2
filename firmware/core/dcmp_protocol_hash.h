/* Generated from firmware/proto/dcmp.dbc; `make generate` writes it. */
#ifndef DCMP_PROTOCOL_HASH_H
#define DCMP_PROTOCOL_HASH_H

#define DCMP_PROTOCOL_HASH 0x074280f0u

#endif

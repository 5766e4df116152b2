"""Code, page and hash that follow from firmware/proto/dcmp.dbc."""

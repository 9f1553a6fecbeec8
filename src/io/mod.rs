//! Scene and map files.

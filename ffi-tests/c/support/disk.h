/* Small files, whole. */
#ifndef DISK_H
#define DISK_H

#include <stddef.h>
#include <stdint.h>

enum { MAX_PATH = 1024 };

/* `folder`/`name`. */
void path_in(char path[MAX_PATH], const char *folder, const char *name);

void write_bytes(const char *file, const void *bytes, size_t size);

/* All bytes of a file, which must be there; freed by the caller. */
uint8_t *read_file(const char *file, size_t *size);

/* 0 when there is none. */
size_t file_size(const char *file);

#endif

#include "disk.h"

#include "check.h"

#include <stdio.h>
#include <stdlib.h>

static FILE *open_file(const char *file, const char *mode) {
    FILE *stream = fopen(file, mode);
    if (!stream) {
        perror(file);
        exit(1);
    }
    return stream;
}

void path_in(char path[MAX_PATH], const char *folder, const char *name) {
    const int length = snprintf(path, MAX_PATH, "%s/%s", folder, name);
    if (length < 0 || length >= MAX_PATH) {
        fprintf(stderr, "%s/%s is too long\n", folder, name);
        exit(1);
    }
}

void write_bytes(const char *file, const void *bytes, size_t size) {
    FILE *stream = open_file(file, "wb");
    if (fwrite(bytes, 1, size, stream) != size || fclose(stream) != 0) {
        perror(file);
        exit(1);
    }
}

uint8_t *read_file(const char *file, size_t *size) {
    *size = file_size(file);
    uint8_t *bytes = take(*size + 1, 1);
    FILE *stream = open_file(file, "rb");
    if (fread(bytes, 1, *size, stream) != *size) {
        perror(file);
        exit(1);
    }
    fclose(stream);
    return bytes;
}

size_t file_size(const char *file) {
    FILE *stream = fopen(file, "rb");
    if (!stream) {
        return 0;
    }
    long size = 0;
    if (fseek(stream, 0, SEEK_END) == 0) {
        size = ftell(stream);
    }
    fclose(stream);
    return size > 0 ? (size_t)size : 0;
}

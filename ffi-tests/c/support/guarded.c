#define _DEFAULT_SOURCE
#include "guarded.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

enum { PATTERN = 0x5C };

guarded guarded_take(size_t size) {
    const size_t page = (size_t)sysconf(_SC_PAGESIZE);
    const size_t usable = (size + page - 1) / page * page;
    guarded memory = {.size = size, .mapped = usable + page};
    memory.mapping =
        mmap(NULL, memory.mapped, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (memory.mapping == MAP_FAILED ||
        mprotect((uint8_t *)memory.mapping + usable, page, PROT_NONE) != 0) {
        perror("guarded memory");
        exit(1);
    }
    memory.bytes = (uint8_t *)memory.mapping + usable - size;
    return memory;
}

void guarded_free(guarded *memory) {
    munmap(memory->mapping, memory->mapped);
}

size_t rows_size(size_t row_bytes, size_t rows, size_t stride_bytes) {
    return stride_bytes * (rows - 1) + row_bytes;
}

void fill_rows(guarded *memory) {
    memset(memory->bytes, PATTERN, memory->size);
}

int gaps_are_untouched(const guarded *memory, size_t row_bytes, size_t rows, size_t stride_bytes) {
    for (size_t row = 0; row + 1 < rows; ++row) {
        for (size_t byte = row * stride_bytes + row_bytes; byte < (row + 1) * stride_bytes;
             ++byte) {
            if (memory->bytes[byte] != PATTERN) {
                return 0;
            }
        }
    }
    return 1;
}

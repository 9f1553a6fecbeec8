/* Memory before a protected page: reading or writing past its end ends the program. */
#ifndef GUARDED_H
#define GUARDED_H

#include <stddef.h>
#include <stdint.h>

typedef struct guarded {
    /* The bytes asked for, which end where the forbidden page begins. */
    uint8_t *bytes;
    size_t size;
    void *mapping;
    size_t mapped;
} guarded;

guarded guarded_take(size_t size);
void guarded_free(guarded *memory);

/*
 * Bytes of a buffer of rows that are `stride_bytes` apart and end with the last pixel of the last
 * row.
 */
size_t rows_size(size_t row_bytes, size_t rows, size_t stride_bytes);

/* Fills all bytes with a pattern, and returns whether those between the rows still have it. */
void fill_rows(guarded *memory);
int gaps_are_untouched(const guarded *memory, size_t row_bytes, size_t rows, size_t stride_bytes);

#endif

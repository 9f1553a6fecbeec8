#define _POSIX_C_SOURCE 200809L
#include "check.h"

#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { UNTOUCHED = 0xA5 };

alignas(64) unsigned char check_outputs[16 * 256];

static atomic_int checks;
static atomic_int failures;

int check_that(int holds, const char *what, const char *file, int line, const char *format, ...) {
    atomic_fetch_add(&checks, 1);
    if (!holds) {
        char text[512];
        va_list values;
        va_start(values, format);
        vsnprintf(text, sizeof text, format, values);
        va_end(values);
        atomic_fetch_add(&failures, 1);
        fprintf(stderr, "%s:%d: not true: %s (%s)\n", file, line, what, text);
    }
    return holds;
}

void require_ok(skep_status status, const char *what, const char *file, int line) {
    if (status != SKEP_OK) {
        char text[1024];
        skep_last_error(text, sizeof text);
        fprintf(stderr, "%s:%d: %s failed: %s: %s\n", file, line, what, skep_status_name(status),
                text);
        exit(1);
    }
}

/* Returns whether the places for outputs are unchanged, and fills them again. */
static int outputs_were_untouched(void) {
    int untouched = 1;
    for (size_t i = 0; i < sizeof check_outputs; ++i) {
        untouched &= check_outputs[i] == UNTOUCHED;
    }
    memset(check_outputs, UNTOUCHED, sizeof check_outputs);
    return untouched;
}

void check_start(void) {
    outputs_were_untouched();
}

void check_failure(skep_status status, const char *what, skep_status expected, const char *word,
                   const char *file, int line) {
    char text[2048] = "";
    const size_t length = skep_last_error(text, sizeof text);
    check_that(status == expected, what, file, line, "is %s (%s), expected %s",
               skep_status_name(status), text, skep_status_name(expected));
    if (status == expected) {
        check_that(strstr(text, word) != NULL, what, file, line,
                   "says \"%s\", expected \"%s\" in it", text, word);
        check_that(length > sizeof text || length == strlen(text) + 1, what, file, line,
                   "a text of %zu bytes said to take %zu", strlen(text) + 1, length);
    }
    check_that(outputs_were_untouched(), what, file, line, "wrote to an output");
}

void *take(size_t count, size_t size) {
    void *memory = calloc(count ? count : 1, size);
    if (!memory) {
        fprintf(stderr, "no memory for %zu x %zu bytes\n", count, size);
        exit(1);
    }
    return memory;
}

int same_bytes(const void *a, const void *b, size_t size) {
    return size == 0 || memcmp(a, b, size) == 0;
}

/* Threads of this process; 1 where the system does not report it. */
static int threads(void) {
    char line[256];
    int count = 1;
    FILE *status = fopen("/proc/self/status", "r");
    while (status && fgets(line, sizeof line, status)) {
        sscanf(line, "Threads: %d", &count);
    }
    if (status) {
        fclose(status);
    }
    return count;
}

int check_summary(void) {
    /* A thread that was joined is counted for a moment longer. */
    for (int waited = 0; threads() > 1 && waited < 200; ++waited) {
        nanosleep(&(struct timespec){0, 10000000}, NULL);
    }
    CHECK(threads() == 1, "%d threads", threads());
    printf("%d checks, %d failed\n", atomic_load(&checks), atomic_load(&failures));
    return atomic_load(&failures) ? 1 : 0;
}

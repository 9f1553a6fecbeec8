/* Checks, which count failures and continue, and requirements, which end the program. */
#ifndef CHECK_H
#define CHECK_H

#include <skep.h>
#include <stdalign.h>

/* Counts a failure and prints it, with a text like printf's. */
#define CHECK(condition, ...) check_that((condition), #condition, __FILE__, __LINE__, __VA_ARGS__)

/* Ends the program unless the call succeeds. */
#define REQUIRE(call) require_ok((call), #call, __FILE__, __LINE__)

/*
 * The call must fail with this status, its text must hold this word, and it must write nothing to
 * the places that OUT hands out.
 */
#define FAILS(call, status, word) check_failure((call), #call, (status), (word), __FILE__, __LINE__)

/*
 * A place for an output of a call that fails. Different places of one call have different numbers
 * from 0 to 15.
 */
#define OUT(type, number) ((type *)(void *)(check_outputs + 256 * (number)))

extern alignas(64) unsigned char check_outputs[16 * 256];

int check_that(int holds, const char *what, const char *file, int line, const char *format, ...)
#if defined(__GNUC__)
    __attribute__((format(printf, 5, 6)))
#endif
    ;
void require_ok(skep_status status, const char *what, const char *file, int line);
void check_failure(skep_status status, const char *what, skep_status expected, const char *word,
                   const char *file, int line);

/* Memory, or the end of the program. */
void *take(size_t count, size_t size);

/* Whether two pieces of memory hold the same bytes, which may be none. */
int same_bytes(const void *a, const void *b, size_t size);

/* To be called before the first check. */
void check_start(void);

/* Prints the number of checks; 1 when one of them failed, or a thread is left, else 0. */
int check_summary(void);

#endif

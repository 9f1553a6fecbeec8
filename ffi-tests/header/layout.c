/* Compares where this compiler puts the fields of skep.h's structs with layout.inc, which a Rust
 * test compares with the library's side. A C++ compiler reads this file too. */
#include <skep.h>
#include <stdio.h>

static int failures = 0;

static void expect(const char *what, size_t here, size_t library)
{
    if (here != library) {
        fprintf(stderr, "layout: %s is %lu here and %lu in the library\n", what,
            (unsigned long)here, (unsigned long)library);
        failures++;
    }
}

/* What the padding after one byte comes to. */
#define STRUCT(name, size, alignment) \
    struct aligned_##name { \
        char before; \
        name value; \
    };
#define FIELD(type, field, offset, size)
#include "layout.inc"
#undef STRUCT
#undef FIELD

int main(void)
{
    const int pointers_fit = sizeof(void *) == 8;
    if (!pointers_fit) {
        puts("layout.inc is for 64-bit pointers; nothing to compare here");
        return 0;
    }
#define STRUCT(name, size, alignment) \
    expect("the size of " #name, sizeof(name), size); \
    expect("the alignment of " #name, offsetof(struct aligned_##name, value), alignment);
#define FIELD(type, field, offset, size) \
    expect("the offset of " #type "." #field, offsetof(type, field), offset); \
    expect("the size of " #type "." #field, sizeof(((const type *)0)->field), size);
#include "layout.inc"
    return failures == 0 ? 0 : 1;
}

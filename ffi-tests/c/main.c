/* c-tests MODE FOLDER: runs one test with scratch files in FOLDER. */
#include "support/check.h"
#include "tests.h"

#include <stdio.h>
#include <string.h>

static const struct {
    const char *mode;
    void (*run)(const char *folder);
} TESTS[] = {
    {"whole", test_whole},
    {"formats", test_formats},
    {"inputs", test_inputs},
    {"stepper", test_stepper},
    {"own-maps", test_own_maps},
    {"kernels", test_kernels},
    {"cancel", test_cancel},
    {"threads", test_threads},
    {"files", test_files},
    {"job", test_job},
    {"misuse-scene", test_misuse_scene},
    {"misuse-run", test_misuse_run},
    {"misuse-stepper", test_misuse_stepper},
    {"misuse-estimates", test_misuse_estimates},
    {"misuse-kernels", test_misuse_kernels},
    {"misuse-files", test_misuse_files},
};

int main(int count, char **arguments) {
    if (skep_abi_version() != SKEP_ABI_VERSION) {
        fprintf(stderr, "the library's interface is %u, the header's %d\n",
                (unsigned)skep_abi_version(), SKEP_ABI_VERSION);
        return 1;
    }
    for (size_t i = 0; count == 3 && i < sizeof TESTS / sizeof TESTS[0]; ++i) {
        if (strcmp(arguments[1], TESTS[i].mode) == 0) {
            check_start();
            TESTS[i].run(arguments[2]);
            return check_summary();
        }
    }
    fprintf(stderr, "usage: %s MODE FOLDER\n", arguments[0]);
    return 2;
}

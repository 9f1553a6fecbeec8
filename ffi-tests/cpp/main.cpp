// Tests of skep.hpp, built once for each way to handle errors and each version of C++: program
// FOLDER.
#include "parts.hpp"

#include <cstdio>

int main(int argc, char **argv) {
    if (argc != 2)
        return std::fputs("usage: program FOLDER\n", stderr), 2;
    const std::string folder = argv[1];
    test_library();
    test_spans();
    test_options();
    test_scene();
    test_moves();
    test_run(folder);
    test_progress();
    test_stepper_equal_whole();
    test_estimates();
    test_kernels();
    test_files(folder);
}

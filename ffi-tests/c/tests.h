/* The tests, each of them a mode of the program. Scratch files go into `folder`. */
#ifndef TESTS_H
#define TESTS_H

void test_whole(const char *folder);
void test_formats(const char *folder);
void test_inputs(const char *folder);
void test_stepper(const char *folder);
void test_own_maps(const char *folder);
void test_kernels(const char *folder);
void test_cancel(const char *folder);
void test_threads(const char *folder);
void test_files(const char *folder);
void test_job(const char *folder);
void test_misuse_scene(const char *folder);
void test_misuse_run(const char *folder);
void test_misuse_stepper(const char *folder);
void test_misuse_estimates(const char *folder);
void test_misuse_kernels(const char *folder);
void test_misuse_files(const char *folder);

#endif

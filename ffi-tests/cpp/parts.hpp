// The parts of the test of skep.hpp, and the scene they share.
#pragma once

#include "world.hpp"

#include <skep.hpp>
#include <string>

/// The wall in five views.
skep::Scene made_scene();
/// Options for a run of a fraction of a second.
skep::Options quick_options();

void test_library();
void test_spans();
void test_options();
void test_scene();
void test_moves();
void test_run(const std::string &folder);
void test_progress();
void test_stepper_equal_whole();
void test_estimates();
void test_kernels();
void test_files(const std::string &folder);

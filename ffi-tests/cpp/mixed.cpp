// One program whose parts handle errors differently: this one by values, mixed_throwing.cpp by
// exceptions.
#define SKEP_NO_EXCEPTIONS
#include "test.hpp"

bool throws_for_unknown_option();

int main() {
    skep::Expected<skep::Options> options = skep::Options::create();
    CHECK(options && !options->set("thread", 1));
    CHECK(throws_for_unknown_option());
}

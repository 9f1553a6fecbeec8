#include <skep.hpp>

bool throws_for_unknown_option();

bool throws_for_unknown_option() {
    skep::Options options;
    try {
        options.set("thread", 1);
    } catch (const skep::Error &error) {
        return error.status() == SKEP_ERR_ARGUMENT;
    }
    return false;
}

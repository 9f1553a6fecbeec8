/* The header alone, twice, and before anything else; a C++ compiler reads this file too. */
#include <skep.h>

#include <skep.h>

/* Macros as a program uses them: their values have to fit where they go, without casts. */
skep_status use_macros(skep_image *image, uint32_t cycle, const skep_statistics *statistics,
                       skep_status before);

skep_status use_macros(skep_image *image, uint32_t cycle, const skep_statistics *statistics,
                       skep_status before) {
    image->format = SKEP_FORMAT_BGR + SKEP_FORMAT_16;
    if (cycle == SKEP_CYCLE_NONE || statistics->status_counts[SKEP_PIXEL_MASKED] > 0) {
        return SKEP_OK;
    }
    switch (before) {
    case SKEP_ERR_NULL:
    case SKEP_ERR_PANIC:
        return 0 - SKEP_ERR_NULL;
    default:
        return skep_abi_version() == SKEP_ABI_VERSION ? SKEP_OK : SKEP_ERR_POISONED;
    }
}

/* The version of this header and of the library, and the macros that every other header uses. */
#ifndef PALPATE_VERSION_H
#define PALPATE_VERSION_H

#include <stddef.h>
#include <stdint.h>

/* Marks each function that the library exports. */
#ifndef PAL_API
#if defined(__GNUC__)
#define PAL_API __attribute__((visibility("default")))
#else
#define PAL_API
#endif
#endif

#ifdef __cplusplus
#define PAL_NOEXCEPT noexcept
#define PAL_NODISCARD [[nodiscard]]
#define PAL_ZERO \
  {}
#else
#define PAL_NOEXCEPT
#define PAL_NODISCARD
#define PAL_ZERO \
  { 0 }
#endif

#ifdef __cplusplus
extern "C" {
#endif

#define PAL_VERSION_MAJOR 0
#define PAL_VERSION_MINOR 1
#define PAL_VERSION_PATCH 0

/* The version that the caller is compiled against, as a number that rises: 1.2.3 is 1002003. */
#define PAL_VERSION (PAL_VERSION_MAJOR * 1000000 + PAL_VERSION_MINOR * 1000 + PAL_VERSION_PATCH)

/* The version of the library that the caller is linked with, as PAL_VERSION. Real-time safe: yes. */
PAL_API uint32_t pal_version(void) PAL_NOEXCEPT;

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_VERSION_H */

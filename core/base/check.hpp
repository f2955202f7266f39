/// MUST: an invariant whose breach is a bug; on in every build. AUDIT: the same where checking costs time; on in
/// `dev` and the sanitizer presets. (Not named CHECK: that is doctest's.)
#pragma once

#include <cstdio>
#include <cstdlib>

namespace lichthof {
[[noreturn]] inline void broken_invariant(const char* condition, const char* file, int line) {
  std::fprintf(stderr, "lichthof: broken invariant: %s (%s:%d)\n", condition, file, line);
  std::abort();
}
}  // namespace lichthof

#define MUST(condition) ((condition) ? void() : ::lichthof::broken_invariant(#condition, __FILE__, __LINE__))
#ifdef LICHTHOF_AUDIT
#define AUDIT(condition) MUST(condition)
#else
#define AUDIT(condition) void()
#endif

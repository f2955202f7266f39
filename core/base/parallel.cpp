#include "core/base/parallel.hpp"

#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include "core/base/check.hpp"

namespace lichthof {

struct Parallel::Arena {
  explicit Arena(unsigned threads) : arena(static_cast<int>(threads), 1) {}
  tbb::task_arena arena;
};

Parallel::Parallel(unsigned threads) : threads_(threads) {
  MUST(threads >= 1);
  if (threads > 1) arena_ = std::make_unique<Arena>(threads);
}

Parallel::~Parallel() = default;

void Parallel::for_each(std::size_t count, const std::function<void(std::size_t)>& task) const {
  if (!arena_ || count < 2) {
    for (std::size_t i = 0; i < count; ++i) task(i);
    return;
  }
  arena_->arena.execute([&] {
    tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) { task(i); }, tbb::simple_partitioner{});
  });
}

}  // namespace lichthof

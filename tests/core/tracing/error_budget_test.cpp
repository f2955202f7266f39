#include "core/tracing/error_budget.hpp"

#include <doctest/doctest.h>

using namespace lichthof;

namespace {
const ErrorKnobs begun{10000, 1e-3, 200, 256};
}

TEST_CASE("error_budget: who wants less error begins with more of everything") {
  ErrorKnobs before = first_knobs(0.2, {}, {});
  for (const double wanted : {0.1, 0.05, 0.02, 0.01, 0.003}) {
    const ErrorKnobs knobs = first_knobs(wanted, {}, {});
    CHECK(knobs.elements >= before.elements);
    CHECK(knobs.eps <= before.eps);
    CHECK(knobs.gather_rays >= before.gather_rays);
    CHECK(knobs.direct_rays >= before.direct_rays);
    before = knobs;
  }
}

TEST_CASE("error_budget: each part turns its own knob, further where it is larger") {
  const auto next = [](const ErrorParts& parts) { return *turned(begun, parts, 0.02, {}); };
  CHECK(next({.visibility = 0.03}) == ErrorKnobs{10000, 1e-3, 200, next({.visibility = 0.03}).direct_rays});
  CHECK(next({.visibility = 0.03}).direct_rays > begun.direct_rays);
  CHECK(next({.reconstruction = 0.03}).gather_rays > begun.gather_rays);
  CHECK(next({.reconstruction = 0.05}).gather_rays > next({.reconstruction = 0.02}).gather_rays);
  CHECK(next({.discretisation = 0.03}).elements > begun.elements);
  // Light is shot further where it has smaller elements to be shot from.
  CHECK(next({.discretisation = 0.03}).eps < begun.eps);
  CHECK(next({.convergence = 0.03}).eps < begun.eps);
  // All below their shares: still the largest goes on, so that no search stands still.
  CHECK(next({0.001, 0.001, 0.009, 0.001}).elements > begun.elements);
}

TEST_CASE("error_budget: what is fixed by hand stays, and when nothing is left it says so") {
  ErrorLimits limits;
  limits.turns_elements = false;
  CHECK(turned(begun, {.discretisation = 0.1, .convergence = 0.1}, 0.02, limits)->elements == begun.elements);
  CHECK_FALSE(turned(begun, {.discretisation = 0.1}, 0.02, limits));
  limits.turns_gather = limits.turns_eps = limits.turns_direct = false;
  CHECK(first_knobs(0.02, begun, limits) == begun);
  CHECK_FALSE(turned(begun, {0.1, 0.1, 0.1, 0.1}, 0.02, limits));
}

TEST_CASE("error_budget: edges of solved direct light ask for smaller elements there, all else for smaller ones everywhere") {
  const ErrorKnobs as_it_is{10000, 1e-3, 0, 0};
  ErrorLimits fixed;
  fixed.turns_gather = fixed.turns_direct = false;
  const ErrorKnobs edges = *turned(as_it_is, {.visibility = 0.1, .reconstruction = 0.02}, 0.02, fixed);
  CHECK(edges.keep < 1);
  CHECK(edges.elements == 10000);
  const ErrorKnobs everywhere = *turned(edges, {.visibility = 0.02, .reconstruction = 0.1}, 0.02, fixed);
  CHECK(everywhere.keep == 1);
  CHECK(everywhere.elements > 10000);
}

TEST_CASE(
    "error_budget: light that is read as the solution has it asks for smaller receivers, then for a finer mesh, or for "
    "a gather where one may come") {
  const ErrorKnobs interpolated{10000, 1e-3, 0, 256}, as_it_is{10000, 1e-3, 0, 0};
  ErrorLimits fixed;
  fixed.turns_gather = fixed.turns_direct = false;
  const ErrorKnobs refined = *turned(as_it_is, {.reconstruction = 0.1}, 0.02, fixed);
  CHECK(refined.keep < 1);
  CHECK(refined.elements == 10000);
  CHECK(turned(refined, {.reconstruction = 0.1}, 0.02, fixed)->elements > 10000);
  CHECK(turned(as_it_is, {.visibility = 0.1, .discretisation = 0.2}, 0.02, fixed)->elements > 10000);
  const ErrorKnobs gathered = *turned(interpolated, {.reconstruction = 0.1}, 0.02, {});
  CHECK(gathered.is_gathered());
  CHECK(gathered.elements == 10000);
}

TEST_CASE("error_budget: the parts add up to the whole, in squares") {
  ErrorEstimate estimate;
  estimate.visibility = 0.01, estimate.indirect = 0.05, estimate.solution = 0.03;
  const ErrorParts gathered = parts_of(estimate, 0.04, {.direct = 0.02, .indirect = 0.04}),
                   read = parts_of(estimate, 0.0, {});
  CHECK(gathered.visibility == doctest::Approx(0.02));
  CHECK(read.visibility == doctest::Approx(0.01));
  CHECK(gathered.reconstruction == doctest::Approx(0.04));
  CHECK(gathered.convergence == doctest::Approx(0.02));
  const auto square = [](const ErrorParts& p) {
    return p.reconstruction * p.reconstruction + p.discretisation * p.discretisation + p.convergence * p.convergence;
  };
  CHECK(square(gathered) == doctest::Approx(0.05 * 0.05));
  CHECK(square(read) == doctest::Approx(0.05 * 0.05));
  CHECK(read.discretisation == doctest::Approx(0.03));
}

TEST_CASE("error_budget: what paths find beyond the noise of reading is the solution's") {
  ErrorEstimate estimate;
  estimate.likely = 0.05, estimate.visibility = 0.2, estimate.indirect = 0.3, estimate.by_paths = true;
  const ErrorParts parts = parts_of(estimate, 0.0, {.direct = 0.03, .indirect = 0.0});
  CHECK(parts.visibility == doctest::Approx(0.03));
  CHECK(parts.discretisation == doctest::Approx(0.04));
}

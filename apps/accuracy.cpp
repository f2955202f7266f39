#include "apps/accuracy.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>

namespace lichthof::apps {

namespace {

constexpr std::uint32_t default_gather = 192, default_elements = 12000;
/// Where little error is left, a few places have most of it: many points are needed to meet them.
constexpr std::uint32_t check_points(double wanted) { return wanted < 0.03 ? 512 : 256; }
constexpr int most_rounds = 8;
/// A round ends the search when its estimate is below this share of what is wanted, and all that 95 % confidence leaves below
/// all of it: the estimate itself may be off, by less at more points.
constexpr double safe_share = 0.75, safe_share_at_more_points = 0.9;
/// Where it is not that safe but may be reached, more points tell, if that costs less than the next solution: about as many times
/// what this one cost.
constexpr std::uint32_t more_points = 4;
constexpr double next_solution = 3;
/// An estimate whose confidence reaches further than this above it is vague: a point or two may have made most of it.
constexpr double vague = 1.25;
/// An error of this size is all there is: what is wanted is reached within what the check can tell.
constexpr double least_error = 1e-4;

ErrorKnobs knobs_by_hand(const Run& run, Reading reading, std::optional<std::uint32_t> gather_rays) {
  ErrorKnobs knobs;
  knobs.elements = run.first_pass().elements.value_or(default_elements);
  knobs.eps = run.first_pass().eps.value_or(knobs.eps);
  if (reading == Reading::as_it_is || run.method() == Method::radiosity) knobs.direct_rays = 0;
  knobs.gather_rays = reading == Reading::at_sensors && knobs.direct_rays > 0 ? gather_rays.value_or(default_gather)
                                                                              : gather_rays.value_or(0);
  knobs.counts_gather = gather_rays.has_value();
  return knobs;
}

ErrorLimits limits_of(const Run& run, const ErrorKnobs& knobs, Reading reading,
                      std::optional<std::uint32_t> gather_rays) {
  ErrorLimits limits;
  const bool is_loaded = run.solution().has_value();
  limits.turns_elements = !is_loaded && run.first_pass().mesh_given().empty();
  limits.turns_eps = !is_loaded && !run.first_pass().eps;
  limits.turns_direct = !knobs.direct_is_solved();
  limits.turns_gather = limits.turns_direct && !gather_rays;
  limits.begins_interpolated = reading == Reading::in_picture;
  return limits;
}

nlohmann::json parts_json(const ErrorParts& parts) {
  return {{"visibility", parts.visibility},
          {"reconstruction", parts.reconstruction},
          {"discretisation", parts.discretisation},
          {"convergence", parts.convergence},
          {"dominant", name_of(parts.dominant())}};
}

nlohmann::json round_json(const ErrorKnobs& knobs, std::size_t elements, const ErrorEstimate& estimate,
                          const ErrorParts& parts, double seconds) {
  return {{"elements", elements},        {"eps", knobs.eps},
          {"gather", knobs.gather_rays}, {"direct_rays", knobs.direct_rays},
          {"estimate", estimate.error},  {"parts", parts_json(parts)},
          {"seconds", seconds}};
}

std::string percent(double share) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2g %%", 100 * share);
  return text;
}

}  // namespace

void add_error_options(CLI::App& command, ErrorWish& wish) {
  command
      .add_option("--error", wish.error,
                  "work until the RMS error of the irradiance over all surfaces is below this share of its RMS; "
                  "chooses what is "
                  "not set by hand")
      ->check(number_within(1e-4, 1))
      ->group("Accuracy")
      ->option_text("SHARE");
  command.add_flag("--check", wish.check, "estimate the error that is reached, at random points of the surfaces")
      ->group("Accuracy");
}

Status wish_fits(const ErrorWish& wish, const Run& run) {
  if (!wish.is_set() || has_first_pass(run.method())) return Done{};
  return Error{ErrorCode::bad_input, wish.error ? "--error" : "--check",
               std::string("method ") + name_of(run.method()) + " has no first pass whose error could be told; " +
                   (run.method() == Method::reference ? "its standard error is in the --json report of probe"
                                                      : "methods two-pass and radiosity have")};
}

Expected<ErrorKnobs> reach(Run& run, const ErrorWish& wish, Reading reading, std::optional<std::uint32_t> gather_rays,
                           const Interruption& interruption) {
  ErrorKnobs knobs = knobs_by_hand(run, reading, gather_rays);
  const ErrorLimits limits = limits_of(run, knobs, reading, gather_rays);
  const bool is_loaded = run.solution().has_value();
  const double wanted = wish.error.value_or(0);
  if (wish.error) {
    knobs.counts_gather = true;
    knobs = first_knobs(wanted, knobs, limits);
    if (!is_loaded) run.choose(limits.turns_elements ? std::optional(knobs.elements) : std::nullopt, knobs.eps);
  }
  nlohmann::json rounds = nlohmann::json::array();
  bool is_solved = is_loaded;
  bool is_new_mesh = true;
  double solve_s = 0, refined_to = 1;
  for (int round = 1;; ++round) {
    const Stopwatch watch;
    if (!is_solved) {
      // A finer mesh wants to be refined where the one before had to be.
      if (is_new_mesh && refined_to < 1) run.refine(refined_to);
      if (Status solved = run.solve(); !solved) return solved.error();
      solve_s = watch.seconds();
    }
    is_solved = true;
    knobs.eps = run.solution()->options.eps;
    if (interruption.asked() || !wish.is_set()) return knobs;
    const auto is_safe = [wanted](const ErrorEstimate& estimate, double share) {
      return estimate.error <= share * wanted && estimate.high <= wanted;
    };
    const auto seed = static_cast<std::uint64_t>(round);
    double share = safe_share;
    const Stopwatch check_watch;
    Run::Checked checked = run.check(knobs, check_points(wanted), wanted, seed);
    const bool may_do =
        checked.estimate.error <= safe_share_at_more_points * wanted && !is_safe(checked.estimate, share);
    const bool is_vague = is_safe(checked.estimate, share) && checked.estimate.high > vague * checked.estimate.error &&
                          checked.estimate.high > least_error;
    if (wish.error && (is_vague || (may_do && more_points * check_watch.seconds() <= next_solution * solve_s))) {
      share = safe_share_at_more_points;
      checked = run.check(knobs, more_points * check_points(wanted), wanted, seed + most_rounds);
    }
    const ErrorEstimate& estimate = checked.estimate;
    const ErrorParts parts = parts_of(estimate, checked.unshot, checked.sampling);
    rounds.push_back(round_json(knobs, run.solution()->mesh->elements.size(), estimate, parts, watch.seconds()));
    spdlog::info(
        "error {:.3g} ({:.3g} to {:.3g}): visibility {:.3g}, reconstruction {:.3g}, discretisation {:.3g}, convergence "
        "{:.3g}",
        estimate.error, estimate.low, estimate.high, parts.visibility, parts.reconstruction, parts.discretisation,
        parts.convergence);
    const bool is_met = !wish.error || is_safe(estimate, share) || estimate.high <= least_error;
    const std::optional<ErrorKnobs> next = is_met ? std::nullopt : turned(knobs, parts, wanted, limits);
    if (next && round < most_rounds && !interruption.asked()) {
      const std::uint32_t elements_before = knobs.elements;
      const double eps_before = knobs.eps;
      knobs = *next;
      const bool is_refined = knobs.keep < 1 && run.refine(knobs.keep);
      // Little can be done in places: all elements become smaller.
      if (knobs.keep < 1 && !is_refined) knobs.elements = std::min(2 * knobs.elements, limits.most_elements);
      if (is_refined) refined_to = knobs.keep;
      is_new_mesh = knobs.elements != elements_before;
      if (is_new_mesh || knobs.eps != eps_before)
        run.choose(is_new_mesh ? std::optional(knobs.elements) : std::nullopt, knobs.eps);
      is_solved = !is_refined && !is_new_mesh && knobs.eps == eps_before;
      continue;
    }
    nlohmann::json report = {{"estimate", estimate.error}, {"low", estimate.low},     {"high", estimate.high},
                             {"bias", estimate.bias},      {"noise", estimate.noise}, {"points", estimate.points},
                             {"parts", parts_json(parts)}, {"rounds", rounds}};
    std::string line = "error " + percent(estimate.error) + " (95 %: " + percent(estimate.low) + " to " +
                       percent(estimate.high) + "), bias " + percent(estimate.bias) + "; visibility " +
                       percent(parts.visibility) + ", reconstruction " + percent(parts.reconstruction) +
                       ", discretisation " + percent(parts.discretisation) + ", convergence " +
                       percent(parts.convergence);
    if (wish.error) {
      const bool is_reached = estimate.error <= wanted;
      report["wanted"] = wanted, report["met"] = is_reached;
      if (!is_reached) {
        const std::string why =
            next ? std::string("after ") + std::to_string(most_rounds) + " rounds"
                 : std::string("what is left is ") + name_of(parts.dominant()) + ", and nothing more can be turned";
        report["reason"] = why;
        spdlog::warn("an error of {} was asked for, {} is reached: {}", percent(wanted), percent(estimate.error), why);
      }
    }
    run.record().more["error"] = std::move(report);
    run.record().more["error_estimate"] = estimate.error;
    run.record().lines.push_back(std::move(line));
    return knobs;
  }
}

}  // namespace lichthof::apps
